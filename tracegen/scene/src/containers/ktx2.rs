//! KTX2: Basis Universal (see [`super::basis`]), blocks as a texture unit reads them, or uncompressed
//! texels of at most 8 bits a channel.

use super::{Fault, Header, Kind, Texels, basis, levels};
use crate::blocks::{Blocks, level_bytes, level_size};
use crate::channels::{Channel, Packed, View};
use formats::texture::TexelFormat;
use ktx2::{ColorModel, Format, Reader, SupercompressionScheme as Scheme};
use std::borrow::Cow;
use std::io::Read;

pub(super) const KIND: Kind = Kind {
    name: "KTX2",
    magic: b"\xabKTX 20\xbb\r\n\x1a\n",
    header: |bytes| read(bytes).map(|file| file.header),
    blocks,
};

/// What the levels hold.
#[derive(Clone, Copy)]
enum Payload {
    Basis,
    Plain(Texels),
    Zstd(Texels),
}

/// A file whose header is valid.
struct File {
    header: Header,
    payload: Payload,
    view: View,
}

fn fault(found: impl Into<String>) -> Fault {
    (
        "a KTX2 image of Basis Universal, BC1 to BC7, ETC2, EAC, ASTC 4x4, 5x5, 6x6 or 8x8, or one to four \
         channels of at most 8 bits"
            .to_owned(),
        found.into(),
    )
}

/// Opens a file. The crate's reader cannot take a texel block of 256 texels.
fn open(bytes: &[u8]) -> Result<Reader<&[u8]>, Fault> {
    let word = |at: usize| {
        let four = bytes.get(at..).and_then(<[u8]>::first_chunk);
        four.map(|four| u32::from_le_bytes(*four) as usize)
    };
    let mut at = word(48).unwrap_or(usize::MAX).saturating_add(4);
    let end = word(52).and_then(|length| at.checked_add(length));
    // Descriptor blocks: two words that end in the block's size, then model and flags, then its dimensions.
    while let (Some(0), Some(version)) = (word(at), word(at.saturating_add(4))) {
        let dimensions = bytes.get(at + 12..at + 16).unwrap_or_default();
        if version & 0xffff == 2 && dimensions.contains(&255) {
            let expected = "texel blocks of 1 to 255 texels along each axis";
            return Err((expected.to_owned(), "256".to_owned()));
        }
        at += (version >> 16).max(4);
        if end.is_none_or(|end| at >= end) {
            break;
        }
    }
    Reader::new(bytes).map_err(|e| fault(e.to_string()))
}

/// `KTXswizzle` and `KTXorientation`.
fn view(reader: &Reader<&[u8]>) -> Result<View, Fault> {
    let mut view = View::default();
    for (key, value) in reader.key_value_data() {
        let text = value.strip_suffix(b"\0").unwrap_or(value);
        let found = || String::from_utf8_lossy(text).into_owned();
        match key {
            "KTXswizzle" => {
                let channel = |letter: &u8| match letter {
                    b'r' => Some(Channel::Stored(0)),
                    b'g' => Some(Channel::Stored(1)),
                    b'b' => Some(Channel::Stored(2)),
                    b'a' => Some(Channel::Stored(3)),
                    b'0' => Some(Channel::Zero),
                    b'1' => Some(Channel::One),
                    _ => None,
                };
                let channels: Option<Vec<Channel>> = text.iter().map(channel).collect();
                let four = channels.and_then(|channels| <[Channel; 4]>::try_from(channels).ok());
                view.swizzle = four.ok_or_else(|| {
                    let expected = "KTXswizzle: four of r, g, b, a, 0 and 1";
                    (expected.to_owned(), format!("'{}'", found()))
                })?;
            }
            "KTXorientation" => {
                view.flipped = match text {
                    b"rd" => [false, false],
                    b"ru" => [false, true],
                    b"ld" => [true, false],
                    b"lu" => [true, true],
                    _ => {
                        let expected = "KTXorientation: rd, ru, ld or lu";
                        return Err((expected.to_owned(), format!("'{}'", found())));
                    }
                };
            }
            _ => {}
        }
    }
    Ok(view)
}

