//! Images to block-compressed textures with full mip chains: what is uploaded is what the trace
//! says was sampled.
//!
//! - Opaque images become BC1. So do those of alpha-masked materials, with BC1's one-bit alpha; a
//!   transparent texel is then black, so the shader divides colour by alpha after filtering.
//! - Images with smooth alpha that a blended material samples become BC3.
//! - Images whose file holds compressed blocks keep them, with the levels that are there.
//! - Only images that a placed mesh samples become textures.
//! - Level sizes must be whole blocks at level 0: other sizes are resampled up to the next
//!   multiple of four, with a note.
//! - A texture that no view sees gets its entry in the trace's table and no blocks.
//! - Blocks are kept between runs, see [`Cache`].
//!
//! The encoder is texpresso's range fit with fixed weights (perceptual for colour, uniform for
//! data). It works block by block, so the bytes do not depend on the number of threads.

mod cache;
mod compress;
mod mipmap;
mod role;
#[cfg(test)]
mod tests;

pub use cache::Cache;

use cache::KeyHasher;
use formats::texture::{ColorSpace, TexelFormat, Texture};
use rayon::prelude::*;
use role::{Alpha, Role};
use scene::blocks::{self, ImageData};
use scene::{Image, MAX_IMAGE_SIZE, Scene, SceneError};
use std::borrow::Cow;

/// A texture ready for upload.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompressedTexture {
    /// Its entry in the trace's texture table.
    pub texture: Texture,
    /// Finest level that there are blocks of: finer ones are never sampled.
    pub first_level: u32,
    /// Blocks of the levels from there on, largest level first, each row by row from the top. Empty
    /// for a texture that no view sees.
    pub blocks: Vec<u8>,
}

impl CompressedTexture {
    /// The texture as every driver samples it: BC1, BC3 and RGBA8 as they are, other blocks decoded
    /// to RGBA8. Coordinates do not depend on it.
    #[must_use]
    pub fn for_driver(&self) -> Cow<'_, Self> {
        let own = &self.texture;
        if matches!(
            own.format,
            TexelFormat::Bc1 | TexelFormat::Bc3 | TexelFormat::Rgba8
        ) {
            return Cow::Borrowed(self);
        }
        let mut rest = self.blocks.as_slice();
        let mut texels = Vec::new();
        for level in self.first_level..own.levels {
            let size = own.level_size(level);
            let bytes = blocks::level_bytes(own.format, size).min(rest.len());
            let (stored, others) = rest.split_at(bytes);
            let decoded = blocks::decode(own.format, size, own.color_space, stored);
            texels.extend(decoded.unwrap_or_default());
            rest = others;
        }
        Cow::Owned(Self {
            texture: Texture {
                format: TexelFormat::Rgba8,
                ..own.clone()
            },
            first_level: self.first_level,
            blocks: texels,
        })
    }
}

/// The textures that a scene samples.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TextureSet {
    /// Textures in order of the scene's images.
    pub textures: Vec<CompressedTexture>,
    /// Texture of each image of the scene; `None` for images that no placed mesh samples.
    pub of_image: Vec<Option<usize>>,
    /// What was changed on the way, one sentence each.
    pub notes: Vec<String>,
    /// Textures whose blocks the cache held.
    pub cached: usize,
}

