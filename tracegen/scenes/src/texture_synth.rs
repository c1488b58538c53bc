//! From a surface's description, texel by texel, to the images of a material.

use super::noise::lerp;
use formats::texture::ColorSpace;
use rayon::prelude::*;
use scene::Image;
use std::sync::Arc;

/// A colour as an artist picks it: sRGB-encoded, 0 to 1.
pub type Rgb = [f32; 3];

/// The colour 0xRRGGBB.
#[must_use]
pub fn rgb(hex: u32) -> Rgb {
    [hex >> 16, hex >> 8, hex].map(|c| (c & 255) as f32 / 255.0)
}

/// Linear mix of two colours.
#[must_use]
pub fn mix(a: Rgb, b: Rgb, t: f32) -> Rgb {
    std::array::from_fn(|i| lerp(a[i], b[i], t))
}

/// A colour times a factor.
#[must_use]
pub fn shade(a: Rgb, factor: f32) -> Rgb {
    a.map(|c| c * factor)
}

/// The linear-light value of an sRGB colour, for material factors.
#[must_use]
pub fn linear(color: Rgb) -> glam::Vec3 {
    let decode = |c: f32| {
        if c <= 0.040_45 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    };
    glam::Vec3::from(color.map(decode))
}

/// What a surface looks like at one point.
#[derive(Clone, Copy, Debug)]
pub struct Texel {
    /// Base colour.
    pub color: Rgb,
    /// Height above the surface in texture widths.
    pub height: f32,
    /// Perceptual roughness.
    pub rough: f32,
    /// Metalness.
    pub metal: f32,
    /// Coverage.
    pub alpha: f32,
    /// Light that reaches the point from its surroundings, 0 to 1.
    pub open: f32,
}

impl Texel {
    /// An opaque, fully open dielectric.
    #[must_use]
    pub fn new(color: Rgb, height: f32, rough: f32) -> Self {
        Self {
            color,
            height,
            rough,
            metal: 0.0,
            alpha: 1.0,
            open: 1.0,
        }
    }
}

/// Which images a material gets beside base colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Maps {
    /// Base colour only.
    Color,
    /// Base colour and normal.
    ColorNormal,
    /// Base colour, normal, metallic-roughness.
    Full,
    /// Base colour, normal, metallic-roughness, occlusion.
    FullOcclusion,
}

/// A surface over the unit torus, (u, v) from the top left.
pub type Surface = Box<dyn Fn(f32, f32) -> Texel + Send + Sync>;

/// A material's textures, yet to be computed.
pub struct Recipe {
    /// Name of the material.
    pub name: &'static str,
    /// Edge in texels, a power of two.
    pub size: u32,
    /// Images wanted.
    pub maps: Maps,
    /// Metres that one repeat covers.
    pub tile_m: f32,
    /// The surface.
    pub surface: Surface,
}

/// A material's images.
pub struct TextureSet {
    /// Name of the material.
    pub name: &'static str,
    /// Metres that one repeat covers.
    pub tile_m: f32,
    /// Base colour, sRGB, with coverage in alpha.
    pub color: Image,
    /// Tangent-space normal: x along +u, y towards -v.
    pub normal: Option<Image>,
    /// Roughness in G, metalness in B.
    pub metallic_roughness: Option<Image>,
    /// Occlusion in R.
    pub occlusion: Option<Image>,
}

fn byte(x: f32) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

impl Recipe {
    /// Evaluates the surface once a texel and packs the images.
    #[must_use]
    pub fn synthesize(&self) -> TextureSet {
        let n = self.size as usize;
        let wants = |maps: &[Maps]| maps.contains(&self.maps);
        let with_normal = !wants(&[Maps::Color]);
        let with_mr = wants(&[Maps::Full, Maps::FullOcclusion]);
        let with_ao = wants(&[Maps::FullOcclusion]);
        let buffer = |on: bool| vec![255u8; if on { n * n * 4 } else { n * 4 }];
        let (mut color, mut mr, mut ao) =
            (vec![255u8; n * n * 4], buffer(with_mr), buffer(with_ao));
        let mut height = vec![0.0f32; n * n];
        // Maps that are not wanted are a single row, so that the loop stays one shape.
        let stride = |on: bool| if on { 4 * n } else { 4 };
        let (mr_stride, ao_stride) = (stride(with_mr), stride(with_ao));
        color
            .par_chunks_mut(4 * n)
            .zip(mr.par_chunks_mut(mr_stride))
            .zip(ao.par_chunks_mut(ao_stride))
            .zip(height.par_chunks_mut(n))
            .enumerate()
            .for_each(|(y, (((color, mr), ao), height))| {
                let v = (y as f32 + 0.5) / n as f32;
                for x in 0..n {
                    let texel = (self.surface)((x as f32 + 0.5) / n as f32, v);
                    let at = 4 * x..4 * x + 3;
                    color[at.clone()].copy_from_slice(&texel.color.map(byte));
                    color[4 * x + 3] = byte(texel.alpha);
                    if with_mr {
                        mr[at.clone()].copy_from_slice(&[
                            255,
                            byte(texel.rough),
                            byte(texel.metal),
                        ]);
                    }
                    if with_ao {
                        ao[at].copy_from_slice(&[byte(texel.open); 3]);
                    }
                    height[x] = texel.height;
                }
            });
        let image = |suffix: &str, rgba: Vec<u8>, color_space| Image {
            name: format!("{}-{suffix}", self.name),
            size: [self.size; 2],
            rgba: Arc::from(rgba),
            color_space,
        };
        TextureSet {
            name: self.name,
            tile_m: self.tile_m,
            color: image("color", color, ColorSpace::Srgb),
            normal: with_normal
                .then(|| image("normal", normal_map(&height, n), ColorSpace::Linear)),
            metallic_roughness: with_mr.then(|| image("roughness", mr, ColorSpace::Linear)),
            occlusion: with_ao.then(|| image("occlusion", ao, ColorSpace::Linear)),
        }
    }
}

/// Normals of a periodic height field given in texture widths.
fn normal_map(height: &[f32], n: usize) -> Vec<u8> {
    let mut rgba = vec![255u8; n * n * 4];
    rgba.par_chunks_mut(4 * n).enumerate().for_each(|(y, row)| {
        let at = |y: usize| &height[(y % n) * n..(y % n) * n + n];
        let (above, here, below) = (at(y + n - 1), at(y), at(y + 1));
        let scale = n as f32 * 0.5;
        for x in 0..n {
            let dx = (here[(x + 1) % n] - here[(x + n - 1) % n]) * scale;
            let dy = (above[x] - below[x]) * scale;
            let inv = 1.0 / (dx * dx + dy * dy + 1.0).sqrt();
            for (c, value) in [-dx * inv, -dy * inv, inv].into_iter().enumerate() {
                row[4 * x + c] = byte(value * 0.5 + 0.5);
            }
        }
    });
    rgba
}

/// Computes every recipe, in parallel, in order.
#[must_use]
pub fn synthesize_all(recipes: &[Recipe]) -> Vec<TextureSet> {
    recipes.par_iter().map(Recipe::synthesize).collect()
}
