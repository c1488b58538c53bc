//! Shaders of the random program.

use crate::gpu::Result;

/// Offsets of the fragment shader's push constants. The layer has no room for its number with the last one,
/// which ends at the last byte that every device has.
pub const OFFSETS: [u32; 4] = [16, 64, 108, 112];

/// Bodies of fragment shaders.
pub const BODIES: [&str; 10] = [
    "return textureSample(first, first_sampler, in.uv) * tint;",
    "return textureSampleBias(first, first_sampler, in.uv, 1.0) * tint;",
    "return textureSampleLevel(first, first_sampler, in.uv, 2.0 * in.uv.x) * tint;",
    "return textureLoad(first, vec2<i32>(in.position.xy) % vec2<i32>(4), 0) * tint;",
    "let color = textureSample(first, first_sampler, in.uv) * tint;
    if fract(5.0 * in.uv.x) < 0.4 { discard; }
    return color;",
    "return textureGather(1, first, first_sampler, in.uv) * tint;",
    "var color = vec4(0.0);
    for (var i = 0; i < 1 + i32(3.0 * in.uv.y); i++) {
        color += 0.4 * textureSampleLevel(first, first_sampler, in.uv * f32(i), f32(i));
    }
    return color * tint;",
    "if in.uv.x + in.uv.y < 0.9 { return tint; }
    return textureSampleLevel(first, first_sampler, in.uv, 0.0);",
    "return tint;",
    // Needs a second set.
    "return textureSample(first, first_sampler, in.uv) * tint
        + 0.5 * textureSample(second, second_sampler, in.uv.yx);",
];
/// The body that reads a second set.
pub const OF_TWO_SETS: usize = 9;

const VARYING: &str = "
struct Varying { @builtin(position) position: vec4<f32>, @location(0) uv: vec2<f32> }
";

/// SPIR-V of the vertex shader, with entry point `vertex`.
pub fn vertex() -> Result<Vec<u32>> {
    crate::wgsl::compile(&format!(
        "{VARYING}
        struct Constants {{ place: vec4<f32> }}
        var<immediate> constants: Constants;
        @vertex fn vertex(
            @location(0) at: vec2<f32>, @location(1) uv: vec2<f32>, @builtin(instance_index) instance: u32
        ) -> Varying {{
            let place = constants.place;
            let depth = 0.1 + 0.8 * fract(7.3 * place.z + 3.1 * place.x + 0.37 * f32(instance));
            var out: Varying;
            out.position = vec4(at * place.xy + place.zw + 0.1 * f32(instance), depth, 1.0);
            out.uv = uv;
            return out;
        }}"
    ))
}

/// SPIR-V of a fragment shader, with entry point `fragment`. Its push constant is at one of the offsets.
pub fn fragment(body: usize, offset: usize) -> Result<Vec<u32>> {
    let mut words = crate::wgsl::compile(&format!(
        "{VARYING}
        struct Constants {{ r: f32, g: f32, b: f32, a: f32 }}
        var<immediate> constants: Constants;
        @group(0) @binding(0) var first: texture_2d<f32>;
        @group(0) @binding(1) var first_sampler: sampler;
        @group(1) @binding(0) var second: texture_2d<f32>;
        @group(1) @binding(1) var second_sampler: sampler;
        @fragment fn fragment(in: Varying) -> @location(0) vec4<f32> {{
            let tint = vec4(constants.r, constants.g, constants.b, constants.a);
            {}
        }}",
        BODIES[body]
    ))?;
    move_members(&mut words, OFFSETS[offset]);
    Ok(words)
}

/// Moves the members of the only block of a module.
fn move_members(words: &mut [u32], by: u32) {
    const DECORATE: u32 = 71;
    const MEMBER_DECORATE: u32 = 72;
    const BLOCK: u32 = 2;
    const OFFSET: u32 = 35;
    let mut starts = vec![5];
    while let Some(&at) = starts.last().filter(|at| **at < words.len()) {
        starts.push(at + (words[at] >> 16).max(1) as usize);
    }
    starts.pop();
    let is = |words: &[u32], at: usize, opcode| words[at] & 0xffff == opcode;
    let block = starts
        .iter()
        .find(|at| is(words, **at, DECORATE) && words[**at + 2] == BLOCK)
        .map(|at| words[*at + 1]);
    for at in starts {
        if is(words, at, MEMBER_DECORATE) && Some(words[at + 1]) == block && words[at + 3] == OFFSET
        {
            words[at + 4] += by;
        }
    }
}
