//! The tiles of both kinds of trace. They fill one chunk in the order of an index. Each tile has its own
//! checksum, so that it can be read alone.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use crate::container::{ChunkTag, Container, ContainerWriter};
use crate::error::{Broken, FormatError, Place, Result};
use crate::parse::{Parsed, Taken, parse_all};
use crate::records::{Codec, Record, parse_records};
use std::io::{Read, Seek, Write};
use tempfile::SpooledTempFile;

/// Position of a tile: the first 16 bytes of every index entry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct TileSpan {
    /// Offset in the chunk of tiles.
    pub offset: u64,
    /// Encoded size.
    pub bytes: u32,
    /// CRC-32 of the encoded bytes.
    pub crc32: u32,
}

impl Record for TileSpan {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.number(&mut self.offset)?;
        codec.number(&mut self.bytes)?;
        codec.number(&mut self.crc32)
    }
}

/// The chunk of tiles of a trace and its index.
#[derive(Clone, Copy, Debug)]
pub struct TileChunk {
    /// Chunk of the tiles.
    pub tiles: ChunkTag,
    /// Chunk of the index.
    pub index: ChunkTag,
    /// Size of an index entry.
    pub entry_bytes: usize,
}

impl TileChunk {
    /// Reads an index that has an entry for each of `slots` tiles.
    ///
    /// # Errors
    /// The chunk is missing, damaged or of another size, or an entry is malformed.
    pub fn read_index<T: Record>(&self, container: &Container, slots: u64) -> Result<Vec<T>> {
        self.read_index_from(container, 0, slots)
    }

    /// Reads an index whose entries start at byte `first`.
    ///
    /// # Errors
    /// See [`Self::read_index`].
    pub fn read_index_from<T: Record>(
        &self,
        container: &Container,
        first: usize,
        slots: u64,
    ) -> Result<Vec<T>> {
        let bytes = container.chunk(self.index)?.len() as u64;
        let entries = slots.checked_mul(self.entry_bytes as u64);
        if entries.and_then(|entries| entries.checked_add(first as u64)) != Some(bytes) {
            let each = self.entry_bytes;
            let expected = match first {
                0 => format!("{each} bytes for each of {slots} tiles"),
                _ => format!("{first} bytes and {each} for each of {slots} tiles"),
            };
            return Err(container.malformed(self.index, 0, expected, format!("{bytes} bytes")));
        }
        let (major, _) = container.version();
        container.parse_chunk(self.index, |input| {
            parse_records(major, input.get(first..).unwrap_or_default())
        })
    }

    /// Checks that the tiles fill their chunk in index order without overlap or gap, and the checksums of
    /// all chunks. `spans` has every slot of the index, `None` for slots without tile.
    ///
    /// # Errors
    /// The first entry that is out of place; the first damaged tile, or else the damaged chunk.
    pub fn check(
        &self,
        container: &Container,
        spans: impl Iterator<Item = Option<TileSpan>> + Clone,
    ) -> Result<()> {
        let at_end = |_: usize, span: TileSpan, end: u64| match span.offset == end {
            true => Ok(true),
            false => Err(format!("offset {end}")),
        };
        self.check_each(container, spans, 0, at_end)
    }

