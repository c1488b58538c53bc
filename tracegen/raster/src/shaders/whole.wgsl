// One triangle over the whole target, at the nearest depth.
@vertex
fn vertex_whole(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let ndc = vec2(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    return vec4(ndc, 1.0, 1.0);
}
