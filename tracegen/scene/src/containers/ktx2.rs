//! KTX2: Basis Universal (see [`super::basis`]), or blocks as a texture unit reads them.

use super::{Fault, Header, Kind, basis, level};
use crate::blocks::{Blocks, level_bytes, level_size};
use formats::texture::TexelFormat;
use ktx2::{ColorModel, Format, Reader, SupercompressionScheme as Scheme};
use std::io::Read;

pub(super) const KIND: Kind = Kind {
    name: "KTX2",
    magic: b"\xabKTX 20\xbb\r\n\x1a\n",
    header: |bytes| read(bytes).map(|(header, _)| header),
    blocks,
};

/// What the levels hold.
enum Payload {
    Basis,
    Plain,
    Zstd,
}

fn fault(found: impl Into<String>) -> Fault {
    (
        "a KTX2 image of Basis Universal, BC1 to BC7, ETC2, EAC, ASTC 4x4, 5x5, 6x6 or 8x8, or RGBA8"
            .to_owned(),
        found.into(),
    )
}

fn read(bytes: &[u8]) -> Result<(Header, Payload), Fault> {
    let reader = Reader::new(bytes).map_err(|e| fault(e.to_string()))?;
    let of = reader.header();
    if of.pixel_depth > 1 || of.layer_count > 1 || of.face_count != 1 || of.pixel_height == 0 {
        return Err((
            "a two-dimensional image".to_owned(),
            "a line, a volume, a cube map or an array".to_owned(),
        ));
    }
    let size = [of.pixel_width, of.pixel_height];
    let levels = of.level_count.max(1);
    let is_basis = of.supercompression_scheme == Some(Scheme::BasisLZ)
        || reader.color_model() == Some(ColorModel::UASTC)
        || reader.color_model() == Some(ColorModel::ETC1S);
    if is_basis {
        // The levels' own lengths are checked before anything is allocated for them.
        let header = super::header(TexelFormat::Bc7, size, levels)?;
        for (number, stored) in (0..)
            .zip(reader.levels())
            .take(header.stored.levels as usize)
        {
            let most = level_bytes(TexelFormat::Bc7, level_size(size, number)) as u64;
            if stored.uncompressed_byte_length > most {
                return Err((
                    format!("at most {most} bytes in level {number}"),
                    format!("{} bytes", stored.uncompressed_byte_length),
                ));
            }
        }
        let format = basis::format(bytes)?;
        let header = super::header(format, size, levels)?;
        return Ok((header, Payload::Basis));
    }
    let named = of.format;
    let format = named
        .and_then(format)
        .ok_or_else(|| fault(named.map_or("no format".to_owned(), |f| format!("{f:?}"))))?;
    let payload = match of.supercompression_scheme {
        None => Payload::Plain,
        Some(Scheme::Zstandard) => Payload::Zstd,
        Some(other) => return Err(fault(format!("supercompression {other:?}"))),
    };
    Ok((super::header(format, size, levels)?, payload))
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
        Format::R8G8B8A8_UNORM | Format::R8G8B8A8_SRGB => TexelFormat::Rgba8,
        _ => return None,
    })
}

fn blocks(bytes: &[u8]) -> Result<Blocks, Fault> {
    let (header, payload) = read(bytes)?;
    let format = header.stored.format;
    if let Payload::Basis = payload {
        return basis::blocks(bytes, &header);
    }
    let reader = Reader::new(bytes).map_err(|e| fault(e.to_string()))?;
    let stored = (0..)
        .zip(reader.levels())
        .take(header.stored.levels as usize);
    let levels = stored.map(|(number, stored)| match payload {
        Payload::Zstd => {
            let needed = level_bytes(format, level_size(header.size, number));
            level(&header, number, &inflate(number, stored.data, needed)?)
        }
        _ => level(&header, number, stored.data),
    });
    Ok(Blocks {
        format,
        levels: levels.collect::<Result<_, _>>()?,
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
