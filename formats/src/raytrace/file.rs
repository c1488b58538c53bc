//! Writing and reading a `.raytrace`: tables at once, tiles one by one from any thread.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{RayTile, RaytraceTables, codec, tables};
use crate::container::{AtomicFile, ChunkTag, Container, ContainerWriter, Kind};
use crate::error::{FormatError, Result};
use crate::parse::Parsed;
use crate::view::Eye;
use nom::Parser;
use nom::error::context;
use nom::multi::count;
use nom::number::complete::{le_u32, le_u64};
use std::io::{Cursor, Seek, Write};
use std::path::Path;

/// The tiles' bytes, the left eye's first.
pub const RAY_TILES: ChunkTag = ChunkTag(*b"RAYS");
/// Where each tile is.
pub const RAY_INDEX: ChunkTag = ChunkTag(*b"RTIX");
/// Size of an index entry: offset, bytes, CRC-32, rays, zero.
pub const RAY_INDEX_ENTRY_BYTES: usize = 24;

/// A tile's bytes, ready to be appended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EncodedRayTile {
    bytes: Vec<u8>,
    crc32: u32,
    rays: u32,
}

impl EncodedRayTile {
    /// Encoded size.
    #[must_use]
    pub fn size_bytes(&self) -> usize {
        self.bytes.len()
    }
}

/// Encodes a tile. Pure, so that tiles can be encoded in parallel.
///
/// # Errors
/// When the tile breaks an invariant of the format.
pub fn encode_ray_tile(tile: &RayTile, has_visits: bool) -> Result<EncodedRayTile> {
    let bytes = codec::encode(tile, has_visits).map_err(|broken| FormatError::Unwritable {
        what: format!("tile at {:?}, {}", tile.origin_px, broken.what),
        expected: broken.expected.to_owned(),
        found: broken.found,
    })?;
    let too_many = |_| FormatError::Unwritable {
        what: format!("tile at {:?}", tile.origin_px),
        expected: "less than 2^32 bytes and rays".to_owned(),
        found: format!("{} rays", tile.rays.len()),
    };
    u32::try_from(bytes.len()).map_err(too_many)?;
    Ok(EncodedRayTile {
        crc32: crc32fast::hash(&bytes),
        rays: u32::try_from(tile.rays.len()).map_err(too_many)?,
        bytes,
    })
}

/// Writes a trace tile by tile: the left eye's in order, then the right eye's.
#[derive(Debug)]
pub struct RaytraceWriter<W = AtomicFile> {
    container: ContainerWriter<W>,
    index: Vec<u8>,
    offset: u64,
}

impl RaytraceWriter<AtomicFile> {
    /// Starts a file that appears under its name when it is finished.
    ///
    /// # Errors
    /// When the temporary file beside `path` cannot be written.
    pub fn create(path: &Path) -> Result<Self> {
        Self::start(ContainerWriter::create(path, Kind::Raytrace)?)
    }

    /// Writes index and tables, and renames the file to its name. Returns its size in bytes.
    ///
    /// # Errors
    /// When writing fails, tiles are missing, or a table breaks an invariant; no file is left.
    pub fn finish(self, tables: &RaytraceTables) -> Result<u64> {
        self.complete(tables)?.finish()
    }
}

impl RaytraceWriter<Cursor<Vec<u8>>> {
    /// Starts a trace in memory.
    ///
    /// # Errors
    /// None in practice; the signature is that of the file's.
    pub fn in_memory() -> Result<Self> {
        Self::start(ContainerWriter::in_memory(Kind::Raytrace)?)
    }

    /// Writes index and tables, and yields the bytes.
    ///
    /// # Errors
    /// When tiles are missing or a table breaks an invariant.
    pub fn into_bytes(self, tables: &RaytraceTables) -> Result<Vec<u8>> {
        self.complete(tables)?.into_bytes()
    }
}

impl<W: Write + Seek> RaytraceWriter<W> {
    fn start(mut container: ContainerWriter<W>) -> Result<Self> {
        container.begin_chunk(RAY_TILES)?;
        Ok(Self {
            container,
            index: Vec::new(),
            offset: 0,
        })
    }

    /// Appends the next tile.
    ///
    /// # Errors
    /// When writing fails.
    pub fn tile(&mut self, tile: &EncodedRayTile) -> Result<()> {
        self.container.append(&tile.bytes)?;
        let bytes = u32::try_from(tile.bytes.len()).unwrap_or(u32::MAX);
        self.index.extend(self.offset.to_le_bytes());
        for number in [bytes, tile.crc32, tile.rays, 0] {
            self.index.extend(number.to_le_bytes());
        }
        self.offset += u64::from(bytes);
        Ok(())
    }

    fn complete(mut self, tables: &RaytraceTables) -> Result<ContainerWriter<W>> {
        let tiles = 2 * tables.tile_count() as usize;
        let written = self.index.len() / RAY_INDEX_ENTRY_BYTES;
        if written != tiles {
            return Err(FormatError::Unwritable {
                what: "tiles".to_owned(),
                expected: format!("{tiles}, all of both eyes"),
                found: written.to_string(),
            });
        }
        self.container.end_chunk()?;
        self.container.chunk(RAY_INDEX, &self.index)?;
        tables::write(tables, &mut self.container)?;
        Ok(self.container)
    }
}

/// One entry of the index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct IndexEntry {
    offset: u64,
    bytes: u32,
    crc32: u32,
    rays: u32,
}

