//! The texture table: properties of each texture, independent of any memory layout.

use serde::{Deserialize, Serialize};

/// Texel storage formats that a layout can place in memory.
///
/// A trace names the format used at capture; replay may choose another, since records hold
/// texture coordinates and not addresses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u16)]
pub enum TexelFormat {
    /// 4x4 texels in 8 bytes (DXT1).
    #[default]
    Bc1 = 1,
    /// 4x4 texels in 16 bytes (DXT3).
    Bc2 = 2,
    /// 4x4 texels in 16 bytes (DXT5).
    Bc3 = 3,
    /// 4x4 texels of one channel in 8 bytes.
    Bc4 = 4,
    /// 4x4 texels of two channels in 16 bytes.
    Bc5 = 5,
    /// 4x4 half-float texels in 16 bytes.
    Bc6h = 6,
    /// 4x4 texels in 16 bytes.
    Bc7 = 7,
    /// 4x4 texels in 8 bytes (ETC2 RGB8).
    Etc2 = 10,
    /// 4x4 texels in 16 bytes (ETC2 RGBA8 with EAC alpha).
    Etc2Rgba = 11,
    /// 4x4 texels of one channel in 8 bytes (EAC).
    EacR11 = 12,
    /// 4x4 texels of two channels in 16 bytes (EAC).
    EacRg11 = 13,
    /// 4x4 texels in 16 bytes.
    #[serde(rename = "astc-4x4")]
    Astc4x4 = 20,
    /// 5x5 texels in 16 bytes.
    #[serde(rename = "astc-5x5")]
    Astc5x5 = 21,
    /// 6x6 texels in 16 bytes.
    #[serde(rename = "astc-6x6")]
    Astc6x6 = 22,
    /// 8x8 texels in 16 bytes.
    #[serde(rename = "astc-8x8")]
    Astc8x8 = 23,
    /// One texel in 4 bytes.
    Rgba8 = 40,
    /// One 32-bit float texel in 4 bytes (shadow maps).
    R32f = 41,
    /// One texel in 1 byte.
    R8 = 42,
    /// One texel in 2 bytes.
    Rg8 = 43,
    /// One texel in 2 bytes, packed: 5-6-5, 5-5-5-1 or 4-4-4-4 bits.
    Packed16 = 44,
    /// One 16-bit texel in 2 bytes, float or not.
    R16 = 45,
    /// Two 16-bit channels in 4 bytes.
    Rg16 = 46,
    /// Four 16-bit channels in 8 bytes.
    Rgba16 = 47,
    /// Two 32-bit channels in 8 bytes.
    Rg32 = 48,
    /// Four 32-bit channels in 16 bytes.
    Rgba32 = 49,
    /// One texel in 4 bytes, packed: 10-10-10-2 bits, 11-11-10 bits or a shared exponent.
    Packed32 = 50,
    /// One 16-bit depth in 2 bytes (shadow maps).
    D16 = 51,
}

impl TexelFormat {
    /// Whether the format holds depth: a shadow map.
    pub const fn is_depth(self) -> bool {
        matches!(self, Self::R32f | Self::D16)
    }

    /// Whether texels can be stored in another colour format: neither depth nor more than 8 bits per channel.
    pub const fn is_ordinary_color(self) -> bool {
        !matches!(
            self,
            Self::R32f
                | Self::D16
                | Self::Bc6h
                | Self::R16
                | Self::Rg16
                | Self::Rgba16
                | Self::Rg32
                | Self::Rgba32
                | Self::Packed32
        )
    }
}

/// Handling of coordinates outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Wrap {
    /// Repeat.
    #[default]
    Repeat = 0,
    /// Repeat, mirrored every other time.
    MirroredRepeat = 1,
    /// Clamp to the edge texel.
    ClampToEdge = 2,
    /// Texels outside have the border's colour and are not read.
    ClampToBorder = 3,
    /// Mirrored once, then clamped to the edge texel.
    MirrorClampToEdge = 4,
}

impl Wrap {
    /// Whether coordinates that differ by two whole units select the same texel.
    pub const fn is_periodic(self) -> bool {
        matches!(self, Self::Repeat | Self::MirroredRepeat)
    }
}

/// Minification and magnification filter within a level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Filter {
    /// One texel.
    #[default]
    Nearest = 0,
    /// 2x2 texels.
    Linear = 1,
}

/// Filter between mip levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum MipFilter {
    /// Level 0 only.
    #[default]
    None = 0,
    /// The nearer level.
    Nearest = 1,
    /// Both levels (trilinear with a linear `Filter`).
    Linear = 2,
}

/// The part of a sampler's state that determines which texels are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Sampler {
    /// Wrap mode in u and v.
    pub wrap: [Wrap; 2],
    /// Magnification filter.
    pub mag: Filter,
    /// Minification filter.
    pub min: Filter,
    /// Filter between levels.
    pub mip: MipFilter,
    /// Bias and bounds of the level of detail, applied before levels are chosen.
    #[serde(default, skip_serializing_if = "LodRange::is_whole")]
    pub lod: LodRange,
    /// Largest anisotropy in 1/256: 256, which filters all pixels alike, to 4096.
    #[serde(default = "isotropic", skip_serializing_if = "is_isotropic")]
    pub max_anisotropy_256ths: u16,
}

