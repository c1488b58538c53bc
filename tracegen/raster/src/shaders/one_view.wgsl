// Entry points of pictures. Those for two views at once are in two_views.wgsl.

const view_number: u32 = 0u;

@vertex
fn vertex_main(in: Vertex) -> Fragment {
    return transform(in, vec4(1.0));
}

@vertex
fn vertex_colored(in: Vertex, @location(5) color: vec4<f32>) -> Fragment {
    return transform(in, color);
}

@vertex
fn vertex_background(@builtin(vertex_index) index: u32) -> Background {
    return background_corner(index);
}

@fragment
fn fragment_background(in: Background) -> @location(0) vec4<f32> {
    return background_color(in);
}

@fragment
fn fragment_masked(in: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    return masked(in, front);
}
