//! Compiles the shaders from WGSL to SPIR-V.

use crate::Stereo;
use crate::objects::Object;
use crate::wgsl::compile;

/// Inputs and textures of every fragment shader.
const HEAD: &str = "
struct Eyes { clip_from_world: array<mat4x4<f32>, 2> }
@group(0) @binding(0) var<uniform> eyes: Eyes;
@group(1) @binding(0) var flat: texture_2d<f32>;
@group(1) @binding(1) var nearest: sampler;
@group(1) @binding(2) var other: texture_2d<f32>;
@group(1) @binding(3) var layered: texture_2d_array<f32>;
@group(1) @binding(4) var sky: texture_cube<f32>;
@group(1) @binding(5) var volume: texture_3d<f32>;
@group(1) @binding(6) var bordered: sampler;
@group(1) @binding(7) var linear: sampler;
struct Constants { eye: u32, scale: f32 }
var<immediate> constants: Constants;
struct Fragment {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) direction: vec3<f32>,
}
";

/// SPIR-V of an object's vertex and fragment shader, with entry points `vertex` and `fragment`.
///
/// With `reads`, the vertex shader also fetches and samples texels, which changes no vertex.
pub fn words(object: &Object, stereo: Stereo, reads: bool) -> Result<Vec<u32>, String> {
    let read = match reads {
        // Within the textures; beyond texels, levels and layers; gathered; and of a kind that is not recorded.
        true => {
            "let n = i32(number);
            var sum = textureLoad(flat, vec2<i32>(n % 4, 2), 0);
            let corner = vec2<f32>(f32(n % 2 + 1), 8.0) / 32.0;
            sum += textureSampleLevel(layered, linear, corner, n % 3, 1.0);
            sum += textureLoad(flat, vec2<i32>(n % 3 - 1, 0), n % 9);
            sum += textureLoad(layered, vec2<i32>(0, 0), n % 6 - 1, 1);
            let inside = vec2<f32>((f32(n % 2) + 0.3) / 8.0, 0.3);
            sum += textureSampleLevel(layered, linear, inside, n % 6 - 1, f32(n % 9) - 1.0);
            sum += textureGather(0, flat, nearest, corner);
            sum += textureLoad(volume, vec3<i32>(0, 0, 0), 0);
            out.uv += vec2<f32>(min(sum.x, 0.0));"
        }
        false => "",
    };
    let number = match reads {
        true => ", @builtin(vertex_index) number: u32",
        false => "",
    };
    let eye = match stereo {
        Stereo::Multiview => ", @builtin(view_index) eye: i32",
        _ => "",
    };
    let index = match stereo {
        Stereo::Multiview => "eye",
        _ => "constants.eye",
    };
    let text = format!(
        "{HEAD}
        @vertex fn vertex(
            @location(0) place: vec3<f32>, @location(1) uv: vec2<f32>, @location(2) direction: vec3<f32>,
            @builtin(instance_index) instance: u32{eye}{number}
        ) -> Fragment {{
            var out: Fragment;
            // Each instance is nearer than the one before.
            let at = place + f32(instance) * vec3(0.05, 0.02, 0.3);
            out.position = eyes.clip_from_world[{index}] * vec4(at * constants.scale, 1.0);
            out.uv = uv;
            out.direction = direction;
            {read}
            return out;
        }}
        @fragment fn fragment(in: Fragment) -> @location(0) vec4<f32> {{ {} }}",
        object.body
    );
    let text = if stereo == Stereo::Multiview {
        text.replace("eye: i32", "eye: u32")
    } else {
        text
    };
    compile(&text)
}

/// SPIR-V of a compute shader that reads a texel, with entry point `compute`.
pub fn compute() -> Result<Vec<u32>, String> {
    compile(&format!(
        "{HEAD}
        var<workgroup> unused: vec4<f32>;
        @compute @workgroup_size(8, 4, 1) fn compute(@builtin(global_invocation_id) id: vec3<u32>) {{
            let texel = textureLoad(flat, id.xy % vec2<u32>(4u, 4u), 0);
            if texel.x > 2.0 {{ unused = texel; }}
        }}"
    ))
}