    /// Checks an index in which an entry may be that of an earlier tile, whose bytes it shares; else as
    /// [`Self::check`]. `span` is that of an entry, `None` for a slot without tile. The entries start at byte
    /// `first` of the index.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn check_shared<T: PartialEq>(
        &self,
        container: &Container,
        entries: &[T],
        first: u64,
        span: impl Fn(&T) -> Option<TileSpan> + Clone,
    ) -> Result<()> {
        // Slots of the stored tiles, by ascending offset.
        let mut stored: Vec<(u64, usize)> = Vec::new();
        let new_or_stored = |slot: usize, span: TileSpan, end: u64| {
            if span.offset == end {
                stored.push((end, slot));
                return Ok(true);
            }
            let found = stored.binary_search_by_key(&span.offset, |(offset, _)| *offset);
            let earlier = found.ok().and_then(|found| stored.get(found));
            match earlier.is_some_and(|(_, earlier)| entries.get(*earlier) == entries.get(slot)) {
                true => Ok(false),
                false => Err(format!(
                    "offset {end} or the whole entry of an earlier tile"
                )),
            }
        };
        self.check_each(container, entries.iter().map(span), first, new_or_stored)
    }

    /// Checks each span. `place` says whether a tile lies at the end of those before it or shares the bytes of
    /// one of them, or what was expected.
    fn check_each(
        &self,
        container: &Container,
        spans: impl Iterator<Item = Option<TileSpan>> + Clone,
        first: u64,
        mut place: impl FnMut(usize, TileSpan, u64) -> Result<bool, String>,
    ) -> Result<()> {
        let index = self.index;
        let chunk_bytes = container.entry(self.tiles)?.length_bytes;
        let mut end = 0u64;
        for (slot, span) in spans.clone().enumerate() {
            let Some(span) = span else { continue };
            let at = first + (slot * self.entry_bytes) as u64;
            match place(slot, span, end) {
                Ok(true) => (),
                Ok(false) => continue,
                Err(expected) => {
                    return Err(container.malformed(index, at, expected, span.offset));
                }
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
                self.bytes(container, &span)?;
            }
        }
        container.check_chunks()
    }

    /// The bytes of a tile, unchecked.
    pub fn stored<'a>(&self, container: &'a Container, span: &TileSpan) -> &'a [u8] {
        let chunk = container.chunk_unchecked(self.tiles).unwrap_or_default();
        // The index was checked against the chunk when the file was opened.
        usize::try_from(span.offset)
            .ok()
            .and_then(|at| chunk.get(at..at.checked_add(span.bytes as usize)?))
            .unwrap_or_default()
    }

    /// The bytes of a tile.
    ///
    /// # Errors
    /// The bytes are damaged.
    fn bytes<'a>(&self, container: &'a Container, span: &TileSpan) -> Result<&'a [u8]> {
        let bytes = self.stored(container, span);
        let crc32 = crc32fast::hash(bytes);
        if crc32 == span.crc32 {
            return Ok(bytes);
        }
        let expected = format!("a tile with CRC-32 {:08x}", span.crc32);
        let found = format!("{crc32:08x}");
        Err(container.malformed(self.tiles, span.offset, expected, found))
    }

    /// Runs a parser over a complete tile.
    ///
    /// # Errors
    /// The tile is damaged, or rejected by the parser; the error names the byte.
    pub fn parse<T>(
        &self,
        container: &Container,
        span: &TileSpan,
        parser: impl for<'b> FnOnce(&'b [u8]) -> Parsed<'b, T>,
    ) -> Result<T> {
        let bytes = self.bytes(container, span)?;
        let start = container.entry(self.tiles)?.offset_bytes;
        let at = start.saturating_add(span.offset);
        let place = Place::Chunk(self.tiles);
        parse_all(container.file(), place, at, bytes, parser)
    }
}

/// Tiles in a temporary file, because only one chunk can be written at a time.
#[derive(Debug)]
pub struct TileSpool {
    file: SpooledTempFile,
    end: u64,
}

impl TileSpool {
    /// Size of the tiles in memory before they are moved to the file.
    pub const IN_MEMORY_BYTES: usize = 64 << 20;

    /// Starts with an empty file.
    pub fn new(file: SpooledTempFile) -> Self {
        Self { file, end: 0 }
    }

    /// Appends a tile; `what` names it in errors.
    ///
    /// # Errors
    /// The tile is too large, or the file cannot be written.
    pub fn append(&mut self, what: &str, tile: &[u8]) -> Result<TileSpan> {
        let span = TileSpan {
            offset: self.end,
            bytes: size_u32(what, tile.len())?,
            crc32: crc32fast::hash(tile),
        };
        let written = self.file.write_all(tile);
        written.map_err(|source| FormatError::io("temporary file", "write", source))?;
        self.end += u64::from(span.bytes);
        Ok(span)
    }

    /// Writes the tiles as a chunk.
    ///
    /// # Errors
    /// The file cannot be read, or the chunk cannot be written.
    pub fn write<W: Write + Seek>(
        &mut self,
        tag: ChunkTag,
        container: &mut ContainerWriter<W>,
    ) -> Result<()> {
        let failed = |source| FormatError::io("temporary file", "read", source);
        self.file.rewind().map_err(failed)?;
        container.begin_chunk(tag)?;
        let mut buffer = vec![0; 1 << 16];
        loop {
            let count = self.file.read(&mut buffer).map_err(failed)?;
            match buffer.get(..count) {
                Some(read) if count > 0 => container.append(read)?,
                _ => return container.end_chunk(),
            }
        }
    }
}

/// A size in the four bytes of an index entry.
///
/// # Errors
/// It does not fit.
pub fn size_u32(what: &str, bytes: usize) -> Result<u32> {
    let too_large = |_| Broken::new(what, "less than 2^32 bytes", bytes).unwritable();
    u32::try_from(bytes).map_err(too_large)
}
