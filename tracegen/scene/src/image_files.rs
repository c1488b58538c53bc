//! Images in files: located when a scene is loaded, decoded when their texels are requested.

use crate::SceneError;
use crate::blocks::{self, ImageData, StoredBlocks};
use crate::containers::{self, Kind};
use crate::files::{Origin, read_file, read_start};
use crate::image::{Image, ImageSource, OpenSource};
use formats::texture::{ColorSpace, TexelFormat};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Largest image edge in texels: the limit of a Vulkan texture in the drivers used.
pub const MAX_SIZE: u32 = 16384;

/// The decoders and their versions, part of the key under which prepared textures are cached:
/// another version may round differently. A test compares the versions with Cargo.lock.
const DECODERS: &str = "image 0.25.10, png 0.18.1, zune-jpeg 0.5.15, image-webp 0.2.4, basisu 0.1.0, bcdec_rs 0.2.1, texture2ddecoder 0.1.2, ruzstd 0.9.1";

/// Largest size of an image file in bytes: more than a PNG of [`MAX_SIZE`] squared takes.
const MAX_FILE_BYTES: u64 = 1 << 31;

/// Most bytes of texels per byte of an encoded image. Deflate reaches 1,032, and a JPEG of one
/// colour about as much. A larger image is damaged, or a small file meant to exhaust memory.
const MAX_EXPANSION: u64 = 2048;

/// Bytes of texels that any image may have, however small its file is.
const SMALL_IMAGE_BYTES: u64 = 1 << 20;

/// Bytes of RGBA8 texels that the images of any scene may have together, however small the files
/// are.
const SMALL_SCENE_BYTES: u64 = 512 << 20;

/// Most bytes of RGBA8 texels per byte of a scene's images, beyond [`SMALL_SCENE_BYTES`]. Authored
/// scenes reach 25.
const MAX_SCENE_EXPANSION: u64 = 128;

/// Encoded bytes of an image, or the file that holds them.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Source {
    /// A file.
    File(PathBuf),
    /// Bytes inside the scene file.
    Bytes(Embedded),
}

/// An image inside the scene file. Two are equal if their numbers are.
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

/// How a material reads an image, which determines its colour space and channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Usage {
    /// sRGB colour.
    Color,
    /// Linear data.
    Data,
    /// A factor in the alpha channel (specularTexture), spread over RGB as linear data.
    AlphaFactor,
    /// Colour whose alpha is the luminance of another image (OBJ's `map_d`), at that index of the
    /// requests' `masks`.
    Masked(usize),
}

impl Usage {
    fn color_space(self) -> ColorSpace {
        match self {
            Self::Color | Self::Masked(_) => ColorSpace::Srgb,
            Self::Data | Self::AlphaFactor => ColorSpace::Linear,
        }
    }
}

/// One image to decode.
#[derive(Clone, Debug)]
pub(crate) struct Request {
    pub source: Source,
    pub usage: Usage,
    /// Name for reports.
    pub name: String,
    /// The place that refers to it, named in errors.
    pub place: String,
}

/// The images of a scene, once per source and usage.
#[derive(Debug, Default)]
pub(crate) struct Requests {
    list: Vec<Request>,
    /// Position of each source and usage in `list`.
    known: HashMap<(Source, Usage), usize>,
    /// Opacity maps of `Usage::Masked`.
    masks: Vec<Request>,
    known_masks: HashMap<Source, usize>,
}

impl Requests {
    /// The index of the image in the scene's table. A new image is added.
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

