//! The shader's source: constants that it shares with the host, then the WGSL files.

use crate::draws::{SHADOW_SIZE, SHADOW_TAPS};
use crate::groups::{MATERIAL_TEXTURES, SLOTS};
use crate::lighting::MAX_POINT_LIGHTS;
use crate::uniforms::MAX_CASCADES;
use formats::textrace::NO_GROUP;
use record::{DEPTH_BYTES, RECORD_BYTES};

/// Bindings of group 0.
pub(crate) const VIEW_BINDINGS: [&str; 7] = [
    "VIEW",
    "INSTANCES",
    "COUNTER",
    "RECORDS",
    "SHADOW_MAP",
    "SHADOW_SAMPLER",
    "DEPTHS",
];
/// Binding of the material's uniforms in group 1.
pub(crate) const MATERIAL_BINDING: u32 = 0;
/// First of the material's [`MATERIAL_TEXTURES`] texture bindings in group 1.
pub(crate) const TEXTURES_BINDING: u32 = 1;
/// First of the sampler bindings in group 1, in the order of the textures.
pub(crate) const SAMPLERS_BINDING: u32 = TEXTURES_BINDING + MATERIAL_TEXTURES as u32;

/// The whole WGSL module, with what records where the device can capture.
pub(crate) fn source(captures: bool) -> String {
    let mut text = String::new();
    if captures {
        text += "enable primitive_index;\n\n";
    }
    let mut constant = |name: &str, value: u64| {
        text += &format!("const {name}: u32 = {value}u;\n");
    };
    for (value, slot) in (0..).zip(SLOTS) {
        constant(slot, value);
    }
    for (value, binding) in (0..).zip(VIEW_BINDINGS) {
        constant(&format!("{binding}_BINDING"), value);
    }
    constant("MATERIAL_BINDING", MATERIAL_BINDING.into());
    constant("TEXTURES_BINDING", TEXTURES_BINDING.into());
    constant("SAMPLERS_BINDING", SAMPLERS_BINDING.into());
    constant("MATERIAL_TEXTURES", MATERIAL_TEXTURES as u64);
    constant("MAX_CASCADES", MAX_CASCADES as u64);
    constant("MAX_POINT_LIGHTS", MAX_POINT_LIGHTS as u64);
    constant("NO_GROUP", NO_GROUP.into());
    constant("RECORD_WORDS", RECORD_BYTES / 4);
    constant("DEPTH_WORDS", DEPTH_BYTES / 4);
    text += &format!("const SHADOW_SIZE: f32 = {SHADOW_SIZE}.0;\n");
    for (number, [x, y]) in SHADOW_TAPS.iter().enumerate() {
        text += &format!("const SHADOW_TAP_{number}: vec2<i32> = vec2<i32>({x}, {y});\n");
    }
    let recording = if captures {
        concat!(
            include_str!("shaders/recording.wgsl"),
            "\n",
            include_str!("shaders/capturing.wgsl")
        )
    } else {
        include_str!("shaders/plain.wgsl")
    };
    for part in [
        include_str!("shaders/interface.wgsl"),
        recording,
        include_str!("shaders/shading.wgsl"),
        include_str!("shaders/passes.wgsl"),
    ] {
        text.push('\n');
        text += part;
    }
    text
}
