//! DDS: levels one after the other behind the header.

use super::{Fault, Header, Kind, Texels, levels, needed_bytes};
use crate::blocks::Blocks;
use crate::channels::{Channel, Packed, View};
use ddsfile::{Dds, DxgiFormat};
use formats::texture::TexelFormat;
use std::borrow::Cow;

pub(super) const KIND: Kind = Kind {
    name: "DDS",
    magic: b"DDS ",
    header: |bytes| read(bytes).map(|file| file.header),
    blocks,
};

/// A file whose header is valid.
struct File {
    header: Header,
    pixels: Pixels,
    /// Position of the first level.
    data: usize,
}

/// A pixel format.
#[derive(Clone, Copy)]
struct Pixels {
    /// Format of the texture.
    format: TexelFormat,
    texels: Texels,
    view: View,
}

fn read(bytes: &[u8]) -> Result<File, Fault> {
    let fault = |found: String| {
        let expected = "a DDS image of BC1 to BC7, or one to four channels of at most 8 bits";
        (expected.to_owned(), found)
    };
    // Pass only the headers, because the crate copies everything after them.
    let start = &bytes[..bytes.len().min(HEADERS_BYTES)];
    let dds = Dds::read(start).map_err(|e| fault(e.to_string()))?;
    let named = match (&dds.header10, &dds.header.spf.fourcc) {
        (Some(extended), _) => of_dxgi(extended.dxgi_format)
            .ok_or_else(|| fault(format!("{:?}", extended.dxgi_format))),
        (None, Some(code)) => {
            let code = code.0.to_le_bytes();
            of_code(code)
                .ok_or_else(|| fault(format!("the code '{}'", String::from_utf8_lossy(&code))))
        }
        (None, None) => of_masks(start).map_err(fault),
    };
    let pixels = named?;
    if dds.get_depth() > 1 || dds.get_num_array_layers() != 1 {
        return Err((
            "a two-dimensional image".to_owned(),
            "a volume, a cube map or an array".to_owned(),
        ));
    }
    Ok(File {
        header: super::header(
            pixels.format,
            [dds.get_width(), dds.get_height()],
            // A file without levels of detail has 0 or 1.
            dds.get_num_mipmap_levels().max(1),
        )?,
        pixels,
        data: if dds.header10.is_some() { 148 } else { 128 },
    })
}

/// Bytes of the magic number, the header and the DirectX 10 header.
const HEADERS_BYTES: usize = 148;

fn own(format: TexelFormat) -> Pixels {
    Pixels {
        format,
        texels: Texels::Own,
        view: View::default(),
    }
}

fn packed(format: TexelFormat, packed: Packed) -> Pixels {
    Pixels {
        format,
        texels: Texels::Packed(packed),
        view: View::default(),
    }
}

/// Formats of DirectX 10 and later.
fn of_dxgi(format: DxgiFormat) -> Option<Pixels> {
    use DxgiFormat::{
        A8_UNorm, B4G4R4A4_UNorm, B5G5R5A1_UNorm, B5G6R5_UNorm, B8G8R8A8_Typeless, B8G8R8A8_UNorm,
        B8G8R8A8_UNorm_sRGB, B8G8R8X8_Typeless, B8G8R8X8_UNorm, B8G8R8X8_UNorm_sRGB, BC1_Typeless,
        BC1_UNorm, BC1_UNorm_sRGB, BC2_Typeless, BC2_UNorm, BC2_UNorm_sRGB, BC3_Typeless,
        BC3_UNorm, BC3_UNorm_sRGB, BC4_Typeless, BC4_UNorm, BC5_Typeless, BC5_UNorm, BC6H_Typeless,
        BC6H_UF16, BC7_Typeless, BC7_UNorm, BC7_UNorm_sRGB, R8_Typeless, R8_UNorm, R8G8_Typeless,
        R8G8_UNorm, R8G8B8A8_Typeless, R8G8B8A8_UNorm, R8G8B8A8_UNorm_sRGB,
    };
    let bytes = |format, order: &[u8]| packed(format, Packed::of_bytes(order));
    let two = |masks| packed(TexelFormat::Packed16, Packed { bytes: 2, masks });
    Some(match format {
        BC1_Typeless | BC1_UNorm | BC1_UNorm_sRGB => own(TexelFormat::Bc1),
        BC2_Typeless | BC2_UNorm | BC2_UNorm_sRGB => own(TexelFormat::Bc2),
        BC3_Typeless | BC3_UNorm | BC3_UNorm_sRGB => own(TexelFormat::Bc3),
        BC4_Typeless | BC4_UNorm => own(TexelFormat::Bc4),
        BC5_Typeless | BC5_UNorm => own(TexelFormat::Bc5),
        BC6H_Typeless | BC6H_UF16 => own(TexelFormat::Bc6h),
        BC7_Typeless | BC7_UNorm | BC7_UNorm_sRGB => own(TexelFormat::Bc7),
        R8G8B8A8_Typeless | R8G8B8A8_UNorm | R8G8B8A8_UNorm_sRGB => own(TexelFormat::Rgba8),
        B8G8R8A8_Typeless | B8G8R8A8_UNorm | B8G8R8A8_UNorm_sRGB => {
            bytes(TexelFormat::Rgba8, &[2, 1, 0, 3])
        }
        B8G8R8X8_Typeless | B8G8R8X8_UNorm | B8G8R8X8_UNorm_sRGB => Pixels {
            view: opaque(),
            ..bytes(TexelFormat::Rgba8, &[2, 1, 0, 3])
        },
        R8_Typeless | R8_UNorm => bytes(TexelFormat::R8, &[0]),
        R8G8_Typeless | R8G8_UNorm => bytes(TexelFormat::Rg8, &[0, 1]),
        A8_UNorm => bytes(TexelFormat::R8, &[3]),
        B5G6R5_UNorm => two([0xf800, 0x07e0, 0x001f, 0]),
        B5G5R5A1_UNorm => two([0x7c00, 0x03e0, 0x001f, 0x8000]),
        B4G4R4A4_UNorm => two([0x0f00, 0x00f0, 0x000f, 0xf000]),
        _ => return None,
    })
}