fn read(bytes: &[u8]) -> Result<File, Fault> {
    let reader = open(bytes)?;
    let view = view(&reader)?;
    let of = reader.header();
    if of.pixel_depth > 1 || of.layer_count > 1 || of.face_count != 1 || of.pixel_height == 0 {
        return Err((
            "a two-dimensional image".to_owned(),
            "a line, a volume, a cube map or an array".to_owned(),
        ));
    }
    let size = [of.pixel_width, of.pixel_height];
    let levels = of.level_count;
    let is_basis = of.supercompression_scheme == Some(Scheme::BasisLZ)
        || reader.color_model() == Some(ColorModel::UASTC)
        || reader.color_model() == Some(ColorModel::ETC1S);
    if is_basis {
        // The levels' own lengths are checked before anything is allocated for them.
        let header = super::header(TexelFormat::Bc7, size, levels)?;
        for (number, stored) in (0..).zip(reader.levels()).take(header.stored.held as usize) {
            let most = level_bytes(TexelFormat::Bc7, level_size(size, number)) as u64;
            if stored.uncompressed_byte_length > most {
                return Err((
                    format!("at most {most} bytes in level {number}"),
                    format!("{} bytes", stored.uncompressed_byte_length),
                ));
            }
        }
        let format = basis::format(bytes)?;
        return Ok(File {
            header: super::header(format, size, levels)?,
            payload: Payload::Basis,
            view,
        });
    }
    let named = of.format;
    let (format, texels) = named
        .and_then(|named| {
            let kept = format(named).map(|format| (format, Texels::Own));
            kept.or_else(|| packed(named).map(|(format, packed)| (format, Texels::Packed(packed))))
        })
        .ok_or_else(|| fault(named.map_or("no format".to_owned(), |f| format!("{f:?}"))))?;
    let payload = match of.supercompression_scheme {
        None => Payload::Plain(texels),
        Some(Scheme::Zstandard) => Payload::Zstd(texels),
        Some(other) => return Err(fault(format!("supercompression {other:?}"))),
    };
    Ok(File {
        header: super::header(format, size, levels)?,
        payload,
        view,
    })
}

fn format(format: Format) -> Option<TexelFormat> {
    Some(match format {
        Format::BC1_RGB_UNORM_BLOCK
        | Format::BC1_RGB_SRGB_BLOCK
        | Format::BC1_RGBA_UNORM_BLOCK
        | Format::BC1_RGBA_SRGB_BLOCK => TexelFormat::Bc1,
        Format::BC2_UNORM_BLOCK | Format::BC2_SRGB_BLOCK => TexelFormat::Bc2,
        Format::BC3_UNORM_BLOCK | Format::BC3_SRGB_BLOCK => TexelFormat::Bc3,
        Format::BC4_UNORM_BLOCK => TexelFormat::Bc4,
        Format::BC5_UNORM_BLOCK => TexelFormat::Bc5,
        Format::BC6H_UFLOAT_BLOCK => TexelFormat::Bc6h,
        Format::BC7_UNORM_BLOCK | Format::BC7_SRGB_BLOCK => TexelFormat::Bc7,
        Format::ETC2_R8G8B8_UNORM_BLOCK | Format::ETC2_R8G8B8_SRGB_BLOCK => TexelFormat::Etc2,
        Format::ETC2_R8G8B8A8_UNORM_BLOCK | Format::ETC2_R8G8B8A8_SRGB_BLOCK => {
            TexelFormat::Etc2Rgba
        }
        Format::EAC_R11_UNORM_BLOCK => TexelFormat::EacR11,
        Format::EAC_R11G11_UNORM_BLOCK => TexelFormat::EacRg11,
        Format::ASTC_4x4_UNORM_BLOCK | Format::ASTC_4x4_SRGB_BLOCK => TexelFormat::Astc4x4,
        Format::ASTC_5x5_UNORM_BLOCK | Format::ASTC_5x5_SRGB_BLOCK => TexelFormat::Astc5x5,
        Format::ASTC_6x6_UNORM_BLOCK | Format::ASTC_6x6_SRGB_BLOCK => TexelFormat::Astc6x6,
        Format::ASTC_8x8_UNORM_BLOCK | Format::ASTC_8x8_SRGB_BLOCK => TexelFormat::Astc8x8,
        Format::R8G8B8A8_UNORM
        | Format::R8G8B8A8_SRGB
        | Format::A8B8G8R8_UNORM_PACK32
        | Format::A8B8G8R8_SRGB_PACK32 => TexelFormat::Rgba8,
        _ => return None,
    })
}

