//! Reads a `.raytrace`: tables at once, tiles one by one from any thread.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::geometry::RayGeometry;
use super::hierarchy::{Hierarchy, Parents};
use super::{RayTile, RaytraceTables, codec, geometry_codec, hierarchy_codec, tables};
use crate::container::{ChunkTag, Container, Kind};
use crate::error::Result;
use crate::parse::Taken;
use crate::records::{Codec, Record};
use crate::tiles::{TileChunk, TileSpan};
use crate::view::Eye;
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

/// The tiles and their index.
const TILE_CHUNK: TileChunk = TileChunk {
    tiles: RAY_TILES,
    index: RAY_INDEX,
    entry_bytes: RAY_INDEX_ENTRY_BYTES,
};
/// The geometry of the tiles and its index.
const GEOMETRY_CHUNK: TileChunk = TileChunk {
    tiles: GEOMETRY_TILES,
    index: GEOMETRY_INDEX,
    entry_bytes: GEOMETRY_INDEX_ENTRY_BYTES,
};

/// One entry of the index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct IndexEntry {
    pub span: TileSpan,
    pub rays: u32,
}

impl Record for IndexEntry {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "an index entry of 24 bytes";
        self.span.fields(codec)?;
        codec.number(&mut self.rays)?;
        codec.reserved::<4>()
    }
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
        let tiles = 2 * u64::from(tables.tile_count());
        let index: Vec<IndexEntry> = TILE_CHUNK.read_index(&container, tiles)?;
        TILE_CHUNK.check(&container, index.iter().map(|entry| Some(entry.span)))?;
        let numbers = (0..tables.tile_count()).chain(0..tables.tile_count());
        for (slot, (entry, tile)) in index.iter().zip(numbers).enumerate() {
            let (_, [width, height]) = tables.tile_rect(tile);
            let samples = u64::from(width * height) * u64::from(tables.meta.samples_per_px);
            let least = codec::least_bytes(samples);
            // Bytes and rays must be enough for the samples, before any allocation.
            let IndexEntry { span, rays } = entry;
            if u64::from(*rays) < samples || u64::from(span.bytes) < least {
                let at = (slot * RAY_INDEX_ENTRY_BYTES) as u64;
                let expected =
                    format_args!("{samples} samples: as many rays, in {least} bytes or more");
                let found = format_args!("{rays} rays in {} bytes", span.bytes);
                return Err(container.malformed(RAY_INDEX, at, expected, found));
            }
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
    pub fn tables(&self) -> &RaytraceTables {
        &self.tables
    }

    /// The container, for its directory and sizes.
    pub fn container(&self) -> &Container {
        &self.container
    }

    /// CRC-32 of the content, which identifies the trace in results. It does not depend on the program,
    /// driver and path of the capture (FORMAT.md).
    pub fn content_checksum(&self) -> u32 {
        self.container.content_checksum(tables::META)
    }

    /// Number of rays of a tile from the index; 0 for a missing tile.
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
    pub fn has_geometry(&self) -> bool {
        !self.geometry.is_empty()
    }

    /// Whether the trace has the content of its hierarchy.
    pub fn has_hierarchy(&self) -> bool {
        self.has_hierarchy
    }

    /// Decodes a tile with the geometry of its rays, if the trace has it.
    ///
    /// # Errors
    /// See [`Self::decode_tile`].
    pub fn decode_tile_with_geometry(&self, eye: Eye, tile: u32, out: &mut RayTile) -> Result<()> {
        self.decode_tile(eye, tile, out)?;
        out.geometry = self
            .decode_geometry(eye, tile, out)
            .inspect_err(|_| out.clear())?;
        Ok(())
    }

    fn decode_geometry(&self, eye: Eye, tile: u32, records: &RayTile) -> Result<Vec<RayGeometry>> {
        let Some(span) = self.geometry.get(self.slot(eye, tile)) else {
            return Ok(Vec::new());
        };
        GEOMETRY_CHUNK.parse(&self.container, span, |input| {
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
        let parents =
            (hierarchy.check(bvh)).map_err(|broken| container.broken(NODES, 0, broken))?;
        Ok(Some((hierarchy, parents)))
    }

    fn decode_entry(&self, eye: Eye, entry: &IndexEntry, out: &mut RayTile) -> Result<()> {
        let (tables, camera) = (&self.tables, self.tables.camera(eye));
        TILE_CHUNK.parse(&self.container, &entry.span, |input| {
            codec::decode(tables, camera, input, out)
        })?;
        let found = out.rays.len();
        if found as u64 == u64::from(entry.rays) {
            return Ok(());
        }
        let expected = format_args!("{} rays, as the index says", entry.rays);
        Err(self
            .container
            .malformed(RAY_TILES, entry.span.offset, expected, found))
    }

    /// Place of a tile in the index.
    fn slot(&self, eye: Eye, tile: u32) -> usize {
        let first = match eye {
            Eye::Left => 0,
            Eye::Right => self.tables.tile_count() as usize,
        };
        first + tile as usize
    }

    fn entry(&self, eye: Eye, tile: u32) -> Result<&IndexEntry> {
        let tiles = self.tables.tile_count();
        Some(tile)
            .filter(|tile| *tile < tiles)
            .and_then(|tile| self.index.get(self.slot(eye, tile)))
            .ok_or_else(|| (self.container).out_of_range("tile", tile.into(), tiles.into()))
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
    if has(first) {
        container.expect_minor(COLUMNS_MINOR, first, "this chunk")?;
    }
    Ok(has(first))
}

/// Positions of the geometry of `tiles` tiles, if the trace has it.
fn geometry_spans(container: &Container, tiles: u64) -> Result<Vec<TileSpan>> {
    if !has_all(container, [GEOMETRY_TILES, GEOMETRY_INDEX])? {
        return Ok(Vec::new());
    }
    let spans: Vec<TileSpan> = GEOMETRY_CHUNK.read_index(container, tiles)?;
    GEOMETRY_CHUNK.check(container, spans.iter().copied().map(Some))?;
    Ok(spans)
}
