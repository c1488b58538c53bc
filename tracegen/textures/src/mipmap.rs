//! Computes mip levels: area averages in linear light, with normalised normals and constant alpha coverage.

use glam::{Vec3, Vec4};
use scene::srgb;

/// Meaning of the texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    /// Whether RGB is sRGB-encoded, so that it is averaged in linear light.
    pub srgb: bool,
    /// Whether RGB is a unit vector, which must be normalised after averaging.
    pub normal_map: bool,
}

/// A level in linear floats. If alpha is used, colour is multiplied by it, so that transparent texels do not
/// affect the colour of their neighbours.
pub(super) struct Level {
    size: [usize; 2],
    texels: Vec<Vec4>,
    premultiplied: bool,
}

fn decode_texel(texel: &[u8], kind: Kind, premultiply: bool) -> Vec4 {
    let alpha = f32::from(texel[3]) / 255.0;
    let rgb = if kind.srgb {
        let table = &*srgb::LINEAR;
        Vec3::new(
            table[usize::from(texel[0])],
            table[usize::from(texel[1])],
            table[usize::from(texel[2])],
        )
    } else {
        Vec3::new(
            f32::from(texel[0]),
            f32::from(texel[1]),
            f32::from(texel[2]),
        ) / 255.0
    };
    // A weight of 1/1024 preserves the colour of completely transparent areas.
    let weight = if premultiply {
        alpha.max(1.0 / 1024.0)
    } else {
        1.0
    };
    (rgb * weight).extend(alpha)
}

impl Level {
    /// Decodes level 0 to floats.
    pub fn decode(rgba: &[u8], size: [u32; 2], kind: Kind, premultiplied: bool) -> Self {
        let texels = rgba
            .chunks_exact(4)
            .map(|t| decode_texel(t, kind, premultiplied))
            .collect();
        Self {
            size: size.map(|e| e as usize),
            texels,
            premultiplied,
        }
    }

    /// Computes level 1 from the bytes of level 0.
    pub fn half_of(rgba: &[u8], size: [u32; 2], kind: Kind, premultiplied: bool) -> Self {
        let size = size.map(|e| e as usize);
        let texel = |x: usize, y: usize| {
            let at = (y * size[0] + x) * 4;
            decode_texel(&rgba[at..at + 4], kind, premultiplied)
        };
        Self {
            premultiplied,
            ..average(size, kind, texel)
        }
    }

    /// Computes the next level.
    pub fn half(&self, kind: Kind) -> Self {
        let texel = |x: usize, y: usize| self.texels[y * self.size[0] + x];
        Self {
            premultiplied: self.premultiplied,
            ..average(self.size, kind, texel)
        }
    }

    /// Resamples bilinearly, for sizes that are not whole blocks.
    pub fn resize(&self, size: [u32; 2]) -> Self {
        let [width, height] = size.map(|e| e as usize);
        let tap = |i: usize, to: usize, from: usize| {
            let x =
                ((i as f32 + 0.5) * from as f32 / to as f32 - 0.5).clamp(0.0, (from - 1) as f32);
            let low = x as usize;
            (low, (low + 1).min(from - 1), x.fract())
        };
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            let (y0, y1, fy) = tap(y, height, self.size[1]);
            for x in 0..width {
                let (x0, x1, fx) = tap(x, width, self.size[0]);
                let at = |x: usize, y: usize| self.texels[y * self.size[0] + x];
                let top = at(x0, y0).lerp(at(x1, y0), fx);
                let bottom = at(x0, y1).lerp(at(x1, y1), fx);
                texels.push(top.lerp(bottom, fy));
            }
        }
        Self {
            size: [width, height],
            texels,
            premultiplied: self.premultiplied,
        }
    }

    /// Encodes the level as RGBA8.
    pub fn encode(&self, kind: Kind) -> Vec<u8> {
        let byte = |v: f32| (v * 255.0 + 0.5) as u8;
        let mut rgba = Vec::with_capacity(self.texels.len() * 4);
        for texel in &self.texels {
            let alpha = texel.w;
            let weight = if self.premultiplied {
                alpha.max(1.0 / 1024.0)
            } else {
                1.0
            };
            let rgb = (texel.truncate() / weight).clamp(Vec3::ZERO, Vec3::ONE);
            let rgb = if kind.srgb {
                rgb.to_array().map(srgb::encode_byte)
            } else {
                rgb.to_array().map(byte)
            };
            rgba.extend([rgb[0], rgb[1], rgb[2], byte(alpha)]);
        }
        rgba
    }
}

/// Halves both axes (rounded down, at least 1). Each new texel is the average of the area that it covers.
fn average(size: [usize; 2], kind: Kind, texel: impl Fn(usize, usize) -> Vec4) -> Level {
    let [width, height] = size.map(|e| (e / 2).max(1));
    let mut texels = Vec::with_capacity(width * height);
    if size == [width * 2, height * 2] {
        for y in 0..height {
            for x in 0..width {
                let (x, y) = (x * 2, y * 2);
                let sum = texel(x, y) + texel(x + 1, y) + texel(x, y + 1) + texel(x + 1, y + 1);
                texels.push(sum * 0.25);
            }
        }
    } else {
        let columns = spans(size[0], width);
        for row in spans(size[1], height) {
            for column in &columns {
                let mut sum = Vec4::ZERO;
                for &(y, wy) in &row {
                    for &(x, wx) in column {
                        sum += texel(x, y) * (wx * wy);
                    }
                }
                texels.push(sum);
            }
        }
    }
    if kind.normal_map {
        for texel in &mut texels {
            let n = (texel.truncate() * 2.0 - 1.0).normalize_or(Vec3::Z);
            *texel = ((n + 1.0) * 0.5).extend(texel.w);
        }
    }
    Level {
        size: [width, height],
        texels,
        premultiplied: false,
    }
}

