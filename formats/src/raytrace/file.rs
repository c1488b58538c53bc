//! Writes and reads a `.raytrace`: tables at once, tiles one by one from any thread.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::geometry::RayGeometry;
use super::hierarchy::{Hierarchy, Parents};
use super::{EyeCamera, RayTile, RaytraceTables, codec, geometry_codec, hierarchy_codec, tables};
use crate::container::{AtomicFile, ChunkTag, Container, ContainerWriter, Kind};
use crate::error::{Broken, FormatError, Result, ensure};
use crate::parse::{Parsed, zero};
use crate::tiles::{TileChunk, TileSpan};
use crate::view::Eye;
use nom::Parser;
use nom::error::context;
use nom::multi::count;
use nom::number::complete::le_u32;
use std::io::{Cursor, Read, Seek, Write};
use std::path::Path;
use tempfile::SpooledTempFile;

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

/// Geometry of this size is kept in memory until the records are written; more goes to a temporary file.
const SPOOL_BYTES: usize = 64 << 20;

/// A tile's bytes, ready to be appended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EncodedRayTile {
    bytes: Vec<u8>,
    crc32: u32,
    rays: u32,
    geometry: Option<Vec<u8>>,
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
        geometry: None,
    })
}

/// Encodes a tile with its [`RayTile::geometry`]; `eye` is the camera of its eye.
///
/// # Errors
/// The tile violates an invariant of the format.
pub fn encode_ray_tile_with_geometry(
    tables: &RaytraceTables,
    eye: &EyeCamera,
    tile: &RayTile,
) -> Result<EncodedRayTile> {
    let mut encoded = encode_ray_tile(tile, tables.meta.has_visits)?;
    let bytes = geometry_codec::encode(tables, eye, tile).map_err(|broken| {
        let what = format!("tile at {:?}, {}", tile.origin_px, broken.what);
        Broken { what, ..broken }.unwritable()
    })?;
    if u32::try_from(bytes.len()).is_err() {
        return Err(FormatError::Unwritable {
            what: format!("geometry of the tile at {:?}", tile.origin_px),
            expected: "less than 2^32 bytes".to_owned(),
            found: bytes.len().to_string(),
        });
    }
    encoded.geometry = Some(bytes);
    Ok(encoded)
}

/// The encoded geometry of the tiles written so far, and its index.
#[derive(Debug)]
struct GeometrySpool {
    bytes: SpooledTempFile,
    index: Vec<u8>,
    offset: u64,
}

/// Writes a trace tile by tile: the left eye's in order, then the right eye's.
#[derive(Debug)]
pub struct RaytraceWriter<W = AtomicFile> {
    container: ContainerWriter<W>,
    index: Vec<u8>,
    offset: u64,
    geometry: GeometrySpool,
    hierarchy: Option<Hierarchy>,
}

impl RaytraceWriter<AtomicFile> {
    /// Starts a file that appears under its name when it is finished.
    ///
    /// # Errors
    /// The temporary file in the folder of `path` cannot be written.
    pub fn create(path: &Path) -> Result<Self> {
        // An absolute or bare name has its folder as parent, or the current one.
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let spool = tempfile::spooled_tempfile_in(SPOOL_BYTES, folder);
        Self::start(ContainerWriter::create(path, Kind::Raytrace)?, spool)
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
        let spool = tempfile::spooled_tempfile(usize::MAX);
        Self::start(ContainerWriter::in_memory(Kind::Raytrace)?, spool)
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
    fn start(mut container: ContainerWriter<W>, spool: SpooledTempFile) -> Result<Self> {
        container.begin_chunk(RAY_TILES)?;
        Ok(Self {
            container,
            index: Vec::new(),
            offset: 0,
            geometry: GeometrySpool {
                bytes: spool,
                index: Vec::new(),
                offset: 0,
            },
            hierarchy: None,
        })
    }

    /// Adds the content of the hierarchy.
    #[must_use]
    pub fn with_hierarchy(mut self, hierarchy: Hierarchy) -> Self {
        self.hierarchy = Some(hierarchy);
        self
    }

    /// Appends the next tile. Either all tiles have geometry or none.
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
        if let Some(geometry) = &tile.geometry {
            self.geometry.append(geometry)?;
        }
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
        let with_geometry = self.geometry.index.len() / GEOMETRY_INDEX_ENTRY_BYTES;
        if with_geometry != 0 && with_geometry != tiles {
            return Err(FormatError::Unwritable {
                what: "geometry".to_owned(),
                expected: format!("that of all {tiles} tiles or of none"),
                found: with_geometry.to_string(),
            });
        }
        self.container.end_chunk()?;
        self.container.chunk(RAY_INDEX, &self.index)?;
        if with_geometry > 0 {
            self.container.require_minor(COLUMNS_MINOR);
            self.geometry.write(&mut self.container)?;
        }
        if let Some(hierarchy) = &self.hierarchy {
            hierarchy.check(&tables.bvh).map_err(Broken::unwritable)?;
            self.container.require_minor(COLUMNS_MINOR);
            let nodes = hierarchy_codec::encode_nodes(&tables.bvh, hierarchy);
            self.container.chunk(NODES, &nodes)?;
            let triangles = hierarchy_codec::encode_triangles(&hierarchy.triangles);
            self.container.chunk(SLOTS, &triangles)?;
        }
        tables::write(tables, &mut self.container)?;
        Ok(self.container)
    }
}

impl GeometrySpool {
    fn append(&mut self, bytes: &[u8]) -> Result<()> {
        let written = self.bytes.write_all(bytes);
        written.map_err(|source| FormatError::io("temporary file", "write", source))?;
        let span = TileSpan {
            offset: self.offset,
            bytes: u32::try_from(bytes.len()).unwrap_or(u32::MAX),
            crc32: crc32fast::hash(bytes),
        };
        span.write(&mut self.index);
        self.offset += bytes.len() as u64;
        Ok(())
    }

    fn write<W: Write + Seek>(&mut self, container: &mut ContainerWriter<W>) -> Result<()> {
        let failed = |source| FormatError::io("temporary file", "read", source);
        self.bytes.rewind().map_err(failed)?;
        container.begin_chunk(GEOMETRY_TILES)?;
        let mut buffer = vec![0; 1 << 16];
        loop {
            let count = self.bytes.read(&mut buffer).map_err(failed)?;
            let Some(read) = buffer.get(..count).filter(|read| !read.is_empty()) else {
                break;
            };
            container.append(read)?;
        }
        container.end_chunk()?;
        container.chunk(GEOMETRY_INDEX, &self.index)
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
