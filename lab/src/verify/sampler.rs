//! A texture unit in software: blocks decoded one by one, sRGB, wrapping, trilinear filtering.

use super::lod::taps;
use formats::texture::{ColorSpace, Sampler, TexelFormat, Texture};
use glam::{DVec2, DVec3, DVec4};
use scene::blocks::{decode, level_bytes};
use textures::{CompressedTexture, TextureSet};

/// Edge of a compressed block in texels.
const BLOCK: u32 = 4;

/// Samples the textures that a capture uploaded.
#[derive(Clone, Copy)]
pub struct SoftwareSampler<'a> {
    set: &'a TextureSet,
    decoder: Decoder,
}

/// Decoding of blocks to linear light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decoder {
    /// Without rounding, according to the specification.
    Exact,
    /// Colours between a block's end points in 8 bits, like Mesa: see [`between`].
    EightBits,
    /// The same, with llvmpipe's polynomial for sRGB: see [`polynomial_of_srgb`].
    EightBitsAndPolynomial,
}

impl<'a> SoftwareSampler<'a> {
    /// A sampler of `set`.
    pub fn new(set: &'a TextureSet) -> Self {
        Self {
            set,
            decoder: Decoder::Exact,
        }
    }

    /// The same sampler with another decoder.
    #[must_use]
    pub fn with(self, decoder: Decoder) -> Self {
        Self { decoder, ..self }
    }

    /// The texture of an image, if it has blocks.
    pub fn texture(&self, image: usize) -> Option<&'a CompressedTexture> {
        let index = (*self.set.of_image.get(image)?)?;
        self.set
            .textures
            .get(index)
            .filter(|t| !t.blocks.is_empty())
    }

    /// A filtered colour: linear red, green, blue, and alpha.
    pub fn sample(
        &self,
        texture: &CompressedTexture,
        sampler: &Sampler,
        uv: DVec2,
        lod: f64,
    ) -> DVec4 {
        let mut sum = DVec4::ZERO;
        for tap in taps(uv, lod, &texture.texture, sampler) {
            let texel = |x: usize, y: usize| {
                let at = [tap.texels[0][x], tap.texels[1][y]];
                texel(texture, tap.level, at, self.decoder)
            };
            let row = |y: usize| texel(0, y).lerp(texel(1, y), tap.between.x);
            sum += row(0).lerp(row(1), tap.between.y) * tap.weight;
        }
        sum
    }
}

/// A decoded texel in linear light. Levels finer than the prepared ones are read from the finest prepared
/// level.
fn texel(of: &CompressedTexture, level: u32, at: [u32; 2], decoder: Decoder) -> DVec4 {
    let encoded = decoded(of, level.max(of.first_level), at, decoder).unwrap_or_default();
    if of.texture.color_space == ColorSpace::Srgb {
        let linear = match decoder {
            Decoder::EightBitsAndPolynomial => polynomial_of_srgb,
            Decoder::Exact | Decoder::EightBits => linear_of_srgb,
        };
        let [r, g, b] = [encoded.x, encoded.y, encoded.z].map(linear);
        return DVec4::new(r, g, b, encoded.w);
    }
    encoded
}

/// A texel of a level as its block encodes it; `None` if there are no such blocks.
fn decoded(of: &CompressedTexture, level: u32, at: [u32; 2], decoder: Decoder) -> Option<DVec4> {
    let block_bytes = match of.held {
        TexelFormat::Bc1 => 8,
        TexelFormat::Bc3 => 16,
        _ => return stored(of, level, at),
    };
    let blocks = |level| blocks_of(&of.texture, level);
    let before: usize = (of.first_level..level)
        .map(|l| blocks(l).iter().product::<usize>())
        .sum();
    let [column, row] = at.map(|v| (v / BLOCK) as usize);
    let offset = (before + row * blocks(level)[0] + column) * block_bytes;
    let block = of.blocks.get(offset..offset + block_bytes)?;
    let texel = at[1] % BLOCK * BLOCK + at[0] % BLOCK;
    let (alpha, color) = block.split_at(block_bytes - 8);
    let (rgb, opaque) = color_of(color, texel, alpha.is_empty(), decoder);
    let alpha = if alpha.is_empty() {
        f64::from(u8::from(opaque))
    } else {
        let exact = alpha_of(alpha, texel);
        match decoder {
            Decoder::Exact => exact,
            // In floating point, whole steps are not always whole multiples of 1/255.
            _ => (exact * 255.0 + 1e-6).floor() / 255.0,
        }
    };
    Some(rgb.extend(alpha))
}

