fn product(m: mat4x4<f32>, v: vec4<f32>) -> vec4<f32> {
    return m * v;
}
