//! Writes and reads a `.raytrace`: tables at once, tiles one by one from any thread.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{RayTile, RaytraceTables, codec, tables};
use crate::container::{AtomicFile, ChunkTag, Container, ContainerWriter, Kind};
use crate::error::{Broken, FormatError, Result, ensure};
use crate::parse::{Parsed, zero};
use crate::tiles::{TileChunk, TileSpan};
use crate::view::Eye;
use nom::Parser;
use nom::error::context;
use nom::multi::count;
use nom::number::complete::le_u32;
use std::io::{Cursor, Seek, Write};
use std::path::Path;

/// Chunk of the encoded tiles, the left eye's first.
pub const RAY_TILES: ChunkTag = ChunkTag(*b"RAYS");
/// Chunk of the tile index.
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

/// Encodes a tile. A pure function, so that tiles can be encoded in parallel.
///
/// # Errors
/// The tile violates an invariant of the format.
pub fn encode_ray_tile(tile: &RayTile, has_visits: bool) -> Result<EncodedRayTile> {
    let bytes = codec::encode(tile, has_visits).map_err(|broken| {
        let what = format!("tile at {:?}, {}", tile.origin_px, broken.what);
        Broken { what, ..broken }.unwritable()
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
    /// The temporary file in the folder of `path` cannot be written.
    pub fn create(path: &Path) -> Result<Self> {
        Self::start(ContainerWriter::create(path, Kind::Raytrace)?)
    }

    /// Writes index and tables, and renames the file. Returns its size in bytes.
    ///
    /// # Errors
    /// Writing failed, tiles are missing, or a table violates an invariant; no file is left.
    pub fn finish(self, tables: &RaytraceTables) -> Result<u64> {
        self.complete(tables)?.finish()
    }
}

impl RaytraceWriter<Cursor<Vec<u8>>> {
    /// Starts a trace in memory.
    ///
    /// # Errors
    /// None in practice; the signature matches that for files.
    pub fn in_memory() -> Result<Self> {
        Self::start(ContainerWriter::in_memory(Kind::Raytrace)?)
    }

    /// Writes index and tables, and returns the bytes.
    ///
    /// # Errors
    /// Tiles are missing, or a table violates an invariant.
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
    /// Writing failed.
    pub fn tile(&mut self, tile: &EncodedRayTile) -> Result<()> {
        self.container.append(&tile.bytes)?;
        let bytes = u32::try_from(tile.bytes.len()).unwrap_or(u32::MAX);
        let span = TileSpan {
            offset: self.offset,
            bytes,
            crc32: tile.crc32,
        };
        span.write(&mut self.index);
        for number in [tile.rays, 0] {
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
    span: TileSpan,
    rays: u32,
}

fn index_entry(input: &[u8]) -> Parsed<'_, IndexEntry> {
    let (rest, (span, rays)) =
        context("an index entry of 24 bytes", (TileSpan::parse, le_u32)).parse(input)?;
    let (rest, ()) = zero(rest, 4)?;
    Ok((rest, IndexEntry { span, rays }))
}

/// An open ray trace.
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
    /// The file cannot be read or is malformed; the error names the place.
    pub fn open(path: &Path) -> Result<Self> {
        Self::from_container(Container::open(path)?)
    }

    /// Reads a trace from memory.
    ///
    /// # Errors
    /// The bytes are malformed.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self> {
        Self::from_container(Container::from_bytes(bytes)?)
    }

    /// Reads tables and index of an open container, and checks everything except the content of the tiles.
    ///
    /// # Errors
    /// The container is malformed, or of the other kind.
    pub fn from_container(container: Container) -> Result<Self> {
        container.expect_kind(Kind::Raytrace)?;
        let tables = tables::read(&container)?;
        let tiles = 2 * tables.tile_count() as usize;
        let bytes = container.chunk(RAY_INDEX)?.len();
        if bytes != tiles * RAY_INDEX_ENTRY_BYTES {
            let expected = format!("24 bytes for each of {tiles} tiles");
            return Err(container.malformed(RAY_INDEX, 0, expected, format!("{bytes} bytes")));
        }
        let index: Vec<IndexEntry> =
            container.parse_chunk(RAY_INDEX, |input| count(index_entry, tiles).parse(input))?;
        tile_chunk(&container).check(index.iter().map(|entry| Some(entry.span)))?;
        for (slot, (entry, tile)) in index.iter().zip(tile_numbers(&tables)).enumerate() {
            check_entry(&tables, entry, tile).map_err(|broken| {
                let at = (slot * RAY_INDEX_ENTRY_BYTES) as u64;
                container.malformed(RAY_INDEX, at, broken.expected, broken.found)
            })?;
        }
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

    /// CRC-32 of the content, which identifies the trace in results. It does not depend on the program,
    /// driver and path of the capture (FORMAT.md).
    #[must_use]
    pub fn content_checksum(&self) -> u32 {
        self.container.content_checksum(tables::META)
    }

    /// Number of rays of a tile from the index; 0 for a missing tile.
    #[must_use]
    pub fn tile_rays(&self, eye: Eye, tile: u32) -> u32 {
        self.entry(eye, tile).map_or(0, |entry| entry.rays)
    }

    /// Decodes a tile of an eye into `out`, reusing its memory. Tiles are numbered row by row from the top
    /// left. May be called from many threads.
    ///
    /// # Errors
    /// There is no such tile, or its bytes are damaged; `out` is then empty.
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
        let (tables, camera) = (&self.tables, self.tables.camera(eye));
        tile_chunk(&self.container).parse(&entry.span, |input| {
            codec::decode(tables, camera, input, out)
        })?;
        if out.rays.len() as u64 == u64::from(entry.rays) {
            return Ok(());
        }
        let expected = format!("{} rays, as the index says", entry.rays);
        let found = out.rays.len();
        Err(self
            .container
            .malformed(RAY_TILES, entry.span.offset, expected, found))
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

fn tile_chunk(container: &Container) -> TileChunk<'_> {
    TileChunk {
        container,
        tiles: RAY_TILES,
        index: RAY_INDEX,
        entry_bytes: RAY_INDEX_ENTRY_BYTES,
    }
}

/// Tile numbers in the order of the index.
fn tile_numbers(tables: &RaytraceTables) -> impl Iterator<Item = u32> + use<> {
    let tiles = tables.tile_count();
    (0..tiles).chain(0..tiles)
}

/// Checks that a tile's bytes and rays are enough for its samples, before any allocation.
fn check_entry(
    tables: &RaytraceTables,
    entry: &IndexEntry,
    tile: u32,
) -> std::result::Result<(), Broken> {
    let (_, [width, height]) = tables.tile_rect(tile);
    let samples = u64::from(width * height) * u64::from(tables.meta.samples_per_px);
    let least = codec::least_bytes(samples);
    let IndexEntry { span, rays } = entry;
    ensure(
        u64::from(*rays) >= samples && u64::from(span.bytes) >= least,
        || {
            let expected = format!("{samples} samples: as many rays, in {least} bytes or more");
            let found = format!("{rays} rays in {} bytes", span.bytes);
            Broken::new(format!("tile {tile}"), expected, found)
        },
    )
}