/// A texel of a format that is never made and only kept, by the decoder that the driver's copy was made
/// with.
fn stored(of: &CompressedTexture, level: u32, at: [u32; 2]) -> Option<DVec4> {
    let format = of.held;
    let block = format.block();
    let before: usize = (of.first_level..level)
        .map(|l| level_bytes(format, of.texture.level_size(l)))
        .sum();
    let across = (of.texture.level_size(level)[0]).div_ceil(block.texels[0]) as usize;
    let [column, row] = [0, 1].map(|axis| (at[axis] / block.texels[axis]) as usize);
    let bytes = block.bytes as usize;
    let offset = before + (row * across + column) * bytes;
    let encoded = of.blocks.get(offset..offset + bytes)?;
    let texels = decode(format, block.texels, of.texture.color_space, encoded)?;
    let [x, y] = [0, 1].map(|axis| at[axis] % block.texels[axis]);
    let texel = &texels[(y * block.texels[0] + x) as usize * 4..][..4];
    let [r, g, b, a] = [0, 1, 2, 3].map(|channel| f64::from(texel[channel]) / 255.0);
    Some(DVec4::new(r, g, b, a))
}

/// Colour of a texel of a BC1 block, and whether it is opaque: end points with 8 bits per channel; the
/// specification interpolates between them without rounding.
fn color_of(block: &[u8], texel: u32, may_be_transparent: bool, decoder: Decoder) -> (DVec3, bool) {
    let word = |at: usize| u32::from(block[at]) | u32::from(block[at + 1]) << 8;
    let ends = [word(0), word(2)];
    let [a, b] = ends.map(|c| {
        let five = |v: u32| v << 3 | v >> 2;
        let green = c >> 5 & 63;
        DVec3::new(
            five(c >> 11).into(),
            (green << 2 | green >> 4).into(),
            five(c & 31).into(),
        ) / 255.0
    });
    let index = (word(4) | word(6) << 16) >> (2 * texel) & 3;
    let three_colors = may_be_transparent && ends[0] <= ends[1];
    let color = match (index, three_colors) {
        (0, _) => a,
        (1, _) => b,
        (2, false) => between(a, b, 1.0 / 3.0, decoder),
        (3, false) => between(a, b, 2.0 / 3.0, decoder),
        (2, true) => between(a, b, 0.5, decoder),
        _ => return (DVec3::ZERO, false),
    };
    (color, true)
}

/// A colour between end points. In 8 bits like gallivm, up to one step off: halves are rounded up, thirds are
/// 85/256 and 170/256 of the difference, rounded down.
fn between(a: DVec3, b: DVec3, share: f64, decoder: Decoder) -> DVec3 {
    if decoder == Decoder::Exact {
        return a.lerp(b, share);
    }
    let [a, b] = [a, b].map(|v| (v * 255.0).round());
    let steps = if share == 0.5 {
        ((a + b) / 2.0).ceil()
    } else {
        a + ((b - a) * (share * 256.0).floor() / 256.0).floor()
    };
    steps / 255.0
}

/// Alpha of a texel of a BC3 block.
fn alpha_of(block: &[u8], texel: u32) -> f64 {
    let bits = block
        .iter()
        .rev()
        .fold(0_u64, |bits, byte| bits << 8 | u64::from(*byte))
        >> 16;
    let [a, b] = [block[0], block[1]].map(|v| f64::from(v) / 255.0);
    let between = |part: f64| a + (b - a) * part;
    match (bits >> (3 * texel) & 7, block[0] > block[1]) {
        (0, _) => a,
        (1, _) => b,
        (index, true) => between((index - 1) as f64 / 7.0),
        (6, false) => 0.0,
        (7, false) => 1.0,
        (index, false) => between((index - 1) as f64 / 5.0),
    }
}

/// Columns and rows of blocks of a level.
fn blocks_of(texture: &Texture, level: u32) -> [usize; 2] {
    texture
        .level_size(level)
        .map(|e| e.div_ceil(BLOCK) as usize)
}