fn index_entry(input: &[u8]) -> Parsed<'_, IndexEntry> {
    let (rest, (offset, bytes, crc32, rays, zero)) = context(
        "an index entry of 24 bytes",
        (le_u64, le_u32, le_u32, le_u32, le_u32),
    )
    .parse(input)?;
    let entry = IndexEntry {
        offset,
        bytes,
        crc32,
        rays,
    };
    let expected = || "a zero at the end of the entry".to_owned();
    crate::parse::ensure(input, zero == 0, expected, zero)?;
    Ok((rest, entry))
}

/// An opened ray trace.
#[derive(Debug)]
pub struct Raytrace {
    container: Container,
    tables: RaytraceTables,
    index: Vec<IndexEntry>,
}

impl Raytrace {
    /// Maps a trace and reads its tables and index.
    ///
    /// # Errors
    /// When the file cannot be read or is malformed; the error names the place.
    pub fn open(path: &Path) -> Result<Self> {
        Self::new(Container::open(path)?)
    }

    /// Reads a trace from memory.
    ///
    /// # Errors
    /// When the bytes are malformed.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self> {
        Self::new(Container::from_bytes(bytes)?)
    }

    fn new(container: Container) -> Result<Self> {
        container.expect_kind(Kind::Raytrace)?;
        let tables = tables::read(&container)?;
        let tiles = 2 * tables.tile_count() as usize;
        let bytes = container.chunk(RAY_INDEX)?.len();
        if bytes != tiles * RAY_INDEX_ENTRY_BYTES {
            let expected = format!("24 bytes for each of {tiles} tiles");
            return Err(container.malformed(RAY_INDEX, 0, expected, format!("{bytes} bytes")));
        }
        let index =
            container.parse_chunk(RAY_INDEX, |input| count(index_entry, tiles).parse(input))?;
        check_placement(&container, &index)?;
        Ok(Self {
            container,
            tables,
            index,
        })
    }

    /// The tables.
    #[must_use]
    pub fn tables(&self) -> &RaytraceTables {
        &self.tables
    }

    /// The container, for its directory and sizes.
    #[must_use]
    pub fn container(&self) -> &Container {
        &self.container
    }

    /// CRC-32 of the whole file, which names the trace in results.
    #[must_use]
    pub fn file_checksum(&self) -> u32 {
        self.container.file_checksum()
    }

    /// Rays of a tile as the index says; 0 for a tile that is not there.
    #[must_use]
    pub fn tile_rays(&self, eye: Eye, tile: u32) -> u32 {
        self.entry(eye, tile).map_or(0, |entry| entry.rays)
    }

    /// Decodes a tile of an eye into `out`, whose memory is reused. Tiles are numbered row by row
    /// from the top left. May be called from many threads.
    ///
    /// # Errors
    /// When there is no such tile, or its bytes are damaged; `out` is then empty.
    pub fn decode_tile(&self, eye: Eye, tile: u32, out: &mut RayTile) -> Result<()> {
        out.clear();
        let entry = self.entry(eye, tile)?;
        (out.origin_px, out.size_px) = self.tables.tile_rect(tile);
        let outcome = self.decode_entry(eye, entry, out);
        if outcome.is_err() {
            out.clear();
        }
        outcome
    }

    fn decode_entry(&self, eye: Eye, entry: &IndexEntry, out: &mut RayTile) -> Result<()> {
        let chunk = self.container.chunk_unchecked(RAY_TILES)?;
        // The index was checked against the chunk when the file was opened.
        let bytes = usize::try_from(entry.offset)
            .ok()
            .and_then(|at| chunk.get(at..at.checked_add(entry.bytes as usize)?))
            .unwrap_or_default();
        let malformed = |offset: u64, expected: String, found: String| {
            let at = entry.offset + offset;
            self.container.malformed(RAY_TILES, at, expected, found)
        };
        let crc32 = crc32fast::hash(bytes);
        if crc32 != entry.crc32 {
            let expected = format!("a tile with CRC-32 {:08x}", entry.crc32);
            return Err(malformed(0, expected, format!("{crc32:08x}")));
        }
        codec::decode(&self.tables, self.tables.camera(eye), bytes, out)
            .map_err(|fail| malformed(fail.offset as u64, fail.expected, fail.found))?;
        if out.rays.len() as u64 != u64::from(entry.rays) {
            let expected = format!("{} rays, as the index says", entry.rays);
            return Err(malformed(0, expected, out.rays.len().to_string()));
        }
        Ok(())
    }

    fn entry(&self, eye: Eye, tile: u32) -> Result<&IndexEntry> {
        let tiles = self.tables.tile_count();
        let first = match eye {
            Eye::Left => 0,
            Eye::Right => tiles as usize,
        };
        Some(tile)
            .filter(|tile| *tile < tiles)
            .and_then(|tile| self.index.get(first + tile as usize))
            .ok_or_else(|| FormatError::OutOfRange {
                file: self.container.file().to_owned(),
                what: "tile",
                index: u64::from(tile),
                count: u64::from(tiles),
            })
    }
}

/// Tiles must fill their chunk in index order, so none overlap and no byte is unaccounted for.
fn check_placement(container: &Container, index: &[IndexEntry]) -> Result<()> {
    let chunk_bytes = container.entry(RAY_TILES)?.length_bytes;
    let mut end = 0u64;
    for (slot, entry) in index.iter().enumerate() {
        let at = (slot * RAY_INDEX_ENTRY_BYTES) as u64;
        if entry.offset != end {
            let found = entry.offset;
            return Err(container.malformed(RAY_INDEX, at, format!("offset {end}"), found));
        }
        end = end.saturating_add(u64::from(entry.bytes));
    }
    if end == chunk_bytes {
        return Ok(());
    }
    let expected = format!("tiles that fill {chunk_bytes} bytes");
    Err(container.malformed(RAY_INDEX, 0, expected, format!("{end} bytes of tiles")))
}
