// What Vulkan's compiler in Mesa makes of `m * v`; OpenGL's begins with the first column, and the last bits
// of positions would differ.
fn product(m: mat4x4<f32>, v: vec4<f32>) -> vec4<f32> {
    return m[0] * v.x + (m[1] * v.y + (m[2] * v.z + m[3] * v.w));
}
