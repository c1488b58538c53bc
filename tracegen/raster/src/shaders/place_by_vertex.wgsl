// Primitives are numbered by their vertices, three each and none shared: softpipe loses draws whose fragments
// ask for the number of their primitive, and starts counting vertices anew in the middle of long draws.

struct Place {
    @builtin(front_facing) front: bool,
}

// The vertices have added it to that of the draw's first primitive.
fn primitive_of(place: Place) -> u32 {
    return 0u;
}

@vertex
fn vertex_numbered(in: Vertex, @location(6) number: u32) -> Fragment {
    var out = transform(in, vec4(1.0));
    out.ids.y += number;
    return out;
}

@vertex
fn vertex_numbered_colored(
    in: Vertex,
    @location(5) color: vec4<f32>,
    @location(6) number: u32,
) -> Fragment {
    var out = transform(in, color);
    out.ids.y += number;
    return out;
}
