//! Reads a `.raytrace`: tables at once, tiles one by one from any thread.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::geometry::RayGeometry;
use super::hierarchy::{Hierarchy, Parents};
use super::{RayTile, RaytraceTables, codec, geometry_codec, hierarchy_codec, tables};
use crate::container::{ChunkTag, Container, Kind};
use crate::error::{Broken, FormatError, Result, ensure};
use crate::parse::{Parsed, zero};
use crate::tiles::{TileChunk, TileSpan};
use crate::view::Eye;
use nom::Parser;
use nom::error::context;
use nom::multi::count;
use nom::number::complete::le_u32;
use std::path::Path;

/// Chunk of the encoded tiles, the left eye's first.
pub const RAY_TILES: ChunkTag = ChunkTag(*b"RAYS");
/// Chunk of the tile index.
pub const RAY_INDEX: ChunkTag = ChunkTag(*b"RTIX");
/// Size of an index entry: offset, bytes, CRC-32, rays, zero.
pub const RAY_INDEX_ENTRY_BYTES: usize = 24;

/// Chunk of the encoded geometry of the rays, tile by tile as [`RAY_TILES`].
pub const GEOMETRY_TILES: ChunkTag = ChunkTag(*b"RGEO");
/// Chunk of the index of [`GEOMETRY_TILES`].
pub const GEOMETRY_INDEX: ChunkTag = ChunkTag(*b"RGIX");
/// Size of an entry of that index: offset, bytes, CRC-32.
pub const GEOMETRY_INDEX_ENTRY_BYTES: usize = 16;
/// Chunk of the inner nodes.
pub const NODES: ChunkTag = ChunkTag(*b"RNOD");
/// Chunk of the triangles by slot.
pub const SLOTS: ChunkTag = ChunkTag(*b"RSLT");
/// Minor version of traces with one of these chunks.
pub const COLUMNS_MINOR: u16 = 3;

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
    /// Positions of the tiles' geometry; empty if the trace has none.
    geometry: Vec<TileSpan>,
    has_hierarchy: bool,
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
        let geometry = geometry_spans(&container, tiles)?;
        let has_hierarchy = has_all(&container, [NODES, SLOTS])?;
        Ok(Self {
            container,
            tables,
            index,
            geometry,
            has_hierarchy,
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

    /// Whether the trace has the geometry of its rays.
    #[must_use]
    pub fn has_geometry(&self) -> bool {
        !self.geometry.is_empty()
    }

    /// Whether the trace has the content of its hierarchy.
    #[must_use]
    pub fn has_hierarchy(&self) -> bool {
        self.has_hierarchy
    }

    /// Decodes a tile with the geometry of its rays, if the trace has it.
    ///
    /// # Errors
    /// See [`Self::decode_tile`].
    pub fn decode_tile_with_geometry(&self, eye: Eye, tile: u32, out: &mut RayTile) -> Result<()> {
        self.decode_tile(eye, tile, out)?;
        let geometry = self.decode_geometry(eye, tile, out);
        match geometry {
            Ok(geometry) => {
                out.geometry = geometry;
                Ok(())
            }
            Err(error) => {
                out.clear();
                Err(error)
            }
        }
    }

    fn decode_geometry(&self, eye: Eye, tile: u32, records: &RayTile) -> Result<Vec<RayGeometry>> {
        if self.geometry.is_empty() {
            return Ok(Vec::new());
        }
        let first = match eye {
            Eye::Left => 0,
            Eye::Right => self.tables.tile_count() as usize,
        };
        let Some(span) = self.geometry.get(first + tile as usize) else {
            return Ok(Vec::new());
        };
        geometry_chunk(&self.container).parse(span, |input| {
            geometry_codec::decode(&self.tables, self.tables.camera(eye), input, records)
        })
    }

    /// Reads the content of the hierarchy and the parents of its nodes and slots; `None` if the trace does not
    /// have it. A node takes up to 288 bytes of memory, a triangle 44.
    ///
    /// # Errors
    /// The chunks are malformed; the error names the place.
    pub fn read_hierarchy(&self) -> Result<Option<(Hierarchy, Parents)>> {
        if !self.has_hierarchy {
            return Ok(None);
        }
        let (container, bvh) = (&self.container, &self.tables.bvh);
        let hierarchy = Hierarchy {
            children: container
                .parse_chunk(NODES, |input| hierarchy_codec::decode_nodes(bvh, input))?,
            triangles: container
                .parse_chunk(SLOTS, |input| hierarchy_codec::decode_triangles(bvh, input))?,
        };
        let parents = hierarchy.check(bvh).map_err(|broken| {
            let expected = format!("{}: {}", broken.what, broken.expected);
            container.malformed(NODES, 0, expected, broken.found)
        })?;
        Ok(Some((hierarchy, parents)))
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

fn geometry_chunk(container: &Container) -> TileChunk<'_> {
    TileChunk {
        container,
        tiles: GEOMETRY_TILES,
        index: GEOMETRY_INDEX,
        entry_bytes: GEOMETRY_INDEX_ENTRY_BYTES,
    }
}

/// Whether a trace has two chunks that belong together.
fn has_all(container: &Container, [first, second]: [ChunkTag; 2]) -> Result<bool> {
    let has = |tag| container.entry(tag).is_ok();
    if has(first) != has(second) {
        // The error names the missing chunk.
        container.entry(first)?;
        container.entry(second)?;
    }
    if !has(first) {
        return Ok(false);
    }
    let (major, minor) = container.version();
    if minor < COLUMNS_MINOR {
        let expected = format!("version {major}.{COLUMNS_MINOR} for this chunk");
        return Err(container.malformed(first, 0, expected, format!("{major}.{minor}")));
    }
    Ok(true)
}

/// Positions of the geometry of `tiles` tiles, if the trace has it.
fn geometry_spans(container: &Container, tiles: usize) -> Result<Vec<TileSpan>> {
    if !has_all(container, [GEOMETRY_TILES, GEOMETRY_INDEX])? {
        return Ok(Vec::new());
    }
    let bytes = container.chunk(GEOMETRY_INDEX)?.len();
    if bytes != tiles * GEOMETRY_INDEX_ENTRY_BYTES {
        let expected = format!("16 bytes for each of {tiles} tiles");
        return Err(container.malformed(GEOMETRY_INDEX, 0, expected, format!("{bytes} bytes")));
    }
    let spans: Vec<TileSpan> = container.parse_chunk(GEOMETRY_INDEX, |input| {
        count(TileSpan::parse, tiles).parse(input)
    })?;
    geometry_chunk(container).check(spans.iter().copied().map(Some))?;
    Ok(spans)
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
