//! The shader's source: constants shared with the host, followed by the WGSL files.

use crate::draws::{SHADOW_SIZE, SHADOW_TAPS};
use crate::lighting::MAX_POINT_LIGHTS;
use crate::uniforms::MAX_CASCADES;
use formats::textrace::NO_GROUP;
use record::RECORD_BYTES;
use scene::TextureSlot;

/// Bindings of group 0.
pub const VIEW_BINDINGS: [&str; 7] = [
    "VIEW",
    "INSTANCES",
    "COUNTER",
    "RECORDS",
    "SHADOW_MAP",
    "SHADOW_SAMPLER",
    "DEPTHS",
];
/// Binding of the material's uniforms in group 1.
pub const MATERIAL_BINDING: u32 = 0;
/// First of the material's texture bindings in group 1, in the order of [`TextureSlot::ALL`].
pub const TEXTURES_BINDING: u32 = 1;
/// First of the sampler bindings in group 1, in the order of the textures.
pub const SAMPLERS_BINDING: u32 = TEXTURES_BINDING + TextureSlot::COUNT as u32;
/// Binding of the copy that alpha tests sample in group 1, if there are copies.
pub const ALPHA_BINDING: u32 = SAMPLERS_BINDING + TextureSlot::COUNT as u32;

/// Source of alpha tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlphaSource {
    /// The base colour.
    Color,
    /// A copy of its alpha.
    Copy,
}

impl AlphaSource {
    fn part(self) -> &'static str {
        match self {
            Self::Color => include_str!("shaders/alpha_of_color.wgsl"),
            Self::Copy => include_str!("shaders/alpha_of_copy.wgsl"),
        }
    }
}

/// How fragments are recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Granularity {
    /// Not recorded, on devices that cannot capture.
    None,
    /// Not recorded, in pictures of two views at once.
    TwoViews,
    /// Quad by quad.
    Quads,
    /// One by one, for merging into quads: see [`record::MergedQuads`].
    Fragments,
    /// One by one, with primitives numbered by unshared vertices.
    NumberedFragments,
}

impl Granularity {
    /// The parts of the source that record.
    fn parts(self) -> &'static [&'static str] {
        const BY_BALLOT: &str = include_str!("shaders/by_ballot.wgsl");
        const BY_FRAGMENT: &str = include_str!("shaders/by_fragment.wgsl");
        const BY_INDEX: &str = include_str!("shaders/place_by_index.wgsl");
        const BY_VERTEX: &str = include_str!("shaders/place_by_vertex.wgsl");
        const RECORDING: &str = include_str!("shaders/recording.wgsl");
        const CAPTURING: &str = include_str!("shaders/capturing.wgsl");
        const TEXELS: &str = include_str!("shaders/texels.wgsl");
        const VULKAN: &str = include_str!("shaders/conventions_vulkan.wgsl");
        const OPENGL: &str = include_str!("shaders/conventions_opengl.wgsl");
        const ONE: &str = include_str!("shaders/one_view.wgsl");
        const ONE_PLAIN: &str = include_str!("shaders/one_view_plain.wgsl");
        const TWO: &str = include_str!("shaders/two_views.wgsl");
        const PLAIN: &str = include_str!("shaders/plain.wgsl");
        match self {
            Self::None => &[VULKAN, PLAIN, ONE, ONE_PLAIN],
            Self::TwoViews => &[VULKAN, PLAIN, TWO],
            Self::Quads => &[VULKAN, BY_BALLOT, RECORDING, CAPTURING, TEXELS, ONE],
            Self::Fragments => &[
                VULKAN,
                BY_INDEX,
                BY_FRAGMENT,
                RECORDING,
                CAPTURING,
                TEXELS,
                ONE,
            ],
            Self::NumberedFragments => &[
                OPENGL,
                BY_VERTEX,
                BY_FRAGMENT,
                RECORDING,
                CAPTURING,
                TEXELS,
                ONE,
            ],
        }
    }

    /// Whether the driver numbers the primitives.
    fn by_index(self) -> bool {
        matches!(self, Self::Quads | Self::Fragments)
    }

    /// Whether there are entry points that record.
    fn records(self) -> bool {
        !matches!(self, Self::None | Self::TwoViews)
    }
}

