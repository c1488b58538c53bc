//! The tiles of both kinds of trace. They fill one chunk in the order of an index. Each tile has its own
//! checksum, so that it can be read alone.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use crate::container::{ChunkTag, Container};
use crate::error::{Place, Result};
use crate::parse::{Parsed, parse_all};
use nom::Parser;
use nom::number::complete::{le_u32, le_u64};

/// Position of a tile: the first 16 bytes of every index entry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileSpan {
    /// Offset in the chunk of tiles.
    pub offset: u64,
    /// Encoded size.
    pub bytes: u32,
    /// CRC-32 of the encoded bytes.
    pub crc32: u32,
}

impl TileSpan {
    /// Appends the span.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.offset.to_le_bytes());
        out.extend(self.bytes.to_le_bytes());
        out.extend(self.crc32.to_le_bytes());
    }

    /// Reads a span.
    pub fn parse(input: &[u8]) -> Parsed<'_, Self> {
        let (rest, (offset, bytes, crc32)) = (le_u64, le_u32, le_u32).parse(input)?;
        Ok((
            rest,
            Self {
                offset,
                bytes,
                crc32,
            },
        ))
    }
}

/// The chunk of tiles of an open trace and its index.
#[derive(Clone, Copy, Debug)]
pub struct TileChunk<'a> {
    /// The file.
    pub container: &'a Container,
    /// Chunk of the tiles.
    pub tiles: ChunkTag,
    /// Chunk of the index.
    pub index: ChunkTag,
    /// Size of an index entry.
    pub entry_bytes: usize,
}

impl TileChunk<'_> {
    /// Checks that the tiles fill their chunk in index order without overlap or gap, and the checksums of
    /// all chunks. `spans` has every slot of the index, `None` for slots without tile.
    ///
    /// # Errors
    /// The first entry that is out of place; the first damaged tile, or else the damaged chunk.
    pub fn check(&self, spans: impl Iterator<Item = Option<TileSpan>> + Clone) -> Result<()> {
        let Self {
            container, index, ..
        } = *self;
        let chunk_bytes = container.entry(self.tiles)?.length_bytes;
        let mut end = 0u64;
        for (slot, span) in spans.clone().enumerate() {
            let Some(span) = span else { continue };
            let at = (slot * self.entry_bytes) as u64;
            if span.offset != end {
                let expected = format!("offset {end}");
                return Err(container.malformed(index, at, expected, span.offset));
            }
            end = end.saturating_add(span.bytes.into());
            if end > chunk_bytes {
                let expected = format!("a tile that ends by byte {chunk_bytes} of its chunk");
                return Err(container.malformed(index, at + 8, expected, end));
            }
        }
        if end != chunk_bytes {
            let expected = format!("tiles that fill {chunk_bytes} bytes");
            let found = format!("{end} bytes of tiles");
            return Err(container.malformed(index, 0, expected, found));
        }
        if container.chunk(self.tiles).is_err() {
            // The tiles' checksums are checked first, because they locate damage more precisely.
            for span in spans.flatten() {
                self.bytes(&span)?;
            }
        }
        container.check_chunks()
    }

    /// The bytes of a tile.
    ///
    /// # Errors
    /// The bytes are damaged.
    fn bytes(&self, span: &TileSpan) -> Result<&[u8]> {
        let chunk = self.container.chunk_unchecked(self.tiles)?;
        // The index was checked against the chunk when the file was opened.
        let bytes = usize::try_from(span.offset)
            .ok()
            .and_then(|at| chunk.get(at..at.checked_add(span.bytes as usize)?))
            .unwrap_or_default();
        let crc32 = crc32fast::hash(bytes);
        if crc32 == span.crc32 {
            return Ok(bytes);
        }
        let expected = format!("a tile with CRC-32 {:08x}", span.crc32);
        let found = format!("{crc32:08x}");
        Err(self
            .container
            .malformed(self.tiles, span.offset, expected, found))
    }

    /// Runs a parser over a complete tile.
    ///
    /// # Errors
    /// The tile is damaged, or rejected by the parser; the error names the byte.
    pub fn parse<T>(
        &self,
        span: &TileSpan,
        parser: impl for<'b> FnOnce(&'b [u8]) -> Parsed<'b, T>,
    ) -> Result<T> {
        let bytes = self.bytes(span)?;
        let start = self.container.entry(self.tiles)?.offset_bytes;
        let at = start.saturating_add(span.offset);
        let place = Place::Chunk(self.tiles);
        parse_all(self.container.file(), place, at, bytes, parser)
    }
}
