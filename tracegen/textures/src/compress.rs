//! Compresses an image to blocks of all mip levels.

use crate::mipmap::{self, Level};
use crate::role::{Alpha, Role};
use formats::texture::{ColorSpace, TexelFormat, Texture};
use scene::blocks::level_bytes;
use std::borrow::Cow;
use texpresso::{Algorithm, COLOUR_WEIGHTS_PERCEPTUAL, COLOUR_WEIGHTS_UNIFORM, Format, Params};

/// Version of the encoder, and version of this crate's part, which must be increased when the same texels
/// give different bytes. It is part of the keys of cached textures. Tests check both versions.
pub const ENCODER: &str = "texpresso 2.0.2, mip chain 1";

/// Edge of a compressed block in texels.
const BLOCK: u32 = 4;

/// Size of level 0, rounded up to whole blocks.
pub fn whole_blocks(size: [u32; 2]) -> [u32; 2] {
    size.map(|e| e.next_multiple_of(BLOCK))
}

/// Number of levels of a complete mip chain.
pub fn level_count([width, height]: [u32; 2]) -> u32 {
    width.max(height).ilog2() + 1
}

/// The finest level to store if no level finer than `wanted` is sampled. A texture without the finer levels
/// must be sampled like the complete one. Its base must therefore consist of whole blocks, and each level
/// must have exactly half the size of the one before.
pub fn first_level(size: [u32; 2], wanted: u32) -> u32 {
    if size.iter().all(|extent| extent.is_power_of_two()) {
        let halvings = (size[0].min(size[1]) / BLOCK).max(1).ilog2();
        wanted.min(halvings)
    } else {
        0
    }
}

/// Size of a texture's levels from `first_level` on, in bytes.
pub fn chain_bytes(texture: &Texture, first_level: u32) -> usize {
    let bytes = |level| level_bytes(texture.format, texture.level_size(level));
    (first_level..texture.levels).map(bytes).sum()
}

/// Compresses RGBA8 texels of the given size. The result has the blocks of the levels from `first_level` on,
/// in order.
pub fn compress(
    rgba: &[u8],
    size: [u32; 2],
    color_space: ColorSpace,
    role: Role,
    first_level: u32,
) -> (TexelFormat, Vec<u8>) {
    let kind = mipmap::Kind {
        srgb: color_space == ColorSpace::Srgb,
        normal_map: role.normal_map,
    };
    let alpha = match role.alpha {
        Alpha::Mask(_) | Alpha::Smooth if rgba.chunks_exact(4).all(|t| t[3] == 255) => {
            Alpha::Ignored
        }
        alpha => alpha,
    };
    let weigh_by_alpha = alpha != Alpha::Ignored;
    let base_size = whole_blocks(size);
    let base = if base_size == size {
        Cow::Borrowed(rgba)
    } else {
        let level = Level::decode(rgba, size, kind, weigh_by_alpha);
        Cow::Owned(level.resize(base_size).encode(kind))
    };
    let (format, texel_format) = match alpha {
        Alpha::Smooth => (Format::Bc3, TexelFormat::Bc3),
        Alpha::Ignored | Alpha::Mask(_) => (Format::Bc1, TexelFormat::Bc1),
    };
    let coverage = match alpha {
        Alpha::Mask(cutoff) => mipmap::coverage(&base, cutoff),
        _ => 1.0,
    };
    let mut blocks = Vec::new();
    let mut texels = if first_level == 0 {
        base.to_vec()
    } else {
        Vec::new()
    };
    let mut level: Option<Level> = None;
    for index in 0..level_count(base_size) {
        if index > 0 {
            // Compute level 1 directly from the bytes. Level 0 in floats would be the largest allocation of
            // the whole capture.
            let next = match level {
                None => Level::half_of(&base, base_size, kind, weigh_by_alpha),
                Some(level) => level.half(kind),
            };
            if index >= first_level {
                texels = next.encode(kind);
            }
            level = Some(next);
        }
        if index < first_level {
            continue;
        }
        match alpha {
            Alpha::Ignored => mipmap::make_opaque(&mut texels),
            Alpha::Mask(cutoff) if index == 0 => mipmap::binarise(&mut texels, cutoff),
            Alpha::Mask(_) => {
                let cutoff = mipmap::cutoff_for_coverage(&texels, coverage);
                mipmap::binarise(&mut texels, cutoff);
            }
            Alpha::Smooth => {}
        }
        let level_size = base_size.map(|e| (e >> index).max(1));
        append_blocks(&mut blocks, &texels, level_size, format, kind.srgb);
    }
    (texel_format, blocks)
}

/// RGBA8 texels of level 1 and all coarser levels of an image that keeps its alpha.
pub fn chain(
    base: &[u8],
    size: [u32; 2],
    color_space: ColorSpace,
    normal_map: bool,
) -> Vec<Vec<u8>> {
    let kind = mipmap::Kind {
        srgb: color_space == ColorSpace::Srgb,
        normal_map,
    };
    let is_translucent = base.chunks_exact(4).any(|texel| texel[3] != 255);
    let mut levels = Vec::new();
    let mut last: Option<Level> = None;
    for _ in 1..level_count(size) {
        let next = match &last {
            None => Level::half_of(base, size, kind, is_translucent),
            Some(level) => level.half(kind),
        };
        levels.push(next.encode(kind));
        last = Some(next);
    }
    levels
}

fn append_blocks(
    blocks: &mut Vec<u8>,
    rgba: &[u8],
    size: [u32; 2],
    format: Format,
    perceptual: bool,
) {
    let [width, height] = size.map(|e| e as usize);
    let params = Params {
        algorithm: Algorithm::RangeFit,
        weights: if perceptual {
            COLOUR_WEIGHTS_PERCEPTUAL
        } else {
            COLOUR_WEIGHTS_UNIFORM
        },
        weigh_colour_by_alpha: false,
    };
    let start = blocks.len();
    blocks.resize(start + format.compressed_size(width, height), 0);
    format.compress(rgba, width, height, params, &mut blocks[start..]);
}
