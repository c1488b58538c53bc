//! Texels that a file already holds as a texture unit reads them, and their decoding.

use crate::channels::View;
use crate::srgb;
use formats::texture::{ColorSpace, TexelFormat};

/// Contents of an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ImageData {
    /// RGBA8 texels of level 0, row by row from the top (v = 0).
    Rgba8(Vec<u8>),
    /// Blocks of one or more levels.
    Blocks(Blocks),
}

/// Levels of an image as its file has them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Blocks {
    /// Format of the texture.
    pub format: TexelFormat,
    /// Format of `levels`: that of the texture, or RGBA8 where the file's own texels were decoded.
    pub held: TexelFormat,
    /// Bytes of each level in the file, largest level first; each holds its blocks row by row from the
    /// top.
    pub levels: Vec<Vec<u8>>,
    /// How the texture shows them.
    pub view: View,
}

impl Blocks {
    /// Whether the levels are the texture's own bytes.
    pub fn is_plain(&self) -> bool {
        self.held == self.format && self.view == View::default()
    }

    /// The RGBA8 texels of a level of an image whose level 0 has this size; `None` for a level that is
    /// missing or cannot be decoded.
    pub fn texels(&self, level: u32, size: [u32; 2], color_space: ColorSpace) -> Option<Vec<u8>> {
        let bytes = self.levels.get(level as usize)?;
        let size = level_size(size, level);
        let texels = decode(self.held, size, color_space, bytes)?;
        Some(self.view.shown(texels, size))
    }
}

/// Format and number of levels of an image's texture, known without reading the blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredBlocks {
    /// Format of the blocks.
    pub format: TexelFormat,
    /// Levels of the texture, at least one and at most a whole chain.
    pub levels: u32,
    /// Levels in the file, at least one. The others are made from level 0.
    pub held: u32,
}

/// Size of a level in texels.
pub fn level_size(size: [u32; 2], level: u32) -> [u32; 2] {
    size.map(|extent| extent.checked_shr(level).unwrap_or(0).max(1))
}

/// Levels of a whole mip chain.
pub fn whole_chain(size: [u32; 2]) -> u32 {
    size[0].max(size[1]).max(1).ilog2() + 1
}

/// Bytes of a level of that size.
pub fn level_bytes(format: TexelFormat, size: [u32; 2]) -> usize {
    let block = format.block();
    let across = |axis: usize| size[axis].div_ceil(block.texels[axis]) as usize;
    across(0) * across(1) * block.bytes as usize
}

/// True where level 0 consists of whole blocks, as drivers require of compressed textures.
pub fn is_whole_blocks(format: TexelFormat, size: [u32; 2]) -> bool {
    let block = format.block().texels;
    size[0].is_multiple_of(block[0]) && size[1].is_multiple_of(block[1])
}

/// The RGBA8 texels of a level; `None` for a format that is not decoded here or too few bytes.
///
/// A missing channel is 0 and a missing alpha 255, as texture units read them. The third channel of
/// a two-channel format (BC5, EAC RG11) completes a unit normal. Half-float texels (BC6H) are
/// clamped to 0..1.
pub fn decode(
    format: TexelFormat,
    size: [u32; 2],
    color_space: ColorSpace,
    bytes: &[u8],
) -> Option<Vec<u8>> {
    let bytes = bytes.get(..level_bytes(format, size))?;
    match format {
        TexelFormat::Rgba8 => Some(bytes.to_vec()),
        TexelFormat::Bc1 => Some(bcn::<4>(size, bytes, 8, bcdec_rs::bc1)),
        TexelFormat::Bc2 => Some(bcn::<4>(size, bytes, 16, bcdec_rs::bc2)),
        TexelFormat::Bc3 => Some(bcn::<4>(size, bytes, 16, bcdec_rs::bc3)),
        TexelFormat::Bc7 => Some(bcn::<4>(size, bytes, 16, bcdec_rs::bc7)),
        TexelFormat::Bc4 => {
            let red = |block: &[u8], texels: &mut [u8], pitch| {
                bcdec_rs::bc4(block, texels, pitch, false);
            };
            Some(spread(&bcn::<1>(size, bytes, 8, red), 1))
        }
        TexelFormat::Bc5 => {
            let red_green = |block: &[u8], texels: &mut [u8], pitch| {
                bcdec_rs::bc5(block, texels, pitch, false);
            };
            Some(spread(&bcn::<2>(size, bytes, 16, red_green), 2))
        }
        TexelFormat::Bc6h => Some(bc6h(size, color_space, bytes)),
        _ => by_words(format, size, bytes),
    }
}

