//! Byte layout of the header and of the directory.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{ChunkEntry, ChunkTag, Kind, MAGIC, MAJOR_1, MAJOR_3};
use crate::parse::{Fault, Parsed, ensure, zero};
use nom::Parser;
use nom::bytes::complete::take;
use nom::error::context;
use nom::multi::count;
use nom::number::complete::{le_u16, le_u32, le_u64};

/// Size of the header.
pub const HEADER_BYTES: usize = 48;
/// Size of one directory entry.
pub const DIRECTORY_ENTRY_BYTES: usize = 24;
/// Number of header bytes that its CRC covers: all bytes before it.
const HEADER_CRC_OFFSET: usize = HEADER_BYTES - 4;

/// Variable fields of the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub version_major: u16,
    pub version_minor: u16,
    pub kind: Kind,
    pub directory_offset: u64,
    pub file_bytes: u64,
    pub directory_count: u32,
    pub directory_crc32: u32,
}

/// What to do with a file that is not a trace.
fn hint(magic: &[u8]) -> &'static str {
    match magic.starts_with(b"glTF") {
        true => ", which begins a scene; capture it first: tracegen raster SCENE -o FILE.textrace",
        false => "",
    }
}

impl Header {
    pub(super) fn new(kind: Kind) -> Self {
        Self {
            version_major: MAJOR_1,
            version_minor: 0,
            kind,
            directory_offset: 0,
            file_bytes: 0,
            directory_count: 0,
            directory_crc32: 0,
        }
    }

    pub(super) fn to_bytes(self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES);
        bytes.extend(MAGIC);
        bytes.extend(self.version_major.to_le_bytes());
        bytes.extend(self.version_minor.to_le_bytes());
        bytes.extend((self.kind as u16).to_le_bytes());
        bytes.extend(0u16.to_le_bytes());
        bytes.extend(self.directory_offset.to_le_bytes());
        bytes.extend(self.file_bytes.to_le_bytes());
        bytes.extend(self.directory_count.to_le_bytes());
        bytes.extend(self.directory_crc32.to_le_bytes());
        bytes.extend(0u32.to_le_bytes());
        let crc32 = crc32fast::hash(&bytes);
        bytes.extend(crc32.to_le_bytes());
        bytes
    }

    /// Parses the header at the start of a file.
    pub(super) fn parse(file: &[u8]) -> Parsed<'_, Self> {
        let (rest, magic) = context("the magic PLXTRACE", take(MAGIC.len())).parse(file)?;
        ensure(
            file,
            magic == MAGIC,
            || "the magic PLXTRACE".to_owned(),
            format_args!("\"{}\"{}", magic.escape_ascii(), hint(magic)),
        )?;
        let at_version = rest;
        let (rest, version_major) = context("a major version", le_u16).parse(rest)?;
        ensure(
            at_version,
            (MAJOR_1..=MAJOR_3).contains(&version_major),
            || format!("a major version from {MAJOR_1} to {MAJOR_3}"),
            version_major,
        )?;
        // The checksum is checked before all other fields, so that the error says that the header is
        // damaged.
        let (_, body) = context("a header of 48 bytes", take(HEADER_CRC_OFFSET)).parse(file)?;
        let (after_body, _) = take(HEADER_CRC_OFFSET).parse(file)?;
        let (_, stored_crc32) = context("the header's CRC-32", le_u32).parse(after_body)?;
        let crc32 = crc32fast::hash(body);
        ensure(
            after_body,
            stored_crc32 == crc32,
            || format!("CRC-32 {crc32:08x}"),
            format_args!("{stored_crc32:08x}"),
        )?;
        let (rest, version_minor) = le_u16.parse(rest)?;
        let at_kind = rest;
        let (rest, kind_id) = le_u16.parse(rest)?;
        let kind = Kind::from_id(kind_id).ok_or_else(|| {
            let expected = "kind 1 (textrace) or 2 (raytrace)";
            nom::Err::Failure(Fault::new(at_kind, expected, kind_id))
        })?;
        ensure(
            at_version,
            version_major == MAJOR_1 || kind == Kind::Textrace,
            || format!("major version {MAJOR_1} of a {kind}"),
            version_major,
        )?;
        let (rest, ()) = zero(rest, 2)?;
        let (rest, (directory_offset, file_bytes, directory_count, directory_crc32)) =
            (le_u64, le_u64, le_u32, le_u32).parse(rest)?;
        let (rest, ()) = zero(rest, 4)?;
        let (rest, _) = le_u32.parse(rest)?;
        Ok((
            rest,
            Self {
                version_major,
                version_minor,
                kind,
                directory_offset,
                file_bytes,
                directory_count,
                directory_crc32,
            },
        ))
    }
}

impl ChunkEntry {
    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        bytes.extend(self.tag.0);
        bytes.extend(self.crc32.to_le_bytes());
        bytes.extend(self.offset_bytes.to_le_bytes());
        bytes.extend(self.length_bytes.to_le_bytes());
    }

    fn parse(input: &[u8]) -> Parsed<'_, Self> {
        let (rest, (tag, crc32, offset_bytes, length_bytes)) =
            (le_u32, le_u32, le_u64, le_u64).parse(input)?;
        Ok((
            rest,
            Self {
                tag: ChunkTag(tag.to_le_bytes()),
                crc32,
                offset_bytes,
                length_bytes,
            },
        ))
    }

    /// Parses a directory of `entries` entries.
    pub(super) fn parse_directory(entries: usize, input: &[u8]) -> Parsed<'_, Vec<Self>> {
        context("a directory entry of 24 bytes", count(Self::parse, entries)).parse(input)
    }
}