    /// The images in order. Their sizes are read from the files' headers on all cores.
    ///
    /// All of them together must stay within the bound on a scene's texels, because a renderer may
    /// keep every one decoded. A check per image would accept thousands of them.
    pub fn images(&self, origin: &Origin) -> Result<Vec<Image>, SceneError> {
        let encoded: Vec<(Encoded, Header)> = (self.list.par_iter())
            .map(|request| {
                let encoded = Encoded {
                    request: request.clone(),
                    mask: match request.usage {
                        Usage::Masked(mask) => Some(self.masks[mask].clone()),
                        _ => None,
                    },
                    scene_file: origin.file.clone(),
                };
                let header = encoded.header()?;
                Ok((encoded, header))
            })
            .collect::<Result<_, SceneError>>()?;
        check_total(&encoded)?;
        let image = |(encoded, header): (Encoded, Header)| Image {
            name: encoded.request.name.clone(),
            size: header.size,
            color_space: encoded.request.usage.color_space(),
            stored: header.stored,
            source: Arc::new(encoded),
            part: 0,
        };
        Ok(encoded.into_iter().map(image).collect())
    }
}

/// Contents of the headers of an image and of its opacity map.
struct Header {
    /// Size of the image.
    size: [u32; 2],
    /// Bytes of RGBA8 texels of both.
    texel_bytes: u64,
    /// Encoded bytes of the image, and of the opacity map.
    encoded_bytes: (u64, u64),
    /// Blocks that are kept unchanged.
    stored: Option<StoredBlocks>,
}

/// Size and blocks of an image, from its header.
type Described = ([u32; 2], Option<StoredBlocks>);

/// Refuses the first image with which the texels of a scene exceed their bound.
fn check_total(images: &[(Encoded, Header)]) -> Result<(), SceneError> {
    // A file from which several images are made counts once.
    let mut files: HashMap<&Source, u64> = HashMap::new();
    for (encoded, header) in images {
        let (image, mask) = header.encoded_bytes;
        files.insert(&encoded.request.source, image);
        if let Some(request) = &encoded.mask {
            files.insert(&request.source, mask);
        }
    }
    let encoded_bytes = files.values().fold(0, |sum: u64, &n| sum.saturating_add(n));
    let most = SMALL_SCENE_BYTES.max(encoded_bytes.saturating_mul(MAX_SCENE_EXPANSION));
    let mut sum = 0_u64;
    for (number, (encoded, header)) in images.iter().enumerate() {
        sum = sum.saturating_add(header.texel_bytes);
        if sum > most {
            let [width, height] = header.size;
            return Err(encoded.invalid(
                &encoded.request,
                &format!(
                    "at most {most} bytes of texels in all images of a scene whose image files have \
                     {encoded_bytes} bytes"
                ),
                format!(
                    "{sum} bytes with this image of {width}x{height}, number {} of {}",
                    number + 1,
                    images.len()
                ),
            ));
        }
    }
    Ok(())
}

/// An encoded image and its opacity map.
struct Encoded {
    request: Request,
    mask: Option<Request>,
    /// The scene file, named in errors about images embedded in it.
    scene_file: PathBuf,
}

/// The encoded bytes of the image and its opacity map.
struct Read<'a> {
    of: &'a Encoded,
    image: Arc<[u8]>,
    mask: Option<Arc<[u8]>>,
}

impl Encoded {
    fn read(&self, request: &Request) -> Result<Arc<[u8]>, SceneError> {
        match &request.source {
            Source::File(path) => Ok(read_file(path, &request.place, MAX_FILE_BYTES)?.into()),
            Source::Bytes(embedded) => Ok(Arc::clone(&embedded.bytes)),
        }
    }