/// IEC 61966-2-1.
fn linear_of_srgb(v: f64) -> f64 {
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// llvmpipe's approximation (gallivm's lp_bld_format_srgb.c): a cubic polynomial above 15/255.
fn polynomial_of_srgb(v: f64) -> f64 {
    if v <= 15.0 / 255.0 {
        v / 12.6
    } else {
        0.0023 + v * (0.0030 + v * (0.6935 + v * 0.3012))
    }
}

/// The inverse of [`linear_of_srgb`].
pub fn srgb_of_linear(v: f64) -> f64 {
    if v <= 0.003_130_8 {
        v * 12.92
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use textures::TextureSet;

    /// An 8x4 BC1 texture of a red and a blue block, and a green level 1.
    fn set(color_space: ColorSpace) -> TextureSet {
        let block = |color: u16| {
            let [low, high] = color.to_le_bytes();
            [low, high, 0, 0, 0, 0, 0, 0]
        };
        let texture = Texture {
            name: "blocks".into(),
            size: [8, 4],
            levels: 2,
            layers: 1,
            format: TexelFormat::Bc1,
            color_space,
            part: None,
        };
        TextureSet {
            textures: vec![CompressedTexture {
                texture,
                first_level: 0,
                blocks: [0xf800, 0x001f, 0x0400].map(block).concat(),
                held: TexelFormat::Bc1,
            }],
            of_image: vec![Some(0)],
            ..TextureSet::default()
        }
    }

    #[test]
    fn filtering_weighs_texels_and_levels() {
        let set = set(ColorSpace::Linear);
        let sampler = SoftwareSampler::new(&set);
        let texture = sampler.texture(0).unwrap();
        let sample = |u: f64, lod: f64| {
            sampler.sample(texture, &Sampler::TRILINEAR_REPEAT, DVec2::new(u, 0.5), lod)
        };
        assert_eq!(sample(0.25, 0.0), DVec4::new(1.0, 0.0, 0.0, 1.0));
        // Half way between red and blue, and a quarter of a texel from it.
        assert_eq!(sample(0.5, -1.0), DVec4::new(0.5, 0.0, 0.5, 1.0));
        assert_eq!(
            sample(0.5 + 0.25 / 8.0, 0.0),
            DVec4::new(0.25, 0.0, 0.75, 1.0)
        );
        // 16 of 31 steps of 6-bit green are 33 of 63: 130 of 255.
        let green = sample(0.25, 1.0).y;
        assert!((green - 130.0 / 255.0).abs() < 1e-12, "{green}");
        // Two thirds of blue's 132 (16 of 31 steps) are 88, a third of red's 255 is 85.
        let block = [0x10, 0x00, 0x00, 0xf8, 0xaa, 0xaa, 0xaa, 0xaa];
        let (rgb, _) = color_of(&block, 5, false, Decoder::Exact);
        assert!(
            (rgb - DVec3::new(85.0, 0.0, 88.0) / 255.0).length() < 1e-12,
            "{rgb}"
        );
        let mixed = sample(0.25, 0.25);
        assert!((mixed.x - 0.75).abs() < 1e-12 && (mixed.y - 0.25 * green).abs() < 1e-12);
    }

    #[test]
    fn colours_between_end_points_are_the_drivers_in_8_bits() {
        let steps = |v: f64| DVec3::splat(v / 255.0);
        let found = |a: f64, b: f64, share: f64| {
            let found = between(steps(a), steps(b), share, Decoder::EightBits);
            (found.x * 255.0).round()
        };
        // A third of three steps is a step, but 85/256 of them is less.
        assert_eq!(found(0.0, 3.0, 1.0 / 3.0), 0.0);
        assert_eq!(found(3.0, 0.0, 1.0 / 3.0), 2.0);
        assert_eq!(found(10.0, 110.0, 2.0 / 3.0), 76.0);
        assert_eq!(found(0.0, 1.0, 0.5), 1.0);
        let exact = between(steps(0.0), steps(3.0), 1.0 / 3.0, Decoder::Exact);
        assert!((exact - steps(1.0)).length() < 1e-12);
        // The polynomial is near the curve, and not on it.
        let apart = |v: f64| (polynomial_of_srgb(v) - linear_of_srgb(v)).abs();
        let largest = (0..=255).map(|v| apart(f64::from(v) / 255.0));
        let largest = largest.fold(0.0, f64::max);
        assert!(largest > 1e-4 && largest < 2e-3, "{largest}");
        assert!((polynomial_of_srgb(1.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn blocks_decode_as_a_library_decodes_them_but_for_rounding() {
        let mut state = 1_u32;
        for round in 0..500 {
            let mut block = [0_u8; 16];
            for byte in &mut block {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *byte = (state >> 24) as u8;
            }
            let (bc1, mut expected) = (round % 2 == 0, [0_u8; 64]);
            if bc1 {
                bcdec_rs::bc1(&block[8..], &mut expected, 16);
            } else {
                bcdec_rs::bc3(&block, &mut expected, 16);
            }
            for (texel, expected) in (0..16).zip(expected.chunks_exact(4)) {
                let (rgb, opaque) = color_of(&block[8..], texel, bc1, Decoder::Exact);
                let alpha = if bc1 {
                    f64::from(u8::from(opaque))
                } else {
                    alpha_of(&block[..8], texel)
                };
                for (found, expected) in rgb.extend(alpha).to_array().into_iter().zip(expected) {
                    let steps = (255.0 * found - f64::from(*expected)).abs();
                    // The library rounds end points to the nearest of 8 bits, where repeating their bits may be a
                    // step off, and sevenths of alpha down.
                    assert!(
                        steps <= 1.72,
                        "{block:?} {texel}: {rgb} {alpha}, {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn srgb_is_filtered_as_light() {
        let set = set(ColorSpace::Srgb);
        let sampler = SoftwareSampler::new(&set);
        let texture = sampler.texture(0).unwrap();
        let green = sampler
            .sample(texture, &Sampler::TRILINEAR_REPEAT, DVec2::splat(0.1), 1.0)
            .y;
        assert!((green - ((130.0 / 255.0 + 0.055) / 1.055_f64).powf(2.4)).abs() < 1e-12);
        for v in [0.0, 0.002, 0.04, 0.2, 1.0] {
            assert!((srgb_of_linear(linear_of_srgb(v)) - v).abs() < 1e-9);
        }
    }
}
