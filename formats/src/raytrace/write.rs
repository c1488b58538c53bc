//! Writes a `.raytrace`: tiles one by one, then the tables.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::file::{
    COLUMNS_MINOR, GEOMETRY_INDEX, GEOMETRY_INDEX_ENTRY_BYTES, GEOMETRY_TILES, IndexEntry, NODES,
    RAY_INDEX, RAY_INDEX_ENTRY_BYTES, RAY_TILES, SLOTS,
};
use super::hierarchy::Hierarchy;
use super::{EyeCamera, RayTile, RaytraceTables, codec, geometry_codec, hierarchy_codec, tables};
use crate::container::{AtomicFile, ContainerWriter, Kind, MAJOR_1, folder_of};
use crate::error::{Broken, FormatError, Result, ensure};
use crate::records;
use crate::tiles::{TileSpan, TileSpool, size_u32};
use std::fmt::Display;
use std::io::{Cursor, Seek, Write};
use std::path::Path;
use tempfile::SpooledTempFile;

/// A tile's bytes, ready to be appended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EncodedRayTile {
    bytes: Vec<u8>,
    crc32: u32,
    rays: u32,
    geometry: Option<Vec<u8>>,
    /// A ray of a kind that only a trace with lighting has.
    needs_lighting: bool,
}

impl EncodedRayTile {
    /// Encoded size.
    pub fn size_bytes(&self) -> usize {
        self.bytes.len()
    }
}

/// Encodes a tile. A pure function, so that tiles can be encoded in parallel.
///
/// # Errors
/// The tile violates an invariant of the format.
pub fn encode_ray_tile(tile: &RayTile, has_visits: bool) -> Result<EncodedRayTile> {
    let bytes = codec::encode(tile, has_visits).map_err(|broken| of_tile(tile, broken))?;
    let what = format!("tile at {:?}", tile.origin_px);
    size_u32(&what, bytes.len())?;
    Ok(EncodedRayTile {
        crc32: crc32fast::hash(&bytes),
        rays: size_u32(&what, tile.rays.len())?,
        bytes,
        geometry: None,
        needs_lighting: tile.rays.iter().any(|ray| ray.kind.needs_lighting()),
    })
}

fn of_tile(tile: &RayTile, broken: Broken) -> FormatError {
    let what = format!("tile at {:?}, {}", tile.origin_px, broken.what);
    Broken { what, ..broken }.unwritable()
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
    let bytes =
        geometry_codec::encode(tables, eye, tile).map_err(|broken| of_tile(tile, broken))?;
    size_u32(
        &format!("geometry of the tile at {:?}", tile.origin_px),
        bytes.len(),
    )?;
    encoded.geometry = Some(bytes);
    Ok(encoded)
}

/// Writes a trace tile by tile: the left eye's in order, then the right eye's.
#[derive(Debug)]
pub struct RaytraceWriter<W = AtomicFile> {
    container: ContainerWriter<W>,
    index: Vec<u8>,
    offset: u64,
    geometry: TileSpool,
    geometry_index: Vec<u8>,
    hierarchy: Option<Hierarchy>,
    needs_lighting: bool,
}

impl RaytraceWriter<AtomicFile> {
    /// Starts a file that appears under its name when it is finished.
    ///
    /// # Errors
    /// The temporary file in the folder of `path` cannot be written.
    pub fn create(path: &Path) -> Result<Self> {
        let spool = tempfile::spooled_tempfile_in(TileSpool::IN_MEMORY_BYTES, folder_of(path));
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
            geometry: TileSpool::new(spool),
            geometry_index: Vec::new(),
            hierarchy: None,
            needs_lighting: false,
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
        let span = TileSpan {
            offset: self.offset,
            bytes: size_u32("tile", tile.bytes.len())?,
            crc32: tile.crc32,
        };
        let entry = IndexEntry {
            span,
            rays: tile.rays,
        };
        records::write(MAJOR_1, &entry, &mut self.index)?;
        self.offset += tile.bytes.len() as u64;
        self.needs_lighting |= tile.needs_lighting;
        if let Some(geometry) = &tile.geometry {
            let span = self.geometry.append("geometry of a tile", geometry)?;
            records::write(MAJOR_1, &span, &mut self.geometry_index)?;
        }
        Ok(())
    }

    fn complete(mut self, tables: &RaytraceTables) -> Result<ContainerWriter<W>> {
        let tiles = 2 * tables.tile_count() as usize;
        let written = self.index.len() / RAY_INDEX_ENTRY_BYTES;
        let require = |holds, what, expected: &str, found: &dyn Display| {
            ensure(holds, what, expected, found).map_err(Broken::unwritable)
        };
        let expected = format!("{tiles}, all of both eyes");
        require(written == tiles, "tiles", &expected, &written)?;
        require(
            !self.needs_lighting || tables.meta.lighting.is_some(),
            "rays",
            "kinds of Whitted's model, as the trace has no lighting",
            &"ambient occlusion or diffuse rays",
        )?;
        let with_geometry = self.geometry_index.len() / GEOMETRY_INDEX_ENTRY_BYTES;
        let expected = format!("that of all {tiles} tiles or of none");
        let is_whole = with_geometry == 0 || with_geometry == tiles;
        require(is_whole, "geometry", &expected, &with_geometry)?;
        self.container.end_chunk()?;
        self.container.chunk(RAY_INDEX, &self.index)?;
        if with_geometry > 0 {
            self.container.require_minor(COLUMNS_MINOR);
            self.geometry.write(GEOMETRY_TILES, &mut self.container)?;
            self.container.chunk(GEOMETRY_INDEX, &self.geometry_index)?;
        }
        if let Some(hierarchy) = &self.hierarchy {
            hierarchy.check(&tables.bvh).map_err(Broken::unwritable)?;
            self.container.require_minor(COLUMNS_MINOR);
            let nodes = hierarchy_codec::encode_nodes(&tables.bvh, hierarchy);
            self.container.chunk(NODES, &nodes)?;
            let triangles = hierarchy_codec::encode_triangles(&hierarchy.triangles);
            self.container.chunk(SLOTS, &triangles)?;
        }
        if tables.bvh.traversal.is_new_in_minor_4() || tables.meta.lighting.is_some() {
            self.container
                .require_minor(tables::TREES_AND_LIGHTING_MINOR);
        }
        if tables.bvh.update.is_some() {
            self.container.require_minor(tables::UPDATE_MINOR);
        }
        if tables.bvh.instances.is_some() {
            self.container.require_minor(tables::INSTANCES_MINOR);
            let expected = "that of a tree without instances";
            let is_absent = self.hierarchy.is_none();
            require(
                is_absent,
                "content of the hierarchy",
                expected,
                &"instances",
            )?;
        }
        tables::write(tables, &mut self.container)?;
        Ok(self.container)
    }
}
