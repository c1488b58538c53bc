//! Converts images to block-compressed textures with complete mip chains. The uploaded textures are those in
//! the trace's texture table.
//!
//! - Opaque images become BC1. Images of alpha-masked materials also become BC1, with its one-bit alpha. A
//!   transparent texel is then black, so the shader divides colour by alpha after filtering.
//! - Images with smooth alpha of blended materials become BC3.
//! - Images whose file has compressed blocks keep these blocks and their levels.
//! - Only images that a placed mesh samples become textures.
//! - Level 0 must consist of whole blocks. Other images are resampled to the next multiple of four, with a
//!   note.
//! - A texture that is not visible in any view has an entry in the trace's table, but no blocks.
//! - Blocks are cached between runs, see [`Cache`].
//!
//! The encoder is texpresso's range fit with fixed weights (perceptual for colour, uniform for
//! data). It works block by block, so the bytes do not depend on the number of threads.

pub mod bc4;
mod cache;
mod compress;
mod mipmap;
mod role;
#[cfg(test)]
mod tests;

pub use cache::Cache;
pub use role::alpha_tested;

use cache::KeyHasher;
use formats::error::{Broken, ensure};
use formats::texture::{ColorSpace, TexelFormat, Texture};
use rayon::prelude::*;
use role::{Alpha, Role};
use scene::blocks::{self, ImageData};
use scene::{Image, MAX_IMAGE_SIZE, Scene, SceneError};
use std::borrow::Cow;
use std::fmt::Display;

/// A texture ready for upload.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompressedTexture {
    /// Entry in the trace's texture table.
    pub texture: Texture,
    /// Finest level with blocks. Finer levels are never sampled.
    pub first_level: u32,
    /// Blocks of the levels from `first_level` on, in order, each level row by row from the top. Empty for a
    /// texture that is not visible in any view.
    pub blocks: Vec<u8>,
    /// Format of `blocks`: that of the texture, or RGBA8 for levels that were made from those of a file whose
    /// format has no encoder here.
    pub held: TexelFormat,
}

impl CompressedTexture {
    /// The texture in a format that every driver supports: BC1, BC3 and RGBA8 unchanged, other blocks decoded
    /// to RGBA8. Texture coordinates do not depend on the format.
    pub fn for_driver(&self) -> Cow<'_, Self> {
        let own = &self.texture;
        match self.held {
            TexelFormat::Bc1 | TexelFormat::Bc3 => return Cow::Borrowed(self),
            TexelFormat::Rgba8 if own.format == TexelFormat::Rgba8 => return Cow::Borrowed(self),
            TexelFormat::Rgba8 => return Cow::Owned(self.as_rgba8(self.blocks.clone())),
            _ => {}
        }
        let mut rest = self.blocks.as_slice();
        let mut texels = Vec::new();
        for level in self.first_level..own.levels {
            let size = own.level_size(level);
            let bytes = blocks::level_bytes(self.held, size).min(rest.len());
            let (stored, others) = rest.split_at(bytes);
            let decoded = blocks::decode(self.held, size, own.color_space, stored);
            texels.extend(decoded.unwrap_or_default());
            rest = others;
        }
        Cow::Owned(self.as_rgba8(texels))
    }

    /// The same texture with these texels of RGBA8.
    fn as_rgba8(&self, blocks: Vec<u8>) -> Self {
        Self {
            texture: Texture {
                format: TexelFormat::Rgba8,
                ..self.texture.clone()
            },
            first_level: self.first_level,
            blocks,
            held: TexelFormat::Rgba8,
        }
    }
}

/// The textures that a scene samples.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TextureSet {
    /// Textures in order of the scene's images.
    pub textures: Vec<CompressedTexture>,
    /// Texture of each image of the scene; `None` for images that no placed mesh samples.
    pub of_image: Vec<Option<usize>>,
    /// Changes to images, one sentence each.
    pub notes: Vec<String>,
    /// Number of textures whose blocks were in the cache.
    pub cached: usize,
}