    /// Sizes from the headers, of the image and of its opacity map.
    fn header(&self) -> Result<Header, SceneError> {
        let of = |request: &Request| -> Result<(Described, u64), SceneError> {
            let bytes = self.read(request)?;
            Ok((self.describe(request, &bytes)?, bytes.len() as u64))
        };
        let mask = self.mask.as_ref().map(of).transpose()?;
        let ((mask_size, _), mask_bytes) = mask.unwrap_or_default();
        let ((size, stored), bytes) = of(&self.request)?;
        let rgba_bytes = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height) * 4;
        Ok(Header {
            size,
            texel_bytes: rgba_bytes(size) + rgba_bytes(mask_size),
            encoded_bytes: (bytes, mask_bytes),
            stored: stored.filter(|stored| self.keeps(size, stored.format)),
        })
    }

    /// Whether the image's blocks are kept: its channels must be used as stored, and level 0 must
    /// consist of whole blocks, as drivers require.
    fn keeps(&self, size: [u32; 2], format: TexelFormat) -> bool {
        matches!(self.request.usage, Usage::Color | Usage::Data)
            && blocks::is_whole_blocks(format, size)
    }

    /// Reads the header of an image in any format.
    fn describe(&self, request: &Request, bytes: &[u8]) -> Result<Described, SceneError> {
        match containers::of(bytes) {
            Some(kind) => {
                let header = (kind.header)(bytes).map_err(|e| self.fault(request, kind, e))?;
                Ok((header.size, Some(header.stored)))
            }
            None => Ok((self.decoder(request, bytes)?.1, None)),
        }
    }

    /// The levels of an image that holds blocks, and its size.
    fn stored(
        &self,
        request: &Request,
        bytes: &[u8],
        kind: &Kind,
    ) -> Result<([u32; 2], blocks::Blocks), SceneError> {
        let fault = |e| self.fault(request, kind, e);
        let header = (kind.header)(bytes).map_err(fault)?;
        let [width, height] = header.size;
        self.check_expansion(
            request,
            bytes,
            header.size,
            u64::from(width) * u64::from(height) * 4,
        )?;
        Ok((header.size, (kind.blocks)(bytes).map_err(fault)?))
    }

    fn check_expansion(
        &self,
        request: &Request,
        bytes: &[u8],
        [width, height]: [u32; 2],
        total_bytes: u64,
    ) -> Result<(), SceneError> {
        let most = bytes.len() as u64 * MAX_EXPANSION + SMALL_IMAGE_BYTES;
        if total_bytes <= most {
            return Ok(());
        }
        Err(self.invalid(
            request,
            &format!("at most {most} bytes of texels from {} bytes", bytes.len()),
            format!("{width}x{height}, {total_bytes} bytes"),
        ))
    }

    /// Size and RGBA8 texels.
    fn decode(&self, request: &Request, bytes: &[u8]) -> Result<([u32; 2], Vec<u8>), SceneError> {
        if let Some(kind) = containers::of(bytes) {
            let (size, stored) = self.stored(request, bytes, kind)?;
            let color_space = request.usage.color_space();
            let texels = stored.texels(0, size, color_space).ok_or_else(|| {
                let expected = format!("blocks of {:?}", stored.held);
                self.fault(request, kind, (expected, "others".into()))
            })?;
            return Ok((size, texels));
        }
        let (decoder, size) = self.decoder(request, bytes)?;
        self.check_expansion(request, bytes, size, decoder.total_bytes())?;
        let decoded = DynamicImage::from_decoder(decoder).map_err(|e| self.corrupt(request, &e))?;
        Ok((size, decoded.into_rgba8().into_raw()))
    }

    /// A decoder that has read the header, and the size in that header.
    fn decoder<'a>(
        &self,
        request: &Request,
        bytes: &'a [u8],
    ) -> Result<(impl ImageDecoder + 'a, [u32; 2]), SceneError> {
        let mut reader = ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|e| self.corrupt(request, &e))?;
        let mut limits = Limits::no_limits();
        // Eight bytes per texel of the largest image: 16-bit RGBA before it is converted to RGBA8.
        limits.max_alloc = Some(u64::from(MAX_SIZE) * u64::from(MAX_SIZE) * 8);
        reader.limits(limits);
        let decoder = reader
            .into_decoder()
            .map_err(|e| self.corrupt(request, &e))?;
        let (width, height) = decoder.dimensions();
        if width == 0 || height == 0 || width > MAX_SIZE || height > MAX_SIZE {
            return Err(self.invalid(
                request,
                &format!("a size from 1x1 to {MAX_SIZE}x{MAX_SIZE}"),
                format!("{width}x{height}"),
            ));
        }
        Ok((decoder, [width, height]))
    }

    fn corrupt(&self, request: &Request, error: &dyn std::fmt::Display) -> SceneError {
        self.invalid(
            request,
            "a readable PNG, JPEG, WebP, KTX2 or DDS image",
            error.to_string(),
        )
    }

    fn fault(&self, request: &Request, kind: &Kind, fault: containers::Fault) -> SceneError {
        let (expected, found) = fault;
        self.invalid(request, &expected, format!("{found} ({})", kind.name))
    }

    fn invalid(&self, request: &Request, expected: &str, found: String) -> SceneError {
        let file = match &request.source {
            Source::File(path) => path,
            Source::Bytes(_) => &self.scene_file,
        };
        let place = format!("{} (image '{}')", request.place, request.name);
        Origin::new(file).invalid(place, expected, found)
    }
}