/// The whole WGSL module, with the recording code.
pub fn source(granularity: Granularity, alpha: AlphaSource) -> String {
    let mut text = String::new();
    if granularity.by_index() {
        text += "enable primitive_index;\n\n";
    }
    let mut constant = |name: &str, value: u64| {
        text += &format!("const {name}: u32 = {value}u;\n");
    };
    for slot in TextureSlot::ALL {
        constant(&shader_name(slot).to_uppercase(), slot as u64);
    }
    for (value, binding) in (0..).zip(VIEW_BINDINGS) {
        constant(&format!("{binding}_BINDING"), value);
    }
    let views = if granularity == Granularity::TwoViews {
        2
    } else {
        1
    };
    constant("VIEW_COUNT", views);
    constant("MATERIAL_BINDING", MATERIAL_BINDING.into());
    constant("TEXTURES_BINDING", TEXTURES_BINDING.into());
    constant("SAMPLERS_BINDING", SAMPLERS_BINDING.into());
    constant("ALPHA_BINDING", ALPHA_BINDING.into());
    constant("MATERIAL_TEXTURES", TextureSlot::COUNT as u64);
    constant("MAX_CASCADES", MAX_CASCADES as u64);
    constant("MAX_POINT_LIGHTS", MAX_POINT_LIGHTS as u64);
    constant("NO_GROUP", NO_GROUP.into());
    constant("RECORD_VECTORS", RECORD_BYTES / 16);
    text += &format!("const SHADOW_SIZE: f32 = {SHADOW_SIZE}.0;\n");
    for (number, [x, y]) in SHADOW_TAPS.iter().enumerate() {
        text += &format!("const SHADOW_TAP_{number}: vec2<i32> = vec2<i32>({x}, {y});\n");
    }
    let before = [include_str!("shaders/interface.wgsl"), alpha.part()];
    let after = [
        include_str!("shaders/shading.wgsl"),
        include_str!("shaders/passes.wgsl"),
    ];
    for part in before.iter().chain(granularity.parts()).chain(&after) {
        text.push('\n');
        text += part;
    }
    text.push('\n');
    text += &textures();
    if granularity.records() {
        text += &record_groups();
        text += &texels();
    }
    text
}

/// A slot's name in the shader.
fn shader_name(slot: TextureSlot) -> String {
    slot.name().replace('-', "_")
}

/// A sample of a slot's texture.
fn sample(name: &str, number: &str) -> String {
    format!("textureSample({name}_texture, {name}_sampler, texture_uv({number}, in.uv))")
}

/// Declarations of the material's textures, and the light that the textures of layers leave.
fn textures() -> String {
    let mut text = String::new();
    let mut layers = String::new();
    for slot in TextureSlot::ALL {
        let name = shader_name(slot);
        let number = name.to_uppercase();
        text += &format!(
            "@group(1) @binding(TEXTURES_BINDING + {number}) var {name}_texture: texture_2d<f32>;\n\
             @group(1) @binding(SAMPLERS_BINDING + {number}) var {name}_sampler: sampler;\n"
        );
        if slot.is_of_layer() {
            let sample = sample(&name, &number);
            layers += &format!(
                "    if (TEXTURES & (1u << {number})) != 0u {{ kept -= LAYER_WEIGHT * {sample}.g; }}\n"
            );
        }
    }
    text + &format!(
        "\nfn kept_by_layers(in: Fragment) -> f32 {{\n    var kept = 1.0;\n{layers}    return kept;\n}}\n"
    )
}

/// One record per group of texture coordinates; returns the index of the base colour's.
fn record_groups() -> String {
    let mut text =
        "\nfn record_groups(lane: Lane, in: Fragment) -> u32 {\n    var first = NONE;\n".to_owned();
    for slot in TextureSlot::ALL {
        let number = shader_name(slot).to_uppercase();
        let index = match slot {
            TextureSlot::BaseColor => "first",
            _ => "_",
        };
        text += &format!(
            "    if (LEADERS & (1u << {number})) != 0u {{ {index} = record_uv(lane, \
             countOneBits(LEADERS & ((1u << {number}) - 1u)), true, texture_uv({number}, in.uv)); }}\n"
        );
    }
    text + "    return first;\n}\n"
}

/// The texel of the slot that is checked.
fn texels() -> String {
    let mut text =
        "\nfn texel_of(in: Fragment) -> vec4<f32> {\n    var color = vec4(0.0);\n".to_owned();
    for slot in TextureSlot::ALL {
        let name = shader_name(slot);
        let number = name.to_uppercase();
        let sample = sample(&name, &number);
        text += &format!(
            "    if (TEXTURES & (1u << {number})) != 0u && views[view_number].counts.z == {number} {{ color = {sample}; }}\n"
        );
    }
    text + "    return color;\n}\n"
}