/// Why an image cannot become a texture.
#[derive(Debug, thiserror::Error)]
pub enum TextureError {
    /// Its size or its texels are out of range.
    #[error("image '{image}': expected {expected}, found {found}")]
    Image {
        /// Image name.
        image: String,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// Its texels cannot be made.
    #[error(transparent)]
    Source(#[from] SceneError),
}

impl TextureSet {
    /// Compresses all images that the scene samples, on all cores.
    ///
    /// # Errors
    /// As [`Self::prepare`].
    pub fn compress(scene: &Scene) -> Result<Self, TextureError> {
        Self::prepare(scene, |_| Some(0), None)
    }

    /// Makes the textures of all images that the scene samples, on all cores. `finest` tells of an
    /// image that is seen the finest level that may be sampled; blocks of that and of coarser ones are
    /// made, and taken from the cache where it has them.
    ///
    /// # Errors
    /// An image that cannot be read or decoded, of no size or of more than 16384 texels an edge.
    pub fn prepare(
        scene: &Scene,
        finest: impl Fn(usize) -> Option<u32> + Sync,
        cache: Option<&Cache>,
    ) -> Result<Self, TextureError> {
        let roles = role::of_images(scene);
        let groups = scene::image::by_source(&scene.images, |i| roles[i].is_some());
        let made: Vec<Vec<Made>> = groups
            .into_par_iter()
            // One source at a time to each thread, so that as few as possible are in flight.
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

    /// Bytes of all blocks.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.textures.iter().map(|t| t.blocks.len()).sum()
    }

    /// Bytes that the levels would have that are never sampled, those of textures that no view sees
    /// among them.
    #[must_use]
    pub fn skipped_bytes(&self) -> usize {
        self.textures
            .iter()
            .map(|t| compress::chain_bytes(&t.texture, 0) - t.blocks.len())
            .sum()
    }

    /// Textures whose finest levels are never sampled.
    #[must_use]
    pub fn shortened(&self) -> usize {
        let shortened = |t: &&CompressedTexture| t.first_level > 0 && !t.blocks.is_empty();
        self.textures.iter().filter(shortened).count()
    }

    /// Textures that no view sees.
    #[must_use]
    pub fn unseen(&self) -> usize {
        self.textures.iter().filter(|t| t.blocks.is_empty()).count()
    }
}

/// An image that is to become a texture.
#[derive(Clone, Copy)]
struct Member<'a> {
    index: usize,
    image: &'a Image,
    role: Role,
    finest: Option<u32>,
}

/// What became of it.
struct Made {
    index: usize,
    texture: CompressedTexture,
    cached: bool,
}

impl Member<'_> {
    /// Finest level to make.
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
        };
        Made {
            index: self.index,
            texture: CompressedTexture {
                texture,
                first_level: self.first_level(),
                blocks,
            },
            cached,
        }
    }

    /// The cached texture, whole or without the levels that are not needed, if it is one of this
    /// image's size.
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

    /// Bytes of the levels from one on.
    fn bytes(&self, format: TexelFormat, first_level: u32) -> usize {
        let made = self.made(format, Vec::new(), false);
        compress::chain_bytes(&made.texture.texture, first_level)
    }

    fn check_size(&self) -> Result<(), TextureError> {
        let [width, height] = self.image.size;
        if [width, height]
            .iter()
            .all(|e| (1..=MAX_IMAGE_SIZE).contains(e))
        {
            return Ok(());
        }
        Err(self.error(
            format!("a size from 1x1 to {MAX_IMAGE_SIZE}x{MAX_IMAGE_SIZE}"),
            format!("{width}x{height}"),
        ))
    }

    /// The texture of blocks that the image's file holds.
    fn kept(&self, held: blocks::Blocks) -> Result<Made, TextureError> {
        let expected = self.image.stored;
        let found = (held.format, held.levels.len() as u32);
        if expected.map(|stored| (stored.format, stored.levels)) == Some(found) {
            return Ok(self.made(held.format, held.levels.concat(), false));
        }
        // The file changed after its header was read.
        Err(self.error(format!("{expected:?}"), format!("{found:?}")))
    }

    fn check_texels(&self, rgba: &[u8]) -> Result<(), TextureError> {
        let [width, height] = self.image.size;
        let expected = width as usize * height as usize * 4;
        if rgba.len() == expected {
            return Ok(());
        }
        Err(self.error(
            format!("{expected} bytes of RGBA8 for {width}x{height}"),
            format!("{} bytes", rgba.len()),
        ))
    }

    fn error(&self, expected: String, found: String) -> TextureError {
        TextureError::Image {
            image: self.image.name.clone(),
            expected,
            found,
        }
    }

    /// The key of the texture with its levels from `first_level` on, from the key of its source.
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

/// The textures of images that one source makes.
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
        // Only the texels tell whether smooth alpha is smooth, and so the format in the table.
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
                made.push(member.kept(held)?);
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

/// What happens to an image that is not whole blocks.
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