/// Formats of earlier versions that a code names.
fn of_code(code: [u8; 4]) -> Option<Pixels> {
    Some(match &code {
        b"DXT1" => own(TexelFormat::Bc1),
        b"DXT2" | b"DXT3" => own(TexelFormat::Bc2),
        b"DXT4" | b"DXT5" => own(TexelFormat::Bc3),
        b"ATI1" | b"BC4U" => own(TexelFormat::Bc4),
        b"ATI2" | b"BC5U" => own(TexelFormat::Bc5),
        _ => return None,
    })
}

/// Formats of earlier versions that masks describe; otherwise what was found.
fn of_masks(header: &[u8]) -> Result<Pixels, String> {
    const ALPHA_PIXELS: u32 = 0x1;
    const ALPHA: u32 = 0x2;
    const RGB: u32 = 0x40;
    const LUMINANCE: u32 = 0x20000;
    let word = |at: usize| {
        let four = header.get(at..).and_then(<[u8]>::first_chunk);
        four.map_or(0, |four| u32::from_le_bytes(*four))
    };
    let [flags, bits] = [word(80), word(88)];
    let found = || format!("pixels of {bits} bits, flags {flags:#x}");
    let colors = [word(92), word(96), word(100)];
    let alpha = if flags & (ALPHA_PIXELS | ALPHA) != 0 {
        word(104)
    } else {
        0
    };
    let (masks, view) = if flags & RGB != 0 {
        ([colors[0], colors[1], colors[2], alpha], View::default())
    } else if flags & LUMINANCE != 0 {
        let red = Channel::Stored(0);
        let swizzle = [red, red, red, Channel::Stored(3)];
        (
            [colors[0], 0, 0, alpha],
            View {
                swizzle,
                ..View::default()
            },
        )
    } else if flags & ALPHA != 0 {
        ([0, 0, 0, alpha], View::default())
    } else {
        return Err(found());
    };
    let is_channel = |mask: u32| {
        let width = mask.count_ones();
        width <= 8
            && mask
                .checked_shr(mask.trailing_zeros())
                .unwrap_or(0)
                .trailing_ones()
                == width
    };
    let fits = |mask: u32| bits == 32 || mask >> bits.min(31) == 0;
    let masked = masks.iter().any(|mask| *mask != 0);
    if !masked || !masks.iter().all(|&mask| is_channel(mask) && fits(mask)) {
        return Err(format!("{}, masks {masks:x?}", found()));
    }
    let format = match (bits, flags & RGB != 0) {
        (8, _) => TexelFormat::R8,
        (16, true) => TexelFormat::Packed16,
        (16, false) => TexelFormat::Rg8,
        (24 | 32, _) => TexelFormat::Rgba8,
        _ => return Err(found()),
    };
    let bytes = bits / 8;
    Ok(Pixels {
        view,
        ..packed(format, Packed { bytes, masks })
    })
}

/// Without the stored alpha.
fn opaque() -> View {
    let mut view = View::default();
    view.swizzle[3] = Channel::One;
    view
}

fn blocks(bytes: &[u8]) -> Result<Blocks, Fault> {
    let File {
        header,
        pixels,
        data,
    } = read(bytes)?;
    let start = |number: u32| {
        let before = (0..number).map(|level| needed_bytes(&header, level, pixels.texels));
        data + before.sum::<usize>()
    };
    let (held, levels) = levels(&header, pixels.texels, |number, _| {
        Ok(Cow::Borrowed(
            bytes.get(start(number)..).unwrap_or_default(),
        ))
    })?;
    Ok(Blocks {
        format: pixels.format,
        held,
        levels,
        view: pixels.view,
    })
}
