// What Vulkan's compiler in Mesa makes of the same expressions. OpenGL's sums in another order (matrices from
// the first column on, dot products from the last component on), and the last bits of positions, coordinates and
// depths would differ.

fn product(m: mat4x4<f32>, v: vec4<f32>) -> vec4<f32> {
    return m[0] * v.x + (m[1] * v.y + (m[2] * v.z + m[3] * v.w));
}

fn turned(m: mat4x4<f32>, v: vec3<f32>) -> vec3<f32> {
    return m[0].xyz * v.x + (m[1].xyz * v.y + m[2].xyz * v.z);
}

fn inner(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return (a.x * b.x + a.y * b.y) + a.z * b.z;
}

// Rows from the top. OpenGL's own clip control would turn the picture as well, and with it the rule for edges
// through pixel centres: bottom ones instead of top ones would be covered.
fn placed(clip: vec4<f32>) -> vec4<f32> {
    return vec4(clip.x, -clip.y, clip.zw);
}
