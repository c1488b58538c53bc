// The entry point of opaque and blended draws where nothing is captured.

@fragment
fn fragment_early(in: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    return shaded(in, front);
}
