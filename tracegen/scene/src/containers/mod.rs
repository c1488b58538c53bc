//! Image files that hold compressed blocks: one module and one row per format.

mod basis;
mod dds;
mod ktx2;

use crate::blocks::{Blocks, StoredBlocks, level_bytes, level_size, whole_chain};
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

/// Checks sizes and levels. Levels beyond a whole chain are ignored.
fn header(format: TexelFormat, size: [u32; 2], levels: u32) -> Result<Header, Fault> {
    if !size.iter().all(|extent| (1..=MAX_SIZE).contains(extent)) {
        let [width, height] = size;
        return Err((
            format!("a size from 1x1 to {MAX_SIZE}x{MAX_SIZE}"),
            format!("{width}x{height}"),
        ));
    }
    Ok(Header {
        size,
        stored: StoredBlocks {
            format,
            levels: levels.clamp(1, whole_chain(size)),
        },
    })
}

/// Returns exactly the bytes of a level from the bytes stored for it.
fn level(header: &Header, level: u32, bytes: &[u8]) -> Result<Vec<u8>, Fault> {
    let size = level_size(header.size, level);
    let needed = level_bytes(header.stored.format, size);
    bytes.get(..needed).map(<[u8]>::to_vec).ok_or_else(|| {
        let [width, height] = size;
        (
            format!("{needed} bytes in level {level} of {width}x{height}"),
            format!("{} bytes", bytes.len()),
        )
    })
}