/// For each new texel along an axis, the old texels that it covers, with weights that add up to 1.
fn spans(from: usize, to: usize) -> Vec<Vec<(usize, f32)>> {
    let scale = from as f64 / to as f64;
    (0..to)
        .map(|i| {
            let (start, end) = (i as f64 * scale, (i + 1) as f64 * scale);
            (start as usize..(end.ceil() as usize).min(from))
                .map(|x| {
                    let overlap = end.min((x + 1) as f64) - start.max(x as f64);
                    (x, (overlap / scale) as f32)
                })
                .collect()
        })
        .collect()
}

/// Share of texels whose alpha is at least `cutoff`.
pub(super) fn coverage(rgba: &[u8], cutoff: u8) -> f64 {
    let passing = rgba.chunks_exact(4).filter(|t| t[3] >= cutoff).count();
    passing as f64 / (rgba.len() / 4) as f64
}

/// The cutoff for which the share of passing texels is closest to `coverage`. With averaging alone, foliage
/// would become thinner or thicker with distance (Castano, "Computing alpha mipmaps", 2010).
pub(super) fn cutoff_for_coverage(rgba: &[u8], coverage: f64) -> u8 {
    let mut histogram = [0u64; 256];
    for texel in rgba.chunks_exact(4) {
        histogram[usize::from(texel[3])] += 1;
    }
    let wanted = coverage * (rgba.len() / 4) as f64;
    let (mut best, mut best_error, mut passing) = (255, f64::INFINITY, 0);
    for cutoff in (1..=255u8).rev() {
        passing += histogram[usize::from(cutoff)];
        let error = (passing as f64 - wanted).abs();
        if error < best_error {
            (best, best_error) = (cutoff, error);
        }
    }
    best
}

/// Sets alpha to 255 if it is at least `cutoff`, else to 0.
pub(super) fn binarise(rgba: &mut [u8], cutoff: u8) {
    for texel in rgba.chunks_exact_mut(4) {
        texel[3] = if texel[3] >= cutoff { 255 } else { 0 };
    }
}

/// Sets alpha to 255.
pub(super) fn make_opaque(rgba: &mut [u8]) {
    for texel in rgba.chunks_exact_mut(4) {
        texel[3] = 255;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLOR: Kind = Kind {
        srgb: true,
        normal_map: false,
    };
    const DATA: Kind = Kind {
        srgb: false,
        normal_map: false,
    };

    #[test]
    fn bytes_are_unchanged_by_decoding_and_encoding() {
        let rgba: Vec<u8> = (0..=255).flat_map(|v| [v, v, v, 255]).collect();
        for kind in [COLOR, DATA] {
            assert_eq!(
                Level::decode(&rgba, [256, 1], kind, false).encode(kind),
                rgba
            );
        }
    }

    #[test]
    fn black_and_white_average_to_188_in_srgb_and_128_in_data() {
        let rgba = [[0, 0, 0, 255], [255; 4], [255; 4], [0, 0, 0, 255]].concat();
        let average = |kind| Level::half_of(&rgba, [2, 2], kind, false).encode(kind);
        assert_eq!(average(COLOR), [188, 188, 188, 255]);
        assert_eq!(average(DATA), [128, 128, 128, 255]);
    }

    #[test]
    fn at_odd_sizes_all_texels_have_the_same_weight() {
        let rgba: Vec<u8> = [0u8, 30, 60, 90, 120]
            .iter()
            .flat_map(|&v| [v, v, v, 255])
            .collect();
        let level = Level::half_of(&rgba, [5, 1], DATA, false);
        assert_eq!(level.size, [2, 1]);
        // 2.5 texels each: (0 + 30 + 60/2) / 2.5 and (60/2 + 90 + 120) / 2.5.
        let bytes = level.encode(DATA);
        assert_eq!([bytes[0], bytes[4]], [24, 96]);
    }

    #[test]
    fn averaged_normals_stay_unit_vectors() {
        let rgba = [[255, 128, 128, 255], [128, 255, 128, 255]].concat();
        let kind = Kind {
            srgb: false,
            normal_map: true,
        };
        let level = Level::half_of(&rgba, [2, 1], kind, false);
        let n = level.texels[0].truncate() * 2.0 - 1.0;
        assert!((n.length() - 1.0).abs() < 1e-5, "{n}");
    }

    #[test]
    fn transparent_texels_do_not_darken_their_neighbours() {
        let rgba = [[200, 200, 200, 255], [0, 0, 0, 0]].concat();
        let texel = Level::half_of(&rgba, [2, 1], DATA, true).encode(DATA);
        assert!(texel[0] >= 199 && texel[3] == 128, "{texel:?}");
    }

    #[test]
    fn the_cutoff_of_a_level_keeps_the_coverage_of_level_0() {
        // A random tenth of the texels is opaque, so averages rarely reach one half.
        let mut state = 1u32;
        let rgba: Vec<u8> = (0..64 * 64)
            .flat_map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                [255, 255, 255, if state >> 16 < 6554 { 255 } else { 0 }]
            })
            .collect();
        let full = coverage(&rgba, 128);
        let half = Level::half_of(&rgba, [64, 64], DATA, true).encode(DATA);
        let kept = coverage(&half, cutoff_for_coverage(&half, full));
        assert!(
            coverage(&half, 128) < full * 0.7,
            "the plain cutoff loses coverage"
        );
        // Alpha has only five values here, so the best cutoff is still inexact.
        assert!((kept - full).abs() <= (coverage(&half, 128) - full).abs());
    }
}
