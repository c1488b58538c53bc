//! Image files that hold texels as texture units read them: one module and one row per format.

#[cfg(feature = "basis")]
mod basis;
#[cfg(not(feature = "basis"))]
#[path = "no_basis.rs"]
mod basis;
mod dds;
mod ktx2;

use crate::blocks::{Blocks, StoredBlocks, level_bytes, level_size, whole_chain};
use crate::channels::Packed;
use crate::image_files::MAX_SIZE;
use formats::texture::TexelFormat;

/// A fault in a file: what was expected and what was found.
pub(crate) type Fault = (String, String);

/// A file format.
pub(crate) struct Kind {
    /// Name of the format.
    pub name: &'static str,
    /// First bytes of a file of this format.
    magic: &'static [u8],
    /// Reads the header.
    pub header: fn(&[u8]) -> Result<Header, Fault>,
    /// Reads the levels of a file whose header is valid.
    pub blocks: fn(&[u8]) -> Result<Blocks, Fault>,
}

/// Contents of a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    /// Size of level 0 in texels.
    pub size: [u32; 2],
    /// Format and number of the stored levels.
    pub stored: StoredBlocks,
}

const KINDS: [Kind; 2] = [ktx2::KIND, dds::KIND];

/// The format of a file, found by its first bytes.
pub(crate) fn of(bytes: &[u8]) -> Option<&'static Kind> {
    static ALL: [Kind; 2] = KINDS;
    ALL.iter().find(|kind| bytes.starts_with(kind.magic))
}

/// How a file lays its texels out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Texels {
    /// As the texture has them.
    Own,
    /// Otherwise; the levels are decoded.
    Packed(Packed),
}

/// Checks sizes and levels. Levels beyond a whole chain are ignored; no level asks for a whole chain
/// made from level 0.
fn header(format: TexelFormat, size: [u32; 2], levels: u32) -> Result<Header, Fault> {
    if !size.iter().all(|extent| (1..=MAX_SIZE).contains(extent)) {
        let [width, height] = size;
        return Err((
            format!("a size from 1x1 to {MAX_SIZE}x{MAX_SIZE}"),
            format!("{width}x{height}"),
        ));
    }
    let whole = whole_chain(size);
    Ok(Header {
        size,
        stored: StoredBlocks {
            format,
            levels: if levels == 0 {
                whole
            } else {
                levels.min(whole)
            },
            held: levels.clamp(1, whole),
        },
    })
}

/// The levels of a file from the bytes that begin with each of them, and the format they are in.
fn levels<'a>(
    header: &Header,
    texels: Texels,
    bytes: impl Fn(u32, usize) -> Result<std::borrow::Cow<'a, [u8]>, Fault>,
) -> Result<(TexelFormat, Vec<Vec<u8>>), Fault> {
    let format = header.stored.format;
    let held = match texels {
        Texels::Own => format,
        Texels::Packed(_) => TexelFormat::Rgba8,
    };
    let levels = (0..header.stored.held).map(|number| {
        let needed = needed_bytes(header, number, texels);
        let stored = level(header, number, needed, &bytes(number, needed)?)?;
        Ok(match texels {
            Texels::Own => stored,
            Texels::Packed(packed) => packed.decode(&stored),
        })
    });
    Ok((held, levels.collect::<Result<_, Fault>>()?))
}

/// Bytes of a level in a file.
fn needed_bytes(header: &Header, number: u32, texels: Texels) -> usize {
    let size = level_size(header.size, number);
    match texels {
        Texels::Own => level_bytes(header.stored.format, size),
        Texels::Packed(packed) => size[0] as usize * size[1] as usize * packed.bytes as usize,
    }
}

/// Returns exactly the needed bytes of a level from the bytes stored for it.
fn level(header: &Header, level: u32, needed: usize, bytes: &[u8]) -> Result<Vec<u8>, Fault> {
    bytes.get(..needed).map(<[u8]>::to_vec).ok_or_else(|| {
        let [width, height] = level_size(header.size, level);
        (
            format!("{needed} bytes in level {level} of {width}x{height}"),
            format!("{} bytes", bytes.len()),
        )
    })
}
