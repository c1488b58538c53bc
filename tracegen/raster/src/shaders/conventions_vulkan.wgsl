// Arithmetic whose last bits decide what is recorded, as Vulkan's compiler orders it, and where clip space
// has its rows; `conventions_opengl.wgsl` holds the same for OpenGL.

fn product(m: mat4x4<f32>, v: vec4<f32>) -> vec4<f32> {
    return m * v;
}

// The same by the matrix's first three columns and rows.
fn turned(m: mat4x4<f32>, v: vec3<f32>) -> vec3<f32> {
    return mat3x3(m[0].xyz, m[1].xyz, m[2].xyz) * v;
}

fn inner(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return dot(a, b);
}

fn placed(clip: vec4<f32>) -> vec4<f32> {
    return clip;
}
