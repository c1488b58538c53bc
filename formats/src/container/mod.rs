//! The container format of all trace files: a header, chunks, and a directory of the chunks.
//!
//! The directory is at the end, so that chunks can be streamed; the header is written last and points at
//! it. Header, directory and every chunk have a CRC-32, and the bytes between chunks must be zero, so every
//! flipped bit is detected. FORMAT.md has the byte layout.

mod atomic;
mod header;
mod inputs;
mod reader;
mod regular;
mod scratch;
mod writer;

pub use crate::chunk_tag::ChunkTag;
pub(crate) use atomic::folder_of;
pub use atomic::{
    AtomicFile, check_target, discard_unfinished, is_stdout, kind_of, remove_abandoned,
};
pub use header::{DIRECTORY_ENTRY_BYTES, HEADER_BYTES};
pub use inputs::{declare_input, declared_inputs, input_in, is_same_file, replaced_input};
pub use reader::Container;
pub use regular::{check_regular, checksum, open_regular, read_regular};
pub use scratch::ScratchFolder;
pub use writer::ContainerWriter;

use std::fmt;

/// First eight bytes of every trace file.
pub const MAGIC: [u8; 8] = *b"PLXTRACE";
/// Latest minor version of each major version that readers support. A file declares the earliest version that
/// has all of its features. Readers accept a later minor version, which may only add features, and refuse
/// another major version.
pub const VERSIONS: [(u16, u16); 5] = [(1, 6), (2, 1), (3, 1), (4, 0), (5, 1)];
/// Major version of traces of scenes.
pub(crate) const MAJOR_1: u16 = 1;
/// Major version of `.textrace` files whose tables come after the tiles: traces of programs.
pub(crate) const MAJOR_2: u16 = 2;
/// Major version of those with anisotropic samplers or textures that share memory.
pub(crate) const MAJOR_3: u16 = 3;
/// Major versions of `.textrace` files that store equal tiles once, with the tables of version 1 and of version 3.
pub(crate) const MAJOR_4: u16 = 4;
/// See [`MAJOR_4`].
pub(crate) const MAJOR_5: u16 = 5;

/// The major version whose tables a file has.
pub(crate) const fn major_of_tables(major: u16) -> u16 {
    match major {
        MAJOR_4 => MAJOR_1,
        MAJOR_5 => MAJOR_3,
        other => other,
    }
}
/// Chunks start at multiples of this many bytes.
pub const CHUNK_ALIGNMENT_BYTES: u64 = 8;

/// Kinds of trace files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Texture addresses (`.textrace`).
    #[default]
    Textrace,
    /// Rays (`.raytrace`).
    Raytrace,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Textrace => "textrace",
            Self::Raytrace => "raytrace",
        })
    }
}

/// One entry of the chunk directory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChunkEntry {
    /// Name, unique in the file.
    pub tag: ChunkTag,
    /// CRC-32 of the chunk's bytes.
    pub crc32: u32,
    /// Offset from the start of the file.
    pub offset_bytes: u64,
    /// Length without padding.
    pub length_bytes: u64,
}

#[cfg(test)]
mod tests;