impl ImageSource for Encoded {
    fn open(&self) -> Result<Box<dyn OpenSource + '_>, SceneError> {
        let mask = self.mask.as_ref().map(|mask| self.read(mask));
        Ok(Box::new(Read {
            of: self,
            image: self.read(&self.request)?,
            mask: mask.transpose()?,
        }))
    }
}

impl OpenSource for Read<'_> {
    fn identify(&self, sink: &mut dyn FnMut(&[u8])) {
        sink(DECODERS.as_bytes());
        sink(match self.of.request.usage {
            Usage::Color => b"color",
            Usage::Data => b"data",
            Usage::AlphaFactor => b"alpha",
            Usage::Masked(_) => b"masked",
        });
        // The length separates the image from its opacity map.
        sink(&(self.image.len() as u64).to_le_bytes());
        sink(&self.image);
        if let Some(mask) = &self.mask {
            sink(mask);
        }
    }

    fn texels(&self, parts: &[usize]) -> Result<Vec<Vec<u8>>, SceneError> {
        let (size, mut rgba) = self.of.decode(&self.of.request, &self.image)?;
        if self.of.request.usage == Usage::AlphaFactor {
            rgba = spread_alpha(rgba);
        }
        if let (Some(request), Some(bytes)) = (&self.of.mask, &self.mask) {
            let (mask_size, mask) = self.of.decode(request, bytes)?;
            rgba = with_mask(rgba, size, &mask, mask_size);
        }
        Ok(vec![rgba; parts.len()])
    }

    fn data(&self, parts: &[usize]) -> Result<Vec<ImageData>, SceneError> {
        if let Some(kind) = containers::of(&self.image) {
            let (size, blocks) = self.of.stored(&self.of.request, &self.image, kind)?;
            if self.of.keeps(size, blocks.format) {
                return Ok(vec![ImageData::Blocks(blocks); parts.len()]);
            }
        }
        let texels = self.texels(parts)?;
        Ok(texels.into_iter().map(ImageData::Rgba8).collect())
    }
}

/// Whether the file begins like a supported image; `None` if it cannot be read.
pub(crate) fn is_readable(file: &Path) -> Option<bool> {
    let (start, _) = read_start(file, "image", 16).ok()?;
    let format = image::guess_format(&start).ok();
    let pixels = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP];
    Some(containers::of(&start).is_some() || format.is_some_and(|f| pixels.contains(&f)))
}

fn spread_alpha(mut rgba: Vec<u8>) -> Vec<u8> {
    for texel in rgba.chunks_exact_mut(4) {
        let alpha = texel[3];
        texel.copy_from_slice(&[alpha, alpha, alpha, 255]);
    }
    rgba
}

/// Copies the mask's red channel (or its alpha, if it has one) into alpha. Samples the nearest
/// texel if the sizes differ.
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

#[cfg(test)]
mod tests {
    use super::DECODERS;

    #[test]
    fn decoder_versions_in_cache_keys_match_the_lock_file() {
        let lock = include_str!("../../../Cargo.lock");
        for decoder in DECODERS.split(", ") {
            let (name, version) = decoder.split_once(' ').unwrap_or_default();
            let entry = format!("name = \"{name}\"\nversion = \"{version}\"\n");
            assert!(lock.contains(&entry), "{decoder} is not in Cargo.lock");
        }
    }
}
