//! Reads a `.textrace`: tables at once, tiles one by one from any thread.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::geometry::{self, Geometry, TileLists};
use super::index::{IndexEntry, TILE_CHUNK};
use super::{Encoding, Pass, TILES, Tables, Tile, delta, invariant, planes, raw, tables};
use crate::container::{Container, Kind};
use crate::error::{Broken, Result};
use std::path::Path;

/// Maximum number of records for which memory is reserved before decoding.
const MOST_RESERVED: u32 = 1 << 16;

/// Figures of a tile from the index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileStats {
    /// Quad records.
    pub records: u32,
    /// Primitive runs.
    pub runs: u32,
    /// Encoded size.
    pub bytes: u32,
}

/// An open texture-address trace.
#[derive(Debug)]
pub struct Textrace {
    container: Container,
    tables: Tables,
    index: Vec<IndexEntry>,
    /// First index slot of each pass.
    pass_slots: Vec<usize>,
    geometry: Option<Geometry>,
}

impl Textrace {
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
        container.expect_kind(Kind::Textrace)?;
        let tables = tables::read(&container)?;
        let slots: u64 = tables
            .passes
            .iter()
            .map(Pass::tile_count_u64)
            .fold(0, u64::saturating_add);
        let index: Vec<IndexEntry> = TILE_CHUNK.read_index(&container, slots)?;
        TILE_CHUNK.check(&container, index.iter().map(IndexEntry::touched))?;
        let mut next = 0usize;
        let pass_slots = tables
            .passes
            .iter()
            .map(|pass| {
                let first = next;
                // Cannot overflow, because the sum was compared with the index's size above.
                next += usize::try_from(pass.tile_count_u64()).unwrap_or(0);
                first
            })
            .collect();
        let geometry = geometry::read(&container, &tables)?;
        Ok(Self {
            container,
            tables,
            index,
            pass_slots,
            geometry,
        })
    }

    /// Meshes and views, if the trace was captured with geometry.
    pub fn geometry(&self) -> Option<&Geometry> {
        self.geometry.as_ref()
    }

    /// The primitive lists of a view of [`Self::geometry`].
    ///
    /// # Errors
    /// There is no such view, or its bytes are damaged.
    pub fn tile_lists(&self, view: usize) -> Result<TileLists> {
        let views = self.geometry.as_ref();
        let found =
            views.and_then(|geometry| geometry.views.get(view).zip(geometry.spans.get(view)));
        let Some((view, span)) = found else {
            let count = views.map_or(0, |geometry| geometry.views.len() as u64);
            return Err(self.container.out_of_range("view", view as u64, count));
        };
        geometry::lists_of(&self.container, &self.tables, view, span)
    }

    /// The primitive lists of each pass, by pass; `None` without geometry.
    ///
    /// # Errors
    /// Damaged lists.
    pub fn pass_lists(&self) -> Result<Option<Vec<TileLists>>> {
        let Some(geometry) = &self.geometry else {
            return Ok(None);
        };
        let views = (0..self.tables.passes.len()).filter_map(|pass| geometry.view_of_pass(pass));
        views
            .map(|view| self.tile_lists(view))
            .collect::<Result<_>>()
            .map(Some)
    }

    /// Checks that the lists of a pass hold every primitive that has records in a decoded tile of it.
    ///
    /// # Errors
    /// The first primitive that the tile's list lacks.
    pub fn check_listed(
        &self,
        pass: usize,
        tile: usize,
        records: &Tile,
        lists: &TileLists,
    ) -> Result<()> {
        lists.check_records(tile, records).map_err(|broken| {
            let what = format!("pass {pass}, {}", broken.what);
            let tag = geometry::PRIMITIVE_LISTS;
            self.container.broken(tag, 0, Broken { what, ..broken })
        })
    }

    /// The tables.
    pub fn tables(&self) -> &Tables {
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

    /// Figures of a tile from the index; zero for an untouched or missing tile.
    pub fn tile_stats(&self, pass: usize, tile: usize) -> TileStats {
        self.entry(pass, tile).map_or_else(
            |_| TileStats::default(),
            |entry| TileStats {
                records: entry.records,
                runs: entry.runs,
                bytes: entry.span.bytes,
            },
        )
    }

    /// Number of quad records of all tiles.
    pub fn records(&self) -> u64 {
        let passes = (0..).zip(&self.tables().passes);
        let tiles = passes.flat_map(|(pass, info)| {
            let tiles = 0..info.tile_count() as usize;
            tiles.map(move |tile| self.tile_stats(pass, tile).records)
        });
        tiles.map(u64::from).sum()
    }

    /// Encoding of a tile.
    ///
    /// # Errors
    /// There is no such tile.
    pub fn tile_encoding(&self, pass: usize, tile: usize) -> Result<Encoding> {
        Ok(self.entry(pass, tile)?.encoding)
    }

    /// Decodes a tile into `out`, reusing its memory. May be called from many threads.
    ///
    /// # Errors
    /// There is no such tile, or its bytes are damaged; `out` is then empty.
    pub fn decode_tile(&self, pass: usize, tile: usize, out: &mut Tile) -> Result<()> {
        out.clear();
        let entry = self.entry(pass, tile)?;
        if entry.records == 0 {
            return Ok(());
        }
        let outcome = self.decode_entry(entry, out);
        if outcome.is_err() {
            out.clear();
        }
        outcome
    }

    fn decode_entry(&self, entry: &IndexEntry, out: &mut Tile) -> Result<()> {
        let IndexEntry { runs, records, .. } = *entry;
        // Small records can be numerous. Beyond the size of a usual tile, memory grows while decoding.
        out.runs.reserve(runs.min(MOST_RESERVED) as usize);
        out.records.reserve(records.min(MOST_RESERVED) as usize);
        TILE_CHUNK.parse(&self.container, &entry.span, |input| match entry.encoding {
            Encoding::Raw => raw::decode(runs, records, input, out),
            Encoding::Delta => delta::decode(runs, records, input, out),
            Encoding::Planes => planes::decode(runs, records, input, out),
        })?;
        invariant::check(&self.tables.draws, out).map_err(|broken| {
            let what = format!("{} of the tile", broken.what);
            let offset = entry.span.offset;
            self.container
                .broken(TILES, offset, Broken { what, ..broken })
        })
    }

    fn entry(&self, pass: usize, tile: usize) -> Result<&IndexEntry> {
        let (container, passes) = (&self.container, &self.tables.passes);
        let found = passes.get(pass).zip(self.pass_slots.get(pass));
        let (info, first) = found
            .ok_or_else(|| container.out_of_range("pass", pass as u64, passes.len() as u64))?;
        let tiles = info.tile_count_u64();
        Some(tile)
            .filter(|tile| (*tile as u64) < tiles)
            .and_then(|tile| self.index.get(first + tile))
            .ok_or_else(|| container.out_of_range("tile", tile as u64, tiles))
    }
}
