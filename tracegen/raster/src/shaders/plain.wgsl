// In place of recording.wgsl and capturing.wgsl where nothing is captured.

fn shaded(in: Fragment, front: bool) -> vec4<f32> {
    let geometric = select(-1.0, 1.0, front) * safe_normalize(in.normal);
    return shade(in, front, base_color(in), find_cascade(in.world, geometric));
}
