//! Images to block-compressed textures with full mip chains: what is uploaded is what the trace
//! says was sampled.
//!
//! - Opaque images become BC1. So do those of alpha-masked materials, with BC1's one-bit alpha; a
//!   transparent texel is then black, so the shader divides colour by alpha after filtering.
//! - Images with smooth alpha that a blended material samples become BC3.
//! - Only images that a placed mesh samples are compressed.
//! - Level sizes must be whole blocks at level 0: other sizes are resampled up to the next
//!   multiple of four, with a note.
//!
//! The encoder is texpresso's range fit with fixed weights (perceptual for colour, uniform for
//! data). It works block by block, so the bytes do not depend on the number of threads.

mod mipmap;
mod role;
#[cfg(test)]
mod tests;

use formats::texture::{ColorSpace, TexelFormat, Texture};
use mipmap::Level;
use rayon::prelude::*;
use role::{Alpha, Role};
use scene::images::MAX_SIZE;
use scene::{Image, Scene};
use std::borrow::Cow;
use std::sync::Arc;
use texpresso::{Algorithm, COLOUR_WEIGHTS_PERCEPTUAL, COLOUR_WEIGHTS_UNIFORM, Format, Params};

/// Edge of a compressed block in texels.
const BLOCK: u32 = 4;

/// A texture ready for upload.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompressedTexture {
    /// Its entry in the trace's texture table.
    pub texture: Texture,
    /// Blocks of each level, row by row from the top, largest level first.
    pub levels: Vec<Vec<u8>>,
}

impl CompressedTexture {
    /// Bytes of all levels.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(Vec::len).sum()
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
}

/// An image that cannot become a texture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("image '{image}': expected {expected}, found {found}")]
pub struct TextureError {
    /// Image name.
    pub image: String,
    /// What should be there.
    pub expected: String,
    /// What is there.
    pub found: String,
}

impl TextureSet {
    /// Compresses the images that the scene samples, on all cores.
    ///
    /// # Errors
    /// An image of no size, of more than 16384 texels an edge, or without texels.
    pub fn compress(scene: &Scene) -> Result<Self, TextureError> {
        let images = scene.images.iter().map(|i| (i, Arc::clone(&i.rgba)));
        compress_all(images.collect(), &role::of_images(scene))
    }

    /// [`Self::compress`], freeing the texels of each image as soon as it is compressed (and of
    /// the images that nothing samples), which halves the peak memory of a capture.
    ///
    /// # Errors
    /// As [`Self::compress`].
    pub fn compress_and_free(scene: &mut Scene) -> Result<Self, TextureError> {
        let roles = role::of_images(scene);
        let texels: Vec<Arc<[u8]>> = (scene.images.iter_mut())
            .map(|i| std::mem::replace(&mut i.rgba, Arc::new([])))
            .collect();
        compress_all(scene.images.iter().zip(texels).collect(), &roles)
    }
}

fn compress_all(
    images: Vec<(&Image, Arc<[u8]>)>,
    roles: &[Option<Role>],
) -> Result<TextureSet, TextureError> {
    let compressed: Vec<Option<(CompressedTexture, Option<String>)>> = images
        .into_par_iter()
        .zip(roles)
        // One image at a time to each thread, so that as few as possible are in flight.
        .with_max_len(1)
        .map(|((image, rgba), role)| {
            role.map(|role| compress_image(image, &rgba, role))
                .transpose()
        })
        .collect::<Result<_, _>>()?;
    let mut set = TextureSet::default();
    for entry in compressed {
        set.of_image
            .push(entry.as_ref().map(|_| set.textures.len()));
        if let Some((texture, note)) = entry {
            set.textures.push(texture);
            set.notes.extend(note);
        }
    }
    Ok(set)
}

fn compress_image(
    image: &Image,
    rgba: &[u8],
    role: Role,
) -> Result<(CompressedTexture, Option<String>), TextureError> {
    let error = |expected: String, found: String| TextureError {
        image: image.name.clone(),
        expected,
        found,
    };
    let [width, height] = image.size;
    if !(1..=MAX_SIZE).contains(&width) || !(1..=MAX_SIZE).contains(&height) {
        return Err(error(
            format!("a size from 1x1 to {MAX_SIZE}x{MAX_SIZE}"),
            format!("{width}x{height}"),
        ));
    }
    let expected_bytes = width as usize * height as usize * 4;
    if rgba.len() != expected_bytes {
        return Err(error(
            format!("{expected_bytes} bytes of RGBA8 for {width}x{height}"),
            format!("{} bytes", rgba.len()),
        ));
    }
    let kind = mipmap::Kind {
        srgb: image.color_space == ColorSpace::Srgb,
        normal_map: role.normal_map,
    };
    let alpha = match role.alpha {
        Alpha::Mask(_) | Alpha::Smooth if rgba.chunks_exact(4).all(|t| t[3] == 255) => {
            Alpha::Ignored
        }
        alpha => alpha,
    };
    let weigh_by_alpha = alpha != Alpha::Ignored;
    let size = image.size.map(|e| e.next_multiple_of(BLOCK));
    let (base, note) = if size == image.size {
        (Cow::Borrowed(rgba), None)
    } else {
        let level = Level::decode(rgba, image.size, kind, weigh_by_alpha);
        let note = format!(
            "image '{}' resampled from {width}x{height} to {}x{}, whole blocks of 4x4",
            image.name, size[0], size[1]
        );
        (Cow::Owned(level.resize(size).encode(kind)), Some(note))
    };

    let (format, texel_format) = match alpha {
        Alpha::Smooth => (Format::Bc3, TexelFormat::Bc3),
        Alpha::Ignored | Alpha::Mask(_) => (Format::Bc1, TexelFormat::Bc1),
    };
    let texture = Texture {
        name: image.name.clone(),
        size,
        levels: size[0].max(size[1]).ilog2() + 1,
        layers: 1,
        format: texel_format,
        color_space: image.color_space,
    };
    let coverage = match alpha {
        Alpha::Mask(cutoff) => mipmap::coverage(&base, cutoff),
        _ => 1.0,
    };
    let mut levels = Vec::with_capacity(texture.levels as usize);
    let mut texels = base.to_vec();
    let mut level: Option<Level> = None;
    for index in 0..texture.levels {
        if index > 0 {
            // Level 1 comes straight from the bytes: level 0 in floats would be the largest
            // allocation of the whole capture.
            let next = match level {
                None => Level::half_of(&base, size, kind, weigh_by_alpha),
                Some(level) => level.half(kind),
            };
            texels = next.encode(kind);
            level = Some(next);
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
        levels.push(encode_blocks(
            &texels,
            texture.level_size(index),
            format,
            kind.srgb,
        ));
    }
    Ok((CompressedTexture { texture, levels }, note))
}

fn encode_blocks(rgba: &[u8], size: [u32; 2], format: Format, perceptual: bool) -> Vec<u8> {
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
    let mut blocks = vec![0; format.compressed_size(width, height)];
    format.compress(rgba, width, height, params, &mut blocks);
    blocks
}
