//! Textures for rays: a pyramid of box-filtered levels, sampled trilinearly.

use formats::texture::{ColorSpace, Filter, Wrap};
use glam::{Vec2, Vec4};
use scene::{Image, TextureRef, srgb};

/// An image with its smaller levels, RGBA8 in its own colour space.
pub struct Pyramid {
    levels: Vec<Level>,
    color_space: ColorSpace,
}

struct Level {
    size: [u32; 2],
    rgba: Vec<u8>,
}

impl Pyramid {
    /// The pyramid of an image, or `None` if there are too few texels.
    pub fn new(image: &Image, rgba: Vec<u8>) -> Option<Self> {
        let [width, height] = image.size;
        let bytes = width as usize * height as usize * 4;
        if bytes == 0 || rgba.len() < bytes {
            return None;
        }
        let mut levels = vec![Level {
            size: image.size,
            rgba,
        }];
        let halved = |level: &Level| level.halved(image.color_space);
        while let Some(next) = levels.last().and_then(halved) {
            levels.push(next);
        }
        Some(Self {
            levels,
            color_space: image.color_space,
        })
    }

    /// Width and height of level 0.
    pub fn size(&self) -> [u32; 2] {
        self.levels[0].size
    }

    /// The value at texture coordinates for a footprint of `2^lod` texels, linear.
    pub fn sample(&self, texture: &TextureRef, uv: Vec2, lod: f32, srgb: &[f32; 256]) -> Vec4 {
        let [[a, b, c], [d, e, f]] = texture.uv_transform;
        let uv = Vec2::new(a * uv.x + b * uv.y + c, d * uv.x + e * uv.y + f);
        if !uv.is_finite() {
            return Vec4::ONE;
        }
        let last = self.levels.len() - 1;
        let lod = lod.clamp(0.0, last as f32);
        let nearest = lod == 0.0 && texture.sampler.mag == Filter::Nearest;
        let level = lod as usize;
        let fine = self.bilinear(level, texture.sampler.wrap, uv, nearest, srgb);
        let part = lod - level as f32;
        if part == 0.0 {
            return fine;
        }
        let coarse = self.bilinear((level + 1).min(last), texture.sampler.wrap, uv, false, srgb);
        fine.lerp(coarse, part)
    }

    fn bilinear(
        &self,
        level: usize,
        wrap: [Wrap; 2],
        uv: Vec2,
        nearest: bool,
        srgb: &[f32; 256],
    ) -> Vec4 {
        let level = &self.levels[level];
        let [width, height] = level.size;
        let texel = |x: f32, y: f32| {
            let x = wrapped(x, width, wrap[0]);
            let y = wrapped(y, height, wrap[1]);
            let at = (y as usize * width as usize + x as usize) * 4;
            let t = &level.rgba[at..at + 4];
            let value = |v: u8| match self.color_space {
                ColorSpace::Srgb => srgb[v as usize],
                ColorSpace::Linear => f32::from(v) / 255.0,
            };
            Vec4::new(
                value(t[0]),
                value(t[1]),
                value(t[2]),
                f32::from(t[3]) / 255.0,
            )
        };
        if nearest {
            let x = (uv.x * width as f32).floor();
            return texel(x, (uv.y * height as f32).floor());
        }
        let x = uv.x * width as f32 - 0.5;
        let y = uv.y * height as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let top = texel(x0, y0).lerp(texel(x0 + 1.0, y0), x - x0);
        let bottom = texel(x0, y0 + 1.0).lerp(texel(x0 + 1.0, y0 + 1.0), x - x0);
        top.lerp(bottom, y - y0)
    }
}

impl Level {
    /// The next level: means of two by two texels, computed in linear light for colours.
    fn halved(&self, color_space: ColorSpace) -> Option<Self> {
        let [width, height] = self.size;
        if width <= 1 && height <= 1 {
            return None;
        }
        let size = [(width / 2).max(1), (height / 2).max(1)];
        let mut rgba = Vec::with_capacity(size[0] as usize * size[1] as usize * 4);
        for y in 0..size[1] {
            for x in 0..size[0] {
                for channel in 0..4 {
                    let at = |dx: u32, dy: u32| {
                        let x = (2 * x + dx).min(width - 1) as usize;
                        let y = (2 * y + dy).min(height - 1) as usize;
                        self.rgba[(y * width as usize + x) * 4 + channel]
                    };
                    let texels = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
                    rgba.push(if color_space == ColorSpace::Srgb && channel < 3 {
                        let light = texels.map(|byte| srgb::LINEAR[usize::from(byte)]);
                        srgb::encode_byte(light.iter().sum::<f32>() / 4.0)
                    } else {
                        let sum: u32 = texels.into_iter().map(u32::from).sum();
                        ((sum + 2) / 4) as u8
                    });
                }
            }
        }
        Some(Self { size, rgba })
    }
}

fn wrapped(x: f32, size: u32, wrap: Wrap) -> u32 {
    let n = i64::from(size);
    let x = x as i64;
    let at = match wrap {
        Wrap::Repeat => x.rem_euclid(n),
        Wrap::MirroredRepeat => {
            let x = x.rem_euclid(2 * n);
            if x < n { x } else { 2 * n - 1 - x }
        }
        // Scene files have no other modes.
        Wrap::ClampToEdge | Wrap::ClampToBorder | Wrap::MirrorClampToEdge => x.clamp(0, n - 1),
    };
    at as u32
}

/// Base-2 logarithm from exponent and mantissa, exact at powers of two and equal on all platforms.
pub fn fast_log2(x: f32) -> f32 {
    if x <= 0.0 {
        return -126.0;
    }
    let bits = x.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    let mantissa = f32::from_bits(bits & 0x007F_FFFF | 0x3F80_0000);
    exponent as f32 + (mantissa - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uses the same averages as `textures::mipmap`, which `tracegen raster` samples.
    #[test]
    fn black_and_white_average_to_188_in_srgb_and_128_in_data() {
        let rgba = [[0, 0, 0, 255], [255; 4], [255; 4], [0, 0, 0, 255]].concat();
        let level = Level { size: [2, 2], rgba };
        let average = |space| level.halved(space).unwrap().rgba;
        assert_eq!(average(ColorSpace::Srgb), [188, 188, 188, 255]);
        assert_eq!(average(ColorSpace::Linear), [128, 128, 128, 255]);
    }
}
