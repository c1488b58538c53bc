//! The fields.

use crate::targets::COLOR;
use ash::vk::{
    self, BorderColor, Filter, ImageViewType as Kind, SamplerAddressMode as Wrap,
    SamplerCreateInfo as Sampler, SamplerMipmapMode as Between,
};

/// How descriptors reach a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum How {
    /// Written to a set.
    Set,
    /// The samplers are part of the set's layout.
    Immutable,
    /// Pushed.
    Pushed,
    /// The views are pushed, the samplers are part of the layout.
    PushedImmutable,
}

/// An image view.
#[derive(Clone, Copy)]
pub struct View {
    pub kind: Kind,
    pub format: vk::Format,
    pub components: vk::ComponentMapping,
    /// First level and number of levels.
    pub levels: [u32; 2],
    /// First layer and number of layers.
    pub layers: [u32; 2],
}

/// A draw: how it differs from the first one.
pub struct Field {
    /// Name on the command line.
    pub name: &'static str,
    /// Type of the first texture in the shader.
    texture: &'static str,
    /// The colour, from `uv`, which covers 0 to 1, textures `a` and `b` and samplers `s` and `r`.
    color: &'static str,
    sampler: fn(Sampler<'static>) -> Sampler<'static>,
    /// Changes of the second sampler from the first one.
    other: fn(Sampler<'static>) -> Sampler<'static>,
    view: View,
    second: View,
    pub how: How,
}

impl Field {
    /// The shaders.
    pub fn text(&self) -> String {
        format!(
            "@group(0) @binding(0) var a: {};
            @group(0) @binding(1) var s: sampler;
            @group(0) @binding(2) var b: texture_2d<f32>;
            @group(0) @binding(3) var r: sampler;
            struct Fragment {{ @builtin(position) position: vec4<f32>, @location(0) uv: vec2<f32> }}
            @vertex fn vertex(@builtin(vertex_index) index: u32) -> Fragment {{
                let corner = vec2(f32((index << 1u) & 2u), f32(index & 2u));
                return Fragment(vec4(2.0 * corner - 1.0, 0.5, 1.0), corner);
            }}
            @fragment fn fragment(in: Fragment) -> @location(0) vec4<f32> {{
                let uv = in.uv;
                return {};
            }}",
            self.texture, self.color
        )
    }

    /// The two samplers.
    pub fn samplers(&self) -> [Sampler<'static>; 2] {
        let base = Sampler::default()
            .mipmap_mode(Between::NEAREST)
            .max_lod(vk::LOD_CLAMP_NONE);
        let first = (self.sampler)(base);
        [first, (self.other)(first)]
    }

    /// The two views.
    pub fn views(&self) -> [View; 2] {
        [self.view, self.second]
    }
}

const FLAT: &str = "texture_2d<f32>";

const VIEW: View = View {
    kind: Kind::TYPE_2D,
    format: COLOR,
    components: vk::ComponentMapping {
        r: vk::ComponentSwizzle::IDENTITY,
        g: vk::ComponentSwizzle::IDENTITY,
        b: vk::ComponentSwizzle::IDENTITY,
        a: vk::ComponentSwizzle::IDENTITY,
    },
    levels: [0, 7],
    layers: [0, 1],
};

const BASE: Field = Field {
    name: "base",
    texture: FLAT,
    color: "textureSample(a, s, uv)",
    sampler: |s| s,
    other: |s| s,
    view: VIEW,
    second: VIEW,
    how: How::Set,
};

const fn sampler(
    name: &'static str,
    color: &'static str,
    sampler: fn(Sampler<'static>) -> Sampler<'static>,
) -> Field {
    Field {
        name,
        color,
        sampler,
        ..BASE
    }
}

const fn view(name: &'static str, color: &'static str, view: View, second: View) -> Field {
    Field {
        name,
        color,
        view,
        second,
        ..BASE
    }
}

/// A field with `texture` as type and `kind` of the view of all layers.
const fn layered(
    name: &'static str,
    (texture, kind): (&'static str, Kind),
    color: &'static str,
    sampler: fn(Sampler<'static>) -> Sampler<'static>,
) -> Field {
    Field {
        name,
        texture,
        color,
        sampler,
        view: View {
            kind,
            layers: [0, 6],
            ..VIEW
        },
        ..BASE
    }
}

const ARRAY: (&str, Kind) = ("texture_2d_array<f32>", Kind::TYPE_2D_ARRAY);
const CUBE: (&str, Kind) = ("texture_cube<f32>", Kind::CUBE);

fn flat(s: Sampler<'static>) -> Sampler<'static> {
    s.max_lod(0.25)
}

fn linear(s: Sampler<'static>) -> Sampler<'static> {
    s.min_filter(Filter::LINEAR).mag_filter(Filter::LINEAR)
}

fn trilinear(s: Sampler<'static>) -> Sampler<'static> {
    linear(s).mipmap_mode(Between::LINEAR)
}

fn anisotropic(s: Sampler<'static>) -> Sampler<'static> {
    trilinear(s).anisotropy_enable(true).max_anisotropy(16.0)
}

const WIDE: &str = "textureSample(a, s, uv * vec2(8.0, 1.0))";
const BEYOND: &str = "textureSample(a, s, vec2(0.5 + 0.75 * uv.x, uv.y))";
const AFTER: &str = "textureSample(a, s, vec2(1.0 + 0.5 * uv.x, uv.y))";
const BEFORE: &str = "textureSample(a, s, vec2(-0.5 + 0.5 * uv.x, uv.y))";
/// The face +x at half of its coordinates, up to two of its edges.
const CORNER: &str = "textureSample(a, s, vec3(1.0, -uv.y, -uv.x))";

/// Every field.
pub const FIELDS: &[Field] = &[
    BASE,
    // Filters.
    sampler("mag-nearest", "textureSample(a, s, 0.5 * uv)", |s| {
        s.min_filter(Filter::LINEAR)
    }),
    sampler("mag-linear", "textureSample(a, s, 0.5 * uv)", |s| {
        s.mag_filter(Filter::LINEAR)
    }),
    sampler("min-nearest", "textureSample(a, s, 2.0 * uv)", |s| {
        flat(s).mag_filter(Filter::LINEAR)
    }),
    sampler("min-linear", "textureSample(a, s, 2.0 * uv)", |s| {
        flat(s).min_filter(Filter::LINEAR)
    }),
    sampler("mip-nearest", "textureSample(a, s, 3.0 * uv)", |s| s),
    sampler("mip-linear", "textureSample(a, s, 3.0 * uv)", |s| {
        s.mipmap_mode(Between::LINEAR)
    }),
    // Wrap modes.
    sampler("wrap-repeat", BEYOND, flat),
    sampler("wrap-mirrored", BEYOND, |s| {
        flat(s).address_mode_u(Wrap::MIRRORED_REPEAT)
    }),
    sampler("wrap-clamp", AFTER, |s| {
        flat(s).address_mode_u(Wrap::CLAMP_TO_EDGE)
    }),
    sampler("wrap-border", BEYOND, |s| {
        flat(s)
            .address_mode_u(Wrap::CLAMP_TO_BORDER)
            .border_color(BorderColor::FLOAT_OPAQUE_WHITE)
    }),
    sampler("wrap-mirror-once-before", BEFORE, |s| {
        flat(s).address_mode_u(Wrap::MIRROR_CLAMP_TO_EDGE)
    }),
    sampler("wrap-mirror-once-after", AFTER, |s| {
        flat(s).address_mode_u(Wrap::MIRROR_CLAMP_TO_EDGE)
    }),
    sampler("wrap-v", "textureSample(a, s, 1.0 + 0.5 * uv)", |s| {
        flat(s).address_mode_v(Wrap::CLAMP_TO_EDGE)
    }),
    // Level of detail.
    sampler("lod-bias", BASE.color, |s| s.mip_lod_bias(1.0)),
    sampler("lod-bias-negative", "textureSample(a, s, 4.0 * uv)", |s| {
        s.mip_lod_bias(-1.0)
    }),
    sampler("min-lod", BASE.color, |s| s.min_lod(3.0)),
    sampler("max-lod", "textureSample(a, s, 8.0 * uv)", |s| {
        s.max_lod(1.0)
    }),
    sampler("max-lod-zero", "textureSample(a, s, 2.0 * uv)", |s| {
        s.max_lod(0.0).min_filter(Filter::LINEAR)
    }),
    sampler("max-lod-quarter", "textureSample(a, s, 4.0 * uv)", |s| {
        s.max_lod(0.25).mipmap_mode(Between::LINEAR)
    }),
    // Anisotropy.
    sampler("aniso-off", WIDE, |s| {
        anisotropic(s).anisotropy_enable(false)
    }),
    sampler("aniso-16", WIDE, anisotropic),
    sampler("aniso-2", WIDE, |s| anisotropic(s).max_anisotropy(2.0)),
    sampler("aniso-nearest", WIDE, |s| {
        s.anisotropy_enable(true).max_anisotropy(16.0)
    }),
    sampler("aniso-flat", WIDE, |s| {
        flat(linear(s)).anisotropy_enable(true).max_anisotropy(16.0)
    }),
    sampler(
        "aniso-bias",
        "textureSampleBias(a, s, uv * vec2(8.0, 1.0), 1.0)",
        anisotropic,
    ),
    sampler(
        "aniso-own-bias",
        "textureSampleBias(a, s, uv * vec2(8.0, 1.0), floor(uv.x) + 1.0)",
        anisotropic,
    ),
    sampler(
        "aniso-level",
        "textureSampleLevel(a, s, uv * vec2(8.0, 1.0), 0.0)",
        anisotropic,
    ),
    sampler(
        "aniso-gradients",
        "textureSampleGrad(a, s, uv * vec2(8.0, 1.0), vec2(0.125, 0.0), vec2(0.0, 0.015625))",
        anisotropic,
    ),
    sampler("aniso-gather", "textureGather(0, a, s, uv)", anisotropic),
    layered(
        "aniso-array",
        ARRAY,
        "textureSample(a, s, uv * vec2(8.0, 1.0), i32(2.0 * uv.y))",
        anisotropic,
    ),
    layered(
        "aniso-cube",
        CUBE,
        "textureSample(a, s, vec3(1.0, 1.0 - 2.0 * uv.y, 1.0 - 2.0 * fract(8.0 * uv.x)))",
        anisotropic,
    ),
    Field {
        name: "aniso-mixed",
        color: "textureSample(a, s, uv * vec2(8.0, 1.0)) + textureSample(b, r, uv * vec2(8.0, 1.0))",
        sampler: anisotropic,
        other: |s| s.anisotropy_enable(false),
        ..BASE
    },
    // Coordinates in texels.
    sampler(
        "unnormalized",
        "textureSampleLevel(a, s, 32.0 * uv, 0.0)",
        |s| {
            s.unnormalized_coordinates(true)
                .max_lod(0.0)
                .address_mode_u(Wrap::CLAMP_TO_EDGE)
                .address_mode_v(Wrap::CLAMP_TO_EDGE)
        },
    ),
    // Cube maps.
    layered("cube", CUBE, CORNER, linear),
    layered("cube-seams", CUBE, CORNER, |s| {
        linear(s).flags(vk::SamplerCreateFlags::NON_SEAMLESS_CUBE_MAP_EXT)
    }),
    // Views.
    view(
        "view-level",
        BASE.color,
        View {
            levels: [2, 1],
            ..VIEW
        },
        VIEW,
    ),
    view(
        "view-levels",
        "textureSample(a, s, 4.0 * uv)",
        View {
            levels: [1, 2],
            ..VIEW
        },
        VIEW,
    ),
    view(
        "view-layer",
        BASE.color,
        View {
            layers: [3, 1],
            ..VIEW
        },
        VIEW,
    ),
    view(
        "view-swizzle",
        "textureSample(a, s, uv) + textureSample(b, s, uv)",
        View {
            components: vk::ComponentMapping {
                r: vk::ComponentSwizzle::ONE,
                g: vk::ComponentSwizzle::R,
                ..VIEW.components
            },
            ..VIEW
        },
        VIEW,
    ),
    view(
        "views-of-levels",
        "textureSampleBias(a, s, uv, 1.0) + textureSample(b, s, uv)",
        VIEW,
        View {
            levels: [1, 3],
            ..VIEW
        },
    ),
    view(
        "views-of-formats",
        "textureSample(a, s, uv) + textureSample(b, s, uv)",
        VIEW,
        View {
            format: vk::Format::R8G8B8A8_SRGB,
            ..VIEW
        },
    ),
    Field {
        second: View {
            layers: [2, 1],
            ..VIEW
        },
        ..layered(
            "views-of-layers",
            ARRAY,
            "textureSample(a, s, uv, 2i) + textureSample(b, s, uv)",
            |s| s,
        )
    },
    view(
        "views-apart",
        "textureSample(a, s, uv) + textureSample(b, s, uv)",
        VIEW,
        View {
            layers: [1, 1],
            ..VIEW
        },
    ),
    // How descriptors reach the draw.
    Field {
        name: "immutable",
        how: How::Immutable,
        ..sampler("", WIDE, anisotropic)
    },
    Field {
        name: "pushed",
        how: How::Pushed,
        ..sampler("", WIDE, anisotropic)
    },
    Field {
        name: "pushed-immutable",
        how: How::PushedImmutable,
        ..sampler("", WIDE, anisotropic)
    },
];