/// Reasons why an image cannot become a texture.
#[derive(Debug, thiserror::Error)]
pub enum TextureError {
    /// An invalid size or invalid texels.
    #[error(transparent)]
    Image(#[from] Broken),
    /// The image cannot be read or decoded.
    #[error(transparent)]
    Source(#[from] SceneError),
}

impl TextureSet {
    /// Compresses all images that the scene samples, on all cores.
    ///
    /// # Errors
    /// See [`Self::prepare`].
    pub fn compress(scene: &Scene) -> Result<Self, TextureError> {
        Self::prepare(scene, |_| Some(0), None)
    }

    /// Prepares the textures of all images that the scene samples, on all cores. `finest` returns the finest
    /// level of an image that may be sampled, or `None` if the image is not visible. Only blocks of this
    /// level and of coarser ones are created or taken from the cache.
    ///
    /// # Errors
    /// An image that cannot be read or decoded, that has no texels, or whose edge exceeds 16384 texels.
    pub fn prepare(
        scene: &Scene,
        finest: impl Fn(usize) -> Option<u32> + Sync,
        cache: Option<&Cache>,
    ) -> Result<Self, TextureError> {
        let roles = role::of_images(scene);
        let groups = scene::image::by_source(&scene.images, |i| roles[i].is_some());
        let made: Vec<Vec<Made>> = groups
            .into_par_iter()
            // Each thread takes one source at a time, so that as few as possible are in memory.
            .with_max_len(1)
            .map(|group| {
                let members = group.into_iter().filter_map(|index| {
                    roles[index].map(|role| Member {
                        index,
                        image: &scene.images[index],
                        role,
                        finest: finest(index),
                    })
                });
                prepare_source(members.collect(), cache)
            })
            .collect::<Result<_, TextureError>>()?;
        let mut by_image: Vec<Option<Made>> = scene.images.iter().map(|_| None).collect();
        for made in made.into_iter().flatten() {
            let index = made.index;
            by_image[index] = Some(made);
        }
        let mut set = Self::default();
        let mut resampled = Vec::new();
        for made in by_image {
            set.of_image.push(made.as_ref().map(|_| set.textures.len()));
            if let Some(made) = made {
                resampled.extend(resampling(&scene.images[made.index]));
                set.cached += usize::from(made.cached);
                set.textures.push(made.texture);
            }
        }
        set.notes.extend(note(&resampled));
        Ok(set)
    }

    /// Size of all blocks in bytes.
    pub fn bytes(&self) -> usize {
        self.textures.iter().map(|t| t.blocks.len()).sum()
    }

    /// Size of the levels that are never sampled, including those of invisible textures, in bytes.
    pub fn skipped_bytes(&self) -> usize {
        self.textures
            .iter()
            .map(|t| {
                let held = Texture {
                    format: t.held,
                    ..t.texture.clone()
                };
                compress::chain_bytes(&held, 0).saturating_sub(t.blocks.len())
            })
            .sum()
    }

    /// Number of textures without their finest levels, which are never sampled.
    pub fn shortened(&self) -> usize {
        let shortened = |t: &&CompressedTexture| t.first_level > 0 && !t.blocks.is_empty();
        self.textures.iter().filter(shortened).count()
    }

    /// Number of textures that are not visible in any view.
    pub fn unseen(&self) -> usize {
        self.textures.iter().filter(|t| t.blocks.is_empty()).count()
    }
}

/// An image of a source, with its role and the finest level that is sampled.
#[derive(Clone, Copy)]
struct Member<'a> {
    index: usize,
    image: &'a Image,
    role: Role,
    finest: Option<u32>,
}

/// Result of preparing an image.
struct Made {
    index: usize,
    texture: CompressedTexture,
    cached: bool,
}

impl Member<'_> {
    /// Finest level to create.
    fn first_level(&self) -> u32 {
        if self.image.stored.is_some() {
            return 0;
        }
        let size = compress::whole_blocks(self.image.size);
        compress::first_level(size, self.finest.unwrap_or(0))
    }