/// Formats whose texels are decoded, with the format of their texture. Texture units have no texels of
/// three bytes.
fn packed(format: Format) -> Option<(TexelFormat, Packed)> {
    let two = |red, green, blue, alpha| {
        let masks = [red, green, blue, alpha];
        (TexelFormat::Packed16, Packed { bytes: 2, masks })
    };
    let bytes = |format, order: &[u8]| (format, Packed::of_bytes(order));
    Some(match format {
        Format::R8_UNORM | Format::R8_SRGB => bytes(TexelFormat::R8, &[0]),
        Format::R8G8_UNORM | Format::R8G8_SRGB => bytes(TexelFormat::Rg8, &[0, 1]),
        Format::R8G8B8_UNORM | Format::R8G8B8_SRGB => bytes(TexelFormat::Rgba8, &[0, 1, 2]),
        Format::B8G8R8_UNORM | Format::B8G8R8_SRGB => bytes(TexelFormat::Rgba8, &[2, 1, 0]),
        Format::B8G8R8A8_UNORM | Format::B8G8R8A8_SRGB => bytes(TexelFormat::Rgba8, &[2, 1, 0, 3]),
        Format::R4G4B4A4_UNORM_PACK16 => two(0xf000, 0x0f00, 0x00f0, 0x000f),
        Format::B4G4R4A4_UNORM_PACK16 => two(0x00f0, 0x0f00, 0xf000, 0x000f),
        Format::R5G6B5_UNORM_PACK16 => two(0xf800, 0x07e0, 0x001f, 0),
        Format::B5G6R5_UNORM_PACK16 => two(0x001f, 0x07e0, 0xf800, 0),
        Format::R5G5B5A1_UNORM_PACK16 => two(0xf800, 0x07c0, 0x003e, 1),
        Format::B5G5R5A1_UNORM_PACK16 => two(0x003e, 0x07c0, 0xf800, 1),
        Format::A1R5G5B5_UNORM_PACK16 => two(0x7c00, 0x03e0, 0x001f, 0x8000),
        _ => return None,
    })
}

fn blocks(bytes: &[u8]) -> Result<Blocks, Fault> {
    let file = read(bytes)?;
    let header = &file.header;
    let reader = open(bytes)?;
    let stored: Vec<&[u8]> = (reader.levels().map(|level| level.data))
        .take(header.stored.held as usize)
        .collect();
    let (held, levels) = match file.payload {
        Payload::Basis => (header.stored.format, basis::levels(bytes, header)?),
        Payload::Plain(texels) => levels(header, texels, |number, _| {
            Ok(Cow::Borrowed(
                stored.get(number as usize).copied().unwrap_or_default(),
            ))
        })?,
        Payload::Zstd(texels) => levels(header, texels, |number, needed| {
            let compressed = stored.get(number as usize).copied().unwrap_or_default();
            inflate(number, compressed, needed).map(Cow::Owned)
        })?,
    };
    Ok(Blocks {
        format: header.stored.format,
        held,
        levels,
        view: file.view,
    })
}

/// At most `needed` bytes of a Zstandard frame.
fn inflate(number: u32, compressed: &[u8], needed: usize) -> Result<Vec<u8>, Fault> {
    let fault = |found: String| (format!("a Zstandard frame in level {number}"), found);
    let decoder =
        ruzstd::decoding::StreamingDecoder::new(compressed).map_err(|e| fault(e.to_string()))?;
    let mut bytes = Vec::new();
    decoder
        .take(needed as u64)
        .read_to_end(&mut bytes)
        .map_err(|e| fault(e.to_string()))?;
    Ok(bytes)
}
