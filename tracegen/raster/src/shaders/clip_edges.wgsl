// Triangles across every edge of clip space, and some that cross an edge in the second view alone: a
// driver that draws them otherwise for both views at once than view by view cannot be trusted with both.

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) color: vec3<f32>,
}

fn hash(number: u32) -> f32 {
    var n = number * 747796405u + 2891336453u;
    n = ((n >> ((n >> 28u) + 4u)) ^ n) * 277803737u;
    return f32(((n >> 22u) ^ n) & 0xffffu) / 65535.0;
}

fn corner(index: u32, view: u32) -> Corner {
    let w = 0.1 + 2.0 * hash(4u * index);
    var x = (6.0 * hash(4u * index + 1u) - 3.0) + 0.2 * f32(view);
    var y = 6.0 * hash(4u * index + 2u) - 3.0;
    var z = w * (1.6 * hash(4u * index + 3u) - 0.3);
    if (index / 3u) % 2u == 1u {
        // Inside near the right edge; across it in the second view.
        x = w * (0.6 + 0.38 * hash(4u * index + 1u) + 0.2 * f32(view));
        y = w * (1.8 * hash(4u * index + 2u) - 0.9);
        z = w * (0.1 + 0.8 * hash(4u * index + 3u));
    }
    var out: Corner;
    out.position = vec4(x, y, z, w);
    let triangle = index / 3u;
    out.color = vec3(hash(triangle + 7000u), hash(triangle + 8000u), hash(triangle + 9000u));
    return out;
}

@vertex
fn vertex_both(@builtin(vertex_index) index: u32, @builtin(view_index) view: u32) -> Corner {
    return corner(index, view);
}

override VIEW: u32 = 0u;

@vertex
fn vertex_one(@builtin(vertex_index) index: u32) -> Corner {
    return corner(index, VIEW);
}

@fragment
fn fragment_color(in: Corner) -> @location(0) vec4<f32> {
    return vec4(in.color, 1.0);
}