    fn made(&self, format: TexelFormat, blocks: Vec<u8>, cached: bool) -> Made {
        let (size, levels) = match self.image.stored {
            Some(stored) => (self.image.size, stored.levels),
            None => {
                let size = compress::whole_blocks(self.image.size);
                (size, compress::level_count(size))
            }
        };
        let texture = Texture {
            name: self.image.name.clone(),
            size,
            levels,
            layers: 1,
            format,
            color_space: self.image.color_space,
            part: None,
        };
        Made {
            index: self.index,
            texture: CompressedTexture {
                texture,
                first_level: self.first_level(),
                blocks,
                held: format,
            },
            cached,
        }
    }

    /// The cached texture, either complete or without the unneeded levels, if its size is that of this image.
    fn cached(&self, cache: &Cache, source: &KeyHasher) -> Option<Made> {
        let first_level = self.first_level();
        let of = |kept: u32| {
            let (format, mut blocks) = cache.load(self.key(source, kept))?;
            let unneeded = self.bytes(format, kept) - self.bytes(format, first_level);
            let whole = blocks.len() == self.bytes(format, kept);
            blocks.drain(..unneeded.min(blocks.len()));
            whole.then(|| self.made(format, blocks, true))
        };
        of(0).or_else(|| (first_level > 0).then(|| of(first_level))?)
    }

    /// Size of the levels from `first_level` on, in bytes.
    fn bytes(&self, format: TexelFormat, first_level: u32) -> usize {
        let made = self.made(format, Vec::new(), false);
        compress::chain_bytes(&made.texture.texture, first_level)
    }

    fn check_size(&self) -> Result<(), TextureError> {
        let [width, height] = self.image.size;
        let sizes = 1..=MAX_IMAGE_SIZE;
        self.ensure(
            sizes.contains(&width) && sizes.contains(&height),
            format_args!("a size from 1x1 to {MAX_IMAGE_SIZE}x{MAX_IMAGE_SIZE}"),
            format_args!("{width}x{height}"),
        )
    }

    /// The texture for the blocks of the image's file. Levels that the file leaves to be made are averages of
    /// level 0.
    fn with_stored_blocks(&self, held: &blocks::Blocks) -> Result<Made, TextureError> {
        let expected = self.image.stored;
        let found = (held.format, held.levels.len() as u32);
        let Some(stored) = expected.filter(|stored| (stored.format, stored.held) == found) else {
            // The file was changed after its header was read.
            return Err(self.error(format!("{expected:?}"), format!("{found:?}")));
        };
        if held.is_plain() && stored.levels == stored.held {
            return Ok(self.made(held.format, held.levels.concat(), false));
        }
        let Image {
            size, color_space, ..
        } = *self.image;
        let mut levels: Vec<Vec<u8>> = (0..stored.held)
            .map(|level| held.texels(level, size, color_space))
            .collect::<Option<_>>()
            .ok_or_else(|| self.error("levels of texels".to_owned(), format!("{found:?}")))?;
        if let Some(base) = levels.first() {
            let made = compress::chain(base, size, color_space, self.role.normal_map);
            // A file without levels asks for all of them, one with levels for none.
            levels.extend(
                made.into_iter()
                    .take((stored.levels - stored.held) as usize),
            );
        }
        let mut made = self.made(stored.format, levels.concat(), false);
        made.texture.held = TexelFormat::Rgba8;
        Ok(made)
    }

    fn check_texels(&self, rgba: &[u8]) -> Result<(), TextureError> {
        let [width, height] = self.image.size;
        let expected = width as usize * height as usize * 4;
        self.ensure(
            rgba.len() == expected,
            format_args!("{expected} bytes of RGBA8 for {width}x{height}"),
            format_args!("{} bytes", rgba.len()),
        )
    }

    fn ensure(
        &self,
        holds: bool,
        expected: impl Display,
        found: impl Display,
    ) -> Result<(), TextureError> {
        let what = format_args!("image '{}'", self.image.name);
        Ok(ensure(holds, what, expected, found)?)
    }

