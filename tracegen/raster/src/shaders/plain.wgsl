// In place of recording.wgsl and capturing.wgsl on devices that cannot capture.

@fragment
fn fragment_early(in: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let geometric = select(-1.0, 1.0, front) * safe_normalize(in.normal);
    return shade(in, front, base_color(in), find_cascade(in.world, geometric));
}
