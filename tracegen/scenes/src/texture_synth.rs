//! Computes the images of a material from a description of its surface, texel by texel.

use super::noise::lerp;
use formats::texture::ColorSpace;
use rayon::prelude::*;
use scene::image::{Image, ImageSource, OpenSource};
use scene::{SceneError, srgb};
use std::sync::Arc;

/// An sRGB-encoded colour, 0 to 1.
pub type Rgb = [f32; 3];

/// The colour with the code 0xRRGGBB.
pub fn rgb(hex: u32) -> Rgb {
    [hex >> 16, hex >> 8, hex].map(|c| (c & 255) as f32 / 255.0)
}

/// Linear mix of two colours.
pub fn mix(a: Rgb, b: Rgb, t: f32) -> Rgb {
    std::array::from_fn(|i| lerp(a[i], b[i], t))
}

/// A colour times a factor.
pub fn shade(a: Rgb, factor: f32) -> Rgb {
    a.map(|c| c * factor)
}

/// The linear-light value of an sRGB colour, for material factors.
pub fn linear(color: Rgb) -> glam::Vec3 {
    glam::Vec3::from(color.map(srgb::decode_f32))
}

/// Appearance of a surface at one point.
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

/// Images of a material in addition to base colour.
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

/// A material's textures, not yet computed.
pub struct Recipe {
    /// Name of the material.
    pub name: &'static str,
    /// Edge in texels, a power of two.
    pub size: u32,
    /// Images of the material.
    pub maps: Maps,
    /// Metres that one repeat covers.
    pub tile_m: f32,
    /// The surface.
    pub surface: Surface,
}

/// One of a material's images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Map {
    /// Base colour, sRGB, with coverage in alpha.
    Color = 0,
    /// Tangent-space normal: x along +u, y towards -v.
    Normal,
    /// Roughness in G, metalness in B.
    Roughness,
    /// Occlusion in R.
    Occlusion,
}

impl Map {
    /// The image of this map of a recipe.
    pub fn image(self, source: &Arc<RecipeSource>) -> Image {
        let (suffix, color_space) = match self {
            Self::Color => ("color", ColorSpace::Srgb),
            Self::Normal => ("normal", ColorSpace::Linear),
            Self::Roughness => ("roughness", ColorSpace::Linear),
            Self::Occlusion => ("occlusion", ColorSpace::Linear),
        };
        let recipe = &source.recipe;
        Image {
            name: format!("{}-{suffix}", recipe.name),
            size: [recipe.size; 2],
            color_space,
            stored: None,
            source: Arc::clone(source) as Arc<dyn ImageSource>,
            part: self as usize,
        }
    }
}

impl Maps {
    /// True where the material gets this image.
    pub fn contains(self, map: Map) -> bool {
        match map {
            Map::Color => true,
            Map::Normal => self != Self::Color,
            Map::Roughness => matches!(self, Self::Full | Self::FullOcclusion),
            Map::Occlusion => self == Self::FullOcclusion,
        }
    }
}

fn byte(x: f32) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// A recipe as a source of images. Its name identifies it within a scene.
pub struct RecipeSource {
    recipe: Recipe,
    scene: String,
}

impl Recipe {
    /// A recipe; see the fields.
    pub fn new(name: &'static str, size: u32, maps: Maps, tile_m: f32, surface: Surface) -> Self {
        Self {
            name,
            size,
            maps,
            tile_m,
            surface,
        }
    }

    /// The source of the recipe's images in a scene.
    pub fn into_source(self, scene: &str) -> Arc<RecipeSource> {
        Arc::new(RecipeSource {
            recipe: self,
            scene: scene.to_owned(),
        })
    }

    /// Evaluates the surface once per texel and packs the requested images, by number.
    fn synthesize(&self, parts: &[usize]) -> Vec<Vec<u8>> {
        let n = self.size as usize;
        let wants = |map: Map| parts.contains(&(map as usize));
        // An unused map gets rows of one texel, so that the loop needs no special case.
        let row_bytes = |map| if wants(map) { 4 * n } else { 4 };
        let buffer = |map| vec![255u8; row_bytes(map) * n];
        let (mut color, mut mr, mut ao) = (
            buffer(Map::Color),
            buffer(Map::Roughness),
            buffer(Map::Occlusion),
        );
        let height_row = if wants(Map::Normal) { n } else { 1 };
        let mut height = vec![0.0f32; height_row * n];
        color
            .par_chunks_mut(row_bytes(Map::Color))
            .zip(mr.par_chunks_mut(row_bytes(Map::Roughness)))
            .zip(ao.par_chunks_mut(row_bytes(Map::Occlusion)))
            .zip(height.par_chunks_mut(height_row))
            .enumerate()
            .for_each(|(y, (((color, mr), ao), height))| {
                let v = (y as f32 + 0.5) / n as f32;
                for x in 0..n {
                    let texel = (self.surface)((x as f32 + 0.5) / n as f32, v);
                    let at = 4 * x..4 * x + 3;
                    if wants(Map::Color) {
                        color[at.clone()].copy_from_slice(&texel.color.map(byte));
                        color[4 * x + 3] = byte(texel.alpha);
                    }
                    if wants(Map::Roughness) {
                        mr[at.clone()].copy_from_slice(&[
                            255,
                            byte(texel.rough),
                            byte(texel.metal),
                        ]);
                    }
                    if wants(Map::Occlusion) {
                        ao[at].copy_from_slice(&[byte(texel.open); 3]);
                    }
                    if wants(Map::Normal) {
                        height[x] = texel.height;
                    }
                }
            });
        let normal = wants(Map::Normal).then(|| normal_map(&height, n));
        let mut made = [color, normal.unwrap_or_default(), mr, ao];
        parts
            .iter()
            .map(|&part| made.get_mut(part).map(std::mem::take).unwrap_or_default())
            .collect()
    }
}