    fn error(&self, expected: String, found: String) -> TextureError {
        Broken::new(format!("image '{}'", self.image.name), expected, found).into()
    }

    /// Key of the texture with levels from `first_level` on, computed from the key of its source.
    fn key(&self, source: &KeyHasher, first_level: u32) -> cache::Key {
        let mut hasher = source.clone();
        let [width, height] = self.image.size;
        hasher.add(&(self.image.part as u64).to_le_bytes());
        hasher.add(&width.to_le_bytes());
        hasher.add(&height.to_le_bytes());
        hasher.add(&[
            u8::from(self.image.color_space == ColorSpace::Srgb),
            u8::from(self.role.normal_map),
        ]);
        hasher.add(&match self.role.alpha {
            Alpha::Ignored => [0, 0],
            Alpha::Mask(cutoff) => [1, cutoff],
            Alpha::Smooth => [2, 0],
        });
        if first_level > 0 {
            hasher.add(&first_level.to_le_bytes());
        }
        hasher.finish()
    }
}

/// Prepares the textures of all images of one source.
fn prepare_source(
    members: Vec<Member<'_>>,
    cache: Option<&Cache>,
) -> Result<Vec<Made>, TextureError> {
    let mut made = Vec::with_capacity(members.len());
    let mut wanted = Vec::new();
    for member in members {
        member.check_size()?;
        if let (Some(stored), None) = (member.image.stored, member.finest) {
            made.push(member.made(stored.format, Vec::new(), false));
            continue;
        }
        // Whether smooth alpha is really smooth, and therefore the format in the table, depends on the
        // texels.
        if member.finest.is_some() || member.role.alpha == Alpha::Smooth {
            wanted.push(member);
        } else {
            made.push(member.made(TexelFormat::Bc1, Vec::new(), false));
        }
    }
    let Some(first) = wanted.first() else {
        return Ok(made);
    };
    let source = first.image.source.open()?;
    let source_key = cache.map(|cache| {
        let mut hasher = KeyHasher::new(compress::ENCODER);
        source.identify(&mut |bytes| hasher.add(bytes));
        (cache, hasher)
    });
    if let Some((cache, hasher)) = &source_key {
        let cached = |member: &Member<'_>| {
            let made_here = member.image.stored.is_none();
            made_here.then(|| member.cached(cache, hasher)).flatten()
        };
        wanted.retain(|member| match cached(member) {
            Some(hit) => {
                made.push(hit);
                false
            }
            None => true,
        });
    }
    let parts: Vec<usize> = wanted.iter().map(|member| member.image.part).collect();
    if parts.is_empty() {
        return Ok(made);
    }
    for (member, data) in wanted.iter().zip(source.data(&parts)?) {
        let rgba = match data {
            ImageData::Rgba8(rgba) => rgba,
            ImageData::Blocks(held) => {
                made.push(member.with_stored_blocks(&held)?);
                continue;
            }
        };
        member.check_texels(&rgba)?;
        let Image {
            size, color_space, ..
        } = *member.image;
        let (format, blocks) =
            compress::compress(&rgba, size, color_space, member.role, member.first_level());
        drop(rgba);
        if let Some((cache, hasher)) = &source_key {
            cache.store(member.key(hasher, member.first_level()), format, &blocks);
        }
        made.push(member.made(format, blocks, false));
    }
    Ok(made)
}

/// One note for all resampled images.
fn note(resampled: &[String]) -> Option<String> {
    let first = resampled.first()?;
    Some(match resampled.len() {
        1 => format!("image resampled to whole blocks of 4x4 texels: {first}"),
        count => {
            format!("{count} images resampled to whole blocks of 4x4 texels, the first one {first}")
        }
    })
}

/// The change of size of an image that must be resampled.
fn resampling(image: &Image) -> Option<String> {
    if image.stored.is_some() {
        return None;
    }
    let ([width, height], size) = (image.size, compress::whole_blocks(image.size));
    (size != image.size).then(|| {
        format!(
            "'{}' from {width}x{height} to {}x{}",
            image.name, size[0], size[1]
        )
    })
}
