//! DDS: levels one after the other behind the header.

use super::{Fault, Header, Kind, level};
use crate::blocks::{Blocks, level_bytes, level_size};
use ddsfile::{D3DFormat, Dds, DxgiFormat};
use formats::texture::TexelFormat;

pub(super) const KIND: Kind = Kind {
    name: "DDS",
    magic: b"DDS ",
    header: |bytes| read(bytes).map(|(header, _)| header),
    blocks,
};

/// Header and position of the first level.
fn read(bytes: &[u8]) -> Result<(Header, usize), Fault> {
    let fault = |found: String| ("a DDS image of BC1 to BC7".to_owned(), found);
    // Pass only the headers, because the crate copies everything after them.
    let start = &bytes[..bytes.len().min(HEADERS_BYTES)];
    let dds = Dds::read(start).map_err(|e| fault(e.to_string()))?;
    let format = format(&dds).ok_or_else(|| {
        let named = (dds.get_dxgi_format().map(|f| format!("{f:?}")))
            .or_else(|| dds.get_d3d_format().map(|f| format!("{f:?}")));
        fault(named.unwrap_or_else(|| "an unknown pixel format".to_owned()))
    })?;
    if dds.get_depth() > 1 || dds.get_num_array_layers() != 1 {
        return Err((
            "a two-dimensional image".to_owned(),
            "a volume, a cube map or an array".to_owned(),
        ));
    }
    let header = super::header(
        format,
        [dds.get_width(), dds.get_height()],
        dds.get_num_mipmap_levels(),
    )?;
    let data = if dds.header10.is_some() { 148 } else { 128 };
    Ok((header, data))
}

/// Bytes of the magic number, the header and the DirectX 10 header.
const HEADERS_BYTES: usize = 148;

fn format(dds: &Dds) -> Option<TexelFormat> {
    use DxgiFormat::{
        BC1_Typeless, BC1_UNorm, BC1_UNorm_sRGB, BC2_Typeless, BC2_UNorm, BC2_UNorm_sRGB,
        BC3_Typeless, BC3_UNorm, BC3_UNorm_sRGB, BC4_Typeless, BC4_UNorm, BC5_Typeless, BC5_UNorm,
        BC6H_Typeless, BC6H_UF16, BC7_Typeless, BC7_UNorm, BC7_UNorm_sRGB,
    };
    let by_dxgi = dds.get_dxgi_format().and_then(|format| match format {
        BC1_Typeless | BC1_UNorm | BC1_UNorm_sRGB => Some(TexelFormat::Bc1),
        BC2_Typeless | BC2_UNorm | BC2_UNorm_sRGB => Some(TexelFormat::Bc2),
        BC3_Typeless | BC3_UNorm | BC3_UNorm_sRGB => Some(TexelFormat::Bc3),
        BC4_Typeless | BC4_UNorm => Some(TexelFormat::Bc4),
        BC5_Typeless | BC5_UNorm => Some(TexelFormat::Bc5),
        BC6H_Typeless | BC6H_UF16 => Some(TexelFormat::Bc6h),
        BC7_Typeless | BC7_UNorm | BC7_UNorm_sRGB => Some(TexelFormat::Bc7),
        _ => None,
    });
    let by_d3d = || match dds.get_d3d_format()? {
        D3DFormat::DXT1 => Some(TexelFormat::Bc1),
        D3DFormat::DXT2 | D3DFormat::DXT3 => Some(TexelFormat::Bc2),
        D3DFormat::DXT4 | D3DFormat::DXT5 => Some(TexelFormat::Bc3),
        _ => None,
    };
    by_dxgi.or_else(by_d3d)
}

fn blocks(bytes: &[u8]) -> Result<Blocks, Fault> {
    let (header, mut at) = read(bytes)?;
    let format = header.stored.format;
    let mut levels = Vec::new();
    for number in 0..header.stored.levels {
        levels.push(level(&header, number, bytes.get(at..).unwrap_or_default())?);
        at += level_bytes(format, level_size(header.size, number));
    }
    Ok(Blocks { format, levels })
}
