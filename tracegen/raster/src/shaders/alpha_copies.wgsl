// What fills the copies of alpha: see lavapipe::alpha.

@group(0) @binding(0) var level: texture_2d<f32>;

// One triangle over the whole copy.
@vertex
fn vertex_whole(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let ndc = vec2(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    return vec4(ndc, 0.0, 1.0);
}

@fragment
fn fragment_alpha(@builtin(position) position: vec4<f32>) -> @location(0) f32 {
    return textureLoad(level, vec2<i32>(position.xy), 0).a;
}
