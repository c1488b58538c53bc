//! Image decoding, in parallel and bounded.

use super::files::{Origin, read_file, read_start};
use super::{Image, LoadOptions, SceneError};
use formats::texture::ColorSpace;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Largest image edge in texels: what a Vulkan texture may have on the drivers used.
pub const MAX_SIZE: u32 = 16384;

/// Most bytes of an image's file: more than a PNG of [`MAX_SIZE`] squared takes.
const MAX_FILE_BYTES: u64 = 1 << 31;

/// Most bytes of texels that a byte of an encoded image stands for: deflate reaches 1,032, a JPEG
/// of one colour about as much. Larger images cannot be whole, and would cost a small file nothing.
const MAX_EXPANSION: u64 = 2048;

/// Bytes of texels that any image may have.
const SMALL_IMAGE_BYTES: u64 = 1 << 20;

/// Encoded bytes of an image, or where they are.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Source {
    /// A file.
    File(PathBuf),
    /// Bytes inside the scene file.
    Bytes(Embedded),
}

/// An image inside the scene file. Two are the same where their numbers are.
#[derive(Clone, Debug)]
pub(crate) struct Embedded {
    pub number: usize,
    pub bytes: Arc<[u8]>,
}

impl PartialEq for Embedded {
    fn eq(&self, other: &Self) -> bool {
        self.number == other.number
    }
}

impl Eq for Embedded {}

impl Hash for Embedded {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.number.hash(state);
    }
}

/// How a material reads an image, which decides its colour space and channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Usage {
    /// sRGB colour.
    Color,
    /// Linear data.
    Data,
    /// A factor in the alpha channel (specularTexture), spread over RGB as linear data.
    AlphaFactor,
    /// Colour with an alpha that another image's luminance gives (OBJ's `map_d`), at that index of
    /// the requests' `masks`.
    Masked(usize),
}

/// One image to decode.
#[derive(Clone, Debug)]
pub(crate) struct Request {
    pub source: Source,
    pub usage: Usage,
    /// Name for reports.
    pub name: String,
    /// Who refers to it, for errors.
    pub place: String,
}

/// The images of a scene, each source and usage once.
#[derive(Debug, Default)]
pub(crate) struct Requests {
    list: Vec<Request>,
    /// Where each source and usage stands in `list`.
    known: HashMap<(Source, Usage), usize>,
    /// Opacity maps of `Usage::Masked`.
    masks: Vec<Request>,
    known_masks: HashMap<Source, usize>,
}

impl Requests {
    /// The index of the image in the scene's table, added where it is new.
    pub fn index(&mut self, request: Request) -> usize {
        let key = (request.source.clone(), request.usage);
        *self.known.entry(key).or_insert_with(|| {
            self.list.push(request);
            self.list.len() - 1
        })
    }

    /// The index of an opacity map among the masks.
    pub fn mask(&mut self, request: Request) -> usize {
        let key = request.source.clone();
        *self.known_masks.entry(key).or_insert_with(|| {
            self.masks.push(request);
            self.masks.len() - 1
        })
    }

    /// Decodes everything on all cores (or only reads the sizes), in order.
    pub fn decode(&self, origin: &Origin, options: &LoadOptions) -> Result<Vec<Image>, SceneError> {
        self.list
            .par_iter()
            .map(|request| {
                let (size, rgba) = read(request, origin, options)?;
                let (rgba, color_space) = match request.usage {
                    Usage::Color => (rgba, ColorSpace::Srgb),
                    Usage::Data => (rgba, ColorSpace::Linear),
                    Usage::AlphaFactor => (spread_alpha(rgba), ColorSpace::Linear),
                    Usage::Masked(mask) => {
                        let (mask_size, mask) = read(&self.masks[mask], origin, options)?;
                        let rgba = with_mask(rgba, size, &mask, mask_size);
                        (rgba, ColorSpace::Srgb)
                    }
                };
                Ok(Image {
                    name: request.name.clone(),
                    size,
                    rgba: rgba.into(),
                    color_space,
                })
            })
            .collect()
    }
}

/// Whether the file begins as a PNG or a JPEG; `None` where it cannot be read.
pub(crate) fn is_png_or_jpeg(file: &Path) -> Option<bool> {
    let (start, _) = read_start(file, "image", 16).ok()?;
    let format = image::guess_format(&start).ok();
    Some(matches!(format, Some(ImageFormat::Png | ImageFormat::Jpeg)))
}

/// Size and RGBA8 texels; no texels where the options say so.
fn read(
    request: &Request,
    origin: &Origin,
    options: &LoadOptions,
) -> Result<([u32; 2], Vec<u8>), SceneError> {
    let (bytes, file) = match &request.source {
        Source::File(path) => (
            read_file(path, &request.place, MAX_FILE_BYTES)?.into(),
            path,
        ),
        Source::Bytes(embedded) => (Arc::clone(&embedded.bytes), &origin.file),
    };
    let invalid = |expected: &str, found: String| {
        let place = format!("{} (image '{}')", request.place, request.name);
        Origin::new(file).invalid(place, expected, found)
    };
    let corrupt = |e: image::ImageError| invalid("a readable PNG or JPEG image", e.to_string());
    let mut reader = ImageReader::new(Cursor::new(&*bytes))
        .with_guessed_format()
        .map_err(|e| invalid("a readable PNG or JPEG image", e.to_string()))?;
    let mut limits = Limits::no_limits();
    limits.max_image_width = Some(MAX_SIZE);
    limits.max_image_height = Some(MAX_SIZE);
    // Eight bytes a texel of the largest image: 16-bit RGBA before it becomes RGBA8.
    limits.max_alloc = Some(u64::from(MAX_SIZE) * u64::from(MAX_SIZE) * 8);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(corrupt)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 || width > MAX_SIZE || height > MAX_SIZE {
        return Err(invalid(
            &format!("a size from 1x1 to {MAX_SIZE}x{MAX_SIZE}"),
            format!("{width}x{height}"),
        ));
    }
    if !options.images {
        return Ok(([width, height], Vec::new()));
    }
    let most = bytes.len() as u64 * MAX_EXPANSION + SMALL_IMAGE_BYTES;
    if decoder.total_bytes() > most {
        return Err(invalid(
            &format!("at most {most} bytes of texels from {} bytes", bytes.len()),
            format!("{width}x{height}, {} bytes", decoder.total_bytes()),
        ));
    }
    let decoded = DynamicImage::from_decoder(decoder).map_err(corrupt)?;
    Ok(([width, height], decoded.into_rgba8().into_raw()))
}

fn spread_alpha(mut rgba: Vec<u8>) -> Vec<u8> {
    for texel in rgba.chunks_exact_mut(4) {
        let alpha = texel[3];
        texel.copy_from_slice(&[alpha, alpha, alpha, 255]);
    }
    rgba
}

/// Puts the mask's red channel (or its alpha, where it has one) into alpha, sampling the nearest
/// texel where the sizes differ.
fn with_mask(mut rgba: Vec<u8>, size: [u32; 2], mask: &[u8], mask_size: [u32; 2]) -> Vec<u8> {
    let alpha_map = mask.chunks_exact(4).any(|t| t[3] != 255);
    let channel = if alpha_map { 3 } else { 0 };
    let [width, height] = size.map(|e| e as usize);
    let [mask_width, mask_height] = mask_size.map(|e| e as usize);
    for (i, texel) in rgba.chunks_exact_mut(4).enumerate() {
        let x = (i % width) * mask_width / width;
        let y = (i / width) * mask_height / height;
        texel[3] = mask[(y * mask_width + x) * 4 + channel];
    }
    rgba
}
