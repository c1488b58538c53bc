// Entry points of pictures of two views, each of which learns which view it is in.

var<private> view_number: u32;

@vertex
fn vertex_main(in: Vertex, @builtin(view_index) view: u32) -> Fragment {
    view_number = view;
    return transform(in, vec4(1.0));
}

@vertex
fn vertex_colored(in: Vertex, @location(5) color: vec4<f32>, @builtin(view_index) view: u32) -> Fragment {
    view_number = view;
    return transform(in, color);
}

@vertex
fn vertex_background(@builtin(vertex_index) index: u32, @builtin(view_index) view: u32) -> Background {
    view_number = view;
    return background_corner(index);
}

@fragment
fn fragment_background(in: Background, @builtin(view_index) view: u32) -> @location(0) vec4<f32> {
    view_number = view;
    return background_color(in);
}

@fragment
fn fragment_masked(in: Fragment, @builtin(front_facing) front: bool, @builtin(view_index) view: u32) -> @location(0) vec4<f32> {
    view_number = view;
    return masked(in, front);
}

@fragment
fn fragment_early(in: Fragment, @builtin(front_facing) front: bool, @builtin(view_index) view: u32) -> @location(0) vec4<f32> {
    view_number = view;
    return shaded(in, front);
}