impl ImageSource for RecipeSource {
    fn open(&self) -> Result<Box<dyn OpenSource + '_>, SceneError> {
        Ok(Box::new(self))
    }
}

impl OpenSource for &RecipeSource {
    /// A surface is code, so the source text of this crate identifies it.
    fn identify(&self, sink: &mut dyn FnMut(&[u8])) {
        for text in SOURCE_TEXT {
            sink(text.as_bytes());
        }
        let Recipe { name, size, .. } = self.recipe;
        sink(format!("\0{}\0{name}\0{size}", self.scene).as_bytes());
    }

    fn texels(&self, parts: &[usize]) -> Result<Vec<Vec<u8>>, SceneError> {
        Ok(self.recipe.synthesize(parts))
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

/// The source text of every file of this crate that may affect a texture.
const SOURCE_TEXT: &[&str] = &[
    include_str!("../data/atrium-plain.scene"),
    include_str!("../data/atrium.scene"),
    include_str!("../data/car-lines.txt"),
    include_str!("../data/car.scene"),
    include_str!("../data/chess.scene"),
    include_str!("../data/jungle.scene"),
    include_str!("../data/lab.scene"),
    include_str!("../data/meadow.scene"),
    include_str!("../data/music-box.scene"),
    include_str!("../data/plant.scene"),
    include_str!("../data/teapot.scene"),
    include_str!("atrium.rs"),
    include_str!("atrium/furnishing.rs"),
    include_str!("atrium/parts.rs"),
    include_str!("car.rs"),
    include_str!("car/body.rs"),
    include_str!("car/details.rs"),
    include_str!("chess.rs"),
    include_str!("creature.rs"),
    include_str!("gears.rs"),
    include_str!("glassware.rs"),
    include_str!("jungle.rs"),
    include_str!("jungle/plants.rs"),
    include_str!("jungle/temple.rs"),
    include_str!("lab.rs"),
    include_str!("lab/still.rs"),
    include_str!("masonry.rs"),
    include_str!("meadow.rs"),
    include_str!("meadow/house.rs"),
    include_str!("meadow/parts.rs"),
    include_str!("mesh_builder.rs"),
    include_str!("music_box.rs"),
    include_str!("music_box/train.rs"),
    include_str!("noise.rs"),
    include_str!("organic.rs"),
    include_str!("plant/building.rs"),
    include_str!("plant/goods.rs"),
    include_str!("plant/machines.rs"),
    include_str!("plant/materials.rs"),
    include_str!("plant/mod.rs"),
    include_str!("plant/moving.rs"),
    include_str!("plant/parts.rs"),
    include_str!("plant/process.rs"),
    include_str!("row.rs"),
    include_str!("scene_builder.rs"),
    include_str!("scene_text.rs"),
    include_str!("surfaces.rs"),
    include_str!("teapot.rs"),
    include_str!("texture_synth.rs"),
];

#[cfg(test)]
mod tests {
    use super::SOURCE_TEXT;
    use std::path::PathBuf;

    #[test]
    fn texture_cache_keys_cover_every_file_of_this_crate() {
        let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
        let mut open = vec![here.join("src"), here.join("data")];
        while let Some(path) = open.pop() {
            if path.is_dir() {
                let entries = std::fs::read_dir(path).unwrap();
                open.extend(entries.map(|entry| entry.unwrap().path()));
                continue;
            }
            let name = path.file_name().unwrap_or_default();
            // The table and the tests do not affect textures.
            if name != "lib.rs" && name != "tests.rs" {
                let text = std::fs::read_to_string(&path).unwrap();
                assert!(SOURCE_TEXT.contains(&text.as_str()), "{}", path.display());
            }
        }
    }
}
