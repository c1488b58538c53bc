//! The texture table: properties of each texture, independent of any memory layout.

use serde::{Deserialize, Serialize};

/// Texel storage formats that a layout can place in memory.
///
/// A trace names the format used at capture; replay may choose another, since records hold
/// texture coordinates and not addresses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u16)]
pub enum TexelFormat {
    /// 4x4 texels in 8 bytes (DXT1).
    Bc1 = 1,
    /// 4x4 texels in 16 bytes (DXT5).
    Bc3 = 3,
    /// 4x4 texels in 16 bytes.
    Bc7 = 7,
    /// 4x4 texels in 8 bytes (ETC2 RGB8).
    Etc2 = 10,
    /// 4x4 texels in 16 bytes (ETC2 RGBA8 with EAC alpha).
    Etc2Rgba = 11,
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
}

/// Handling of coordinates outside 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Wrap {
    /// Repeat.
    Repeat = 0,
    /// Repeat, mirrored every other time.
    MirroredRepeat = 1,
    /// Clamp to the edge texel.
    ClampToEdge = 2,
}

/// Minification and magnification filter within a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Filter {
    /// One texel.
    Nearest = 0,
    /// 2x2 texels.
    Linear = 1,
}

/// Filter between mip levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum MipFilter {
    /// Level 0 only.
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
}

impl Sampler {
    /// Repeat, trilinear: glTF's usual sampler and the default of the models.
    pub const TRILINEAR_REPEAT: Self = Self {
        wrap: [Wrap::Repeat; 2],
        mag: Filter::Linear,
        min: Filter::Linear,
        mip: MipFilter::Linear,
    };
    /// Clamped, bilinear, without mip levels, for shadow maps.
    pub const SHADOW: Self = Self {
        wrap: [Wrap::ClampToEdge; 2],
        mag: Filter::Linear,
        min: Filter::Linear,
        mip: MipFilter::None,
    };
}

/// Colour space of the stored texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum ColorSpace {
    /// Linear data (normal maps, roughness, depth).
    Linear = 0,
    /// sRGB-encoded colour.
    Srgb = 1,
}

/// One texture (an image in memory) of a trace.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
}

impl Texture {
    /// Width and height of `level` in texels (halved and rounded down, at least 1).
    #[must_use]
    pub fn level_size(&self, level: u32) -> [u32; 2] {
        self.size
            .map(|extent| extent.checked_shr(level).unwrap_or(0).max(1))
    }
}