fn isotropic() -> u16 {
    Sampler::ISOTROPIC
}

fn is_isotropic(max_anisotropy_256ths: &u16) -> bool {
    *max_anisotropy_256ths == Sampler::ISOTROPIC
}

/// A sampler's bias and bounds of the level of detail, in 1/256 of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct LodRange {
    /// Added first.
    pub bias_256ths: i16,
    /// At least this.
    pub min_256ths: i16,
    /// At most this.
    pub max_256ths: i16,
}

impl Default for LodRange {
    fn default() -> Self {
        Self::WHOLE
    }
}

impl LodRange {
    /// No bias and no bounds.
    pub const WHOLE: Self = Self {
        bias_256ths: 0,
        min_256ths: i16::MIN,
        max_256ths: i16::MAX,
    };

    /// Whether there is no bias, and no bound other than the texture's levels.
    pub fn is_whole(&self) -> bool {
        *self == Self::WHOLE
    }

    /// The level of detail after bias and bounds.
    #[inline]
    pub fn apply(&self, lod: f32) -> f32 {
        let [bias, min, max] =
            [self.bias_256ths, self.min_256ths, self.max_256ths].map(|v| f32::from(v) / 256.0);
        (lod + bias).max(min).min(max)
    }
}

impl Sampler {
    /// Largest anisotropy of a sampler that filters all pixels alike, in 1/256.
    pub const ISOTROPIC: u16 = 256;
    /// Largest anisotropy of all APIs, in 1/256.
    pub const MOST_ANISOTROPIC: u16 = 4096;

    /// Whether long and narrow pixels are filtered differently from others.
    pub fn is_anisotropic(&self) -> bool {
        !is_isotropic(&self.max_anisotropy_256ths)
    }

    /// Whether the minification filter blends texels of a level that the level of detail chooses.
    pub fn blends_levels(&self) -> bool {
        self.min == Filter::Linear && self.mip != MipFilter::None
    }

    /// Largest ratio of a pixel's axes that the filter follows, at least 1.
    pub fn max_anisotropy(&self) -> f32 {
        f32::from(self.max_anisotropy_256ths) / f32::from(Self::ISOTROPIC)
    }

    /// Repeat, trilinear: glTF's usual sampler and the default of every model here.
    pub const TRILINEAR_REPEAT: Self = Self {
        wrap: [Wrap::Repeat; 2],
        mag: Filter::Linear,
        min: Filter::Linear,
        mip: MipFilter::Linear,
        lod: LodRange::WHOLE,
        max_anisotropy_256ths: Self::ISOTROPIC,
    };
    /// Clamped, bilinear, without mip levels, for shadow maps.
    pub const SHADOW: Self = Self {
        wrap: [Wrap::ClampToEdge; 2],
        mip: MipFilter::None,
        ..Self::TRILINEAR_REPEAT
    };
}

impl Default for Sampler {
    fn default() -> Self {
        Self::TRILINEAR_REPEAT
    }
}

/// Colour space of the stored texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum ColorSpace {
    /// Linear data (normal maps, roughness, depth).
    #[default]
    Linear = 0,
    /// sRGB-encoded colour.
    Srgb = 1,
}

/// One texture (an image in memory) of a trace.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Texture {
    /// Name for reports: the image's file name, or the procedural texture's.
    pub name: String,
    /// Width and height of level 0 in texels.
    pub size: [u32; 2],
    /// Mip levels present, at least 1.
    pub levels: u32,
    /// Array layers, at least 1.
    pub layers: u32,
    /// Format used at capture.
    pub format: TexelFormat,
    /// Colour space of the texels.
    pub color_space: ColorSpace,
    /// The texture whose memory it is a part of: a program can see one image through several views.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<Part>,
}

/// Place of a texture in the memory of another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Part {
    /// Index of the other texture, which is no part.
    pub of: u32,
    /// Its level that is level 0 of the part.
    pub level: u32,
    /// Its layer that is layer 0 of the part.
    pub layer: u32,
}

impl Texture {
    /// Whether `whole` has the levels and layers of the part at this place, in blocks of the same size and order.
    pub fn fits(&self, part: Part, whole: &Self) -> bool {
        let ends = [(part.level, self.levels), (part.layer, self.layers)]
            .map(|(first, count)| u64::from(first) + u64::from(count));
        let kinds = [self.format, whole.format].map(|format| {
            (
                format.block(),
                format.is_depth(),
                format.is_ordinary_color(),
            )
        });
        whole.part.is_none()
            && ends[0] <= whole.levels.into()
            && ends[1] <= whole.layers.into()
            && self.size == whole.level_size(part.level)
            && kinds[0] == kinds[1]
    }

    /// Width and height of `level` in texels (halved and rounded down, at least 1).
    pub fn level_size(&self, level: u32) -> [u32; 2] {
        self.size
            .map(|extent| extent.checked_shr(level).unwrap_or(0).max(1))
    }
}