/// Decodes 4x4 blocks into texels of `N` bytes.
fn bcn<const N: usize>(
    size: [u32; 2],
    bytes: &[u8],
    block_bytes: usize,
    decode: impl Fn(&[u8], &mut [u8], usize),
) -> Vec<u8> {
    let [width, height] = size.map(|e| e as usize);
    let mut texels = vec![0; width * height * N];
    let mut decoded = vec![0; 16 * N];
    for (number, block) in bytes.chunks_exact(block_bytes).enumerate() {
        let (x, y) = (
            number % width.div_ceil(4) * 4,
            number / width.div_ceil(4) * 4,
        );
        decode(block, &mut decoded, 4 * N);
        let columns = (width - x).min(4) * N;
        for row in 0..(height - y).min(4) {
            let to = ((y + row) * width + x) * N;
            texels[to..to + columns].copy_from_slice(&decoded[row * 4 * N..][..columns]);
        }
    }
    texels
}

/// RGBA8 from texels of one or two channels.
fn spread(texels: &[u8], channels: usize) -> Vec<u8> {
    let unit = |byte: u8| f32::from(byte) / 127.5 - 1.0;
    (texels.chunks_exact(channels))
        .flat_map(|t| match *t {
            [r, g] => {
                let z = (1.0 - unit(r) * unit(r) - unit(g) * unit(g)).max(0.0);
                [r, g, ((z.sqrt() + 1.0) * 127.5).round() as u8, 255]
            }
            _ => [t[0], 0, 0, 255],
        })
        .collect()
}

fn bc6h(size: [u32; 2], color_space: ColorSpace, bytes: &[u8]) -> Vec<u8> {
    let [width, height] = size.map(|e| e as usize);
    let mut texels = vec![255; width * height * 4];
    let mut decoded = [0.0_f32; 48];
    for (number, block) in bytes.chunks_exact(16).enumerate() {
        let (x, y) = (
            number % width.div_ceil(4) * 4,
            number / width.div_ceil(4) * 4,
        );
        bcdec_rs::bc6h_float(block, &mut decoded, 12, false);
        for row in 0..(height - y).min(4) {
            for column in 0..(width - x).min(4) {
                let to = ((y + row) * width + x + column) * 4;
                for channel in 0..3 {
                    let value = decoded[(row * 4 + column) * 3 + channel].clamp(0.0, 1.0);
                    texels[to + channel] = match color_space {
                        ColorSpace::Srgb => srgb::encode_byte(value),
                        ColorSpace::Linear => (value * 255.0 + 0.5) as u8,
                    };
                }
            }
        }
    }
    texels
}

/// Formats that texture2ddecoder turns into words of BGRA.
fn by_words(format: TexelFormat, size: [u32; 2], bytes: &[u8]) -> Option<Vec<u8>> {
    use texture2ddecoder as decoder;
    let [width, height] = size.map(|e| e as usize);
    let mut words = vec![0_u32; width * height];
    let astc = |edge: usize, words: &mut [u32]| {
        decoder::decode_astc(bytes, width, height, edge, edge, words)
    };
    match format {
        TexelFormat::Etc2 => decoder::decode_etc2_rgb(bytes, width, height, &mut words),
        TexelFormat::Etc2Rgba => decoder::decode_etc2_rgba8(bytes, width, height, &mut words),
        TexelFormat::EacR11 => decoder::decode_eacr(bytes, width, height, &mut words),
        TexelFormat::EacRg11 => decoder::decode_eacrg(bytes, width, height, &mut words),
        TexelFormat::Astc4x4 => astc(4, &mut words),
        TexelFormat::Astc5x5 => astc(5, &mut words),
        TexelFormat::Astc6x6 => astc(6, &mut words),
        TexelFormat::Astc8x8 => astc(8, &mut words),
        _ => return None,
    }
    .ok()?;
    let rgba = |word: u32| {
        let [b, g, r, a] = word.to_le_bytes();
        [r, g, b, a]
    };
    let texels: Vec<u8> = words.into_iter().flat_map(rgba).collect();
    Some(match format {
        TexelFormat::EacRg11 => {
            let two: Vec<u8> = texels.chunks_exact(4).flat_map(|t| [t[0], t[1]]).collect();
            spread(&two, 2)
        }
        _ => texels,
    })
}
