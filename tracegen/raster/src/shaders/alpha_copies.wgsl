// What fills the copies of alpha: see lavapipe::alpha.

@group(0) @binding(0) var level: texture_2d<f32>;

@fragment
fn fragment_alpha(@builtin(position) position: vec4<f32>) -> @location(0) f32 {
    return textureLoad(level, vec2<i32>(position.xy), 0).a;
}
