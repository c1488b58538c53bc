//! Byte layout of the header and of the directory.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{ChunkEntry, Kind, MAGIC, MAJOR_1, MAJOR_5};
use crate::error::Result;
use crate::parse::{Cursor, Parsed, Taken};
use crate::records::{self, Codec, Record};

/// Size of the header.
pub const HEADER_BYTES: usize = 48;
/// Size of one directory entry.
pub const DIRECTORY_ENTRY_BYTES: usize = 24;
/// Number of header bytes that its CRC covers: all bytes before it.
const HEADER_CRC_OFFSET: usize = HEADER_BYTES - 4;

/// Variable fields of the header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Header {
    pub version_major: u16,
    pub version_minor: u16,
    pub kind: Kind,
    pub directory_offset: u64,
    pub file_bytes: u64,
    pub directory_count: u32,
    pub directory_crc32: u32,
}

const KINDS: &[(u16, Kind)] = &[(1, Kind::Textrace), (2, Kind::Raytrace)];

/// What to do with a file that is not a trace.
fn hint(magic: &[u8]) -> &'static str {
    match magic.starts_with(b"glTF") {
        true => ", which begins a scene; capture it first: tracegen raster SCENE -o FILE.textrace",
        false => "",
    }
}

impl Record for Header {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "a header of 48 bytes";
        let mut magic = MAGIC;
        codec.number(&mut magic)?;
        codec.number(&mut self.version_major)?;
        codec.number(&mut self.version_minor)?;
        codec.id("kind 1 (textrace) or 2 (raytrace)", KINDS, &mut self.kind)?;
        codec.reserved::<2>()?;
        codec.number(&mut self.directory_offset)?;
        codec.number(&mut self.file_bytes)?;
        codec.number(&mut self.directory_count)?;
        codec.number(&mut self.directory_crc32)?;
        codec.reserved::<4>()
    }
}

impl Header {
    pub(super) fn to_bytes(self) -> Result<Vec<u8>> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES);
        records::write(self.version_major, &self, &mut bytes)?;
        let crc32 = crc32fast::hash(&bytes);
        bytes.extend(crc32.to_le_bytes());
        Ok(bytes)
    }

    /// Parses the header at the start of a file.
    pub(super) fn parse(file: &[u8]) -> Parsed<'_, Self> {
        let start = Cursor::new(file);
        let mut input = start;
        let magic = input.bytes("the magic PLXTRACE", MAGIC.len())?;
        let found = format_args!("\"{}\"{}", magic.escape_ascii(), hint(magic));
        start.check(magic == MAGIC, "the magic PLXTRACE", found)?;
        let at_version = input;
        let major: u16 = input.fixed("a major version")?;
        let expected = format_args!("a major version from {MAJOR_1} to {MAJOR_5}");
        at_version.check((MAJOR_1..=MAJOR_5).contains(&major), expected, major)?;
        // The checksum is checked before all other fields, so that the error says that the header is
        // damaged.
        let mut end = start;
        let crc32 = crc32fast::hash(end.bytes("a header of 48 bytes", HEADER_CRC_OFFSET)?);
        let at_crc32 = end;
        let stored: u32 = end.fixed("the header's CRC-32")?;
        let expected = format_args!("CRC-32 {crc32:08x}");
        at_crc32.check(stored == crc32, expected, format_args!("{stored:08x}"))?;
        let (_, header): (_, Self) = records::parse(major, file)?;
        at_version.check(
            major == MAJOR_1 || header.kind == Kind::Textrace,
            format_args!("major version {MAJOR_1} of a {}", header.kind),
            major,
        )?;
        Ok((end.rest(), header))
    }
}

impl Record for ChunkEntry {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "a directory entry of 24 bytes";
        codec.number(&mut self.tag.0)?;
        codec.number(&mut self.crc32)?;
        codec.number(&mut self.offset_bytes)?;
        codec.number(&mut self.length_bytes)
    }
}
