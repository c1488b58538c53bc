//! Reads a `.textrace`: tables at once, tiles one by one from any thread.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::geometry::{self, Geometry, TileLists};
use super::index::{IndexEntry, TILE_CHUNK};
use super::sharing::{MOST_REPEATS, REPEAT_BYTES};
use super::{
    Encoding, Pass, TILE_INDEX, TILES, Tables, Tile, VertexDraw, delta, invariant, planes, raw,
    tables, vertex_reads,
};
use crate::container::{Container, Kind, MAJOR_4};
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
    vertex_reads: Vec<VertexDraw>,
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
        let shares = container.version().0 >= MAJOR_4;
        let repeats = match shares {
            true => repeats(&container, &tables.passes)?,
            false => (0..tables.passes.len()).collect(),
        };
        let with_entries = (tables.passes.iter().enumerate().zip(&repeats))
            .filter(|((number, _), repeated)| number == *repeated)
            .map(|((_, pass), _)| pass.tile_count_u64());
        let slots = with_entries.fold(0, u64::saturating_add);
        let first = if shares {
            repeats.len() * REPEAT_BYTES
        } else {
            0
        };
        let index: Vec<IndexEntry> = TILE_CHUNK.read_index_from(&container, first, slots)?;
        match shares {
            true => {
                TILE_CHUNK.check_shared(&container, &index, first as u64, IndexEntry::touched)?
            }
            false => TILE_CHUNK.check(&container, index.iter().map(IndexEntry::touched))?,
        }
        let mut next = 0usize;
        let mut pass_slots: Vec<usize> = Vec::with_capacity(repeats.len());
        for (number, (pass, &repeated)) in tables.passes.iter().zip(&repeats).enumerate() {
            let of_earlier = pass_slots.get(repeated).copied();
            pass_slots.push(of_earlier.unwrap_or(next));
            if repeated == number {
                // Cannot overflow, because the sum was compared with the index's size above.
                next += usize::try_from(pass.tile_count_u64()).unwrap_or(0);
            }
        }
        let geometry = geometry::read(&container, &tables)?;
        let vertex_reads = vertex_reads::read(&container, &tables)?;
        Ok(Self {
            container,
            tables,
            index,
            pass_slots,
            geometry,
            vertex_reads,
        })
    }

    /// Meshes and views, if the trace was captured with geometry.
    pub fn geometry(&self) -> Option<&Geometry> {
        self.geometry.as_ref()
    }

    /// Texture reads of vertex shaders, in the order of execution; none in the trace of a scene.
    pub fn vertex_reads(&self) -> &[VertexDraw] {
        &self.vertex_reads
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

    /// Number of tiles with records whose bytes are stored for an earlier tile.
    pub fn shared_tiles(&self) -> u64 {
        let mut end = 0;
        let mut stored = 0;
        for span in self.index.iter().filter_map(IndexEntry::touched) {
            if span.offset == end {
                end += u64::from(span.bytes);
                stored += 1;
            }
        }
        let touched = |(&first, pass): (&usize, &Pass)| {
            let tiles = self
                .index
                .iter()
                .skip(first)
                .take(pass.tile_count() as usize);
            tiles.filter(|entry| entry.records > 0).count() as u64
        };
        let all: u64 = self
            .pass_slots
            .iter()
            .zip(&self.tables.passes)
            .map(touched)
            .sum();
        all - stored
    }

    /// Whether two passes have the same tiles: the same bytes in the same encoding.
    pub fn has_same_tiles(&self, a: usize, b: usize) -> bool {
        let [of_a, of_b] = [a, b].map(|pass| {
            let first = self.pass_slots.get(pass)?;
            let pass = self.tables.passes.get(pass)?;
            let entries = self.index.get(*first..first + pass.tile_count() as usize)?;
            Some((pass.tiles, entries))
        });
        let Some(((grid_a, of_a), (grid_b, of_b))) = of_a.zip(of_b) else {
            return false;
        };
        let place = |entry: &IndexEntry| (entry.span.bytes, entry.span.crc32);
        let facts = |entry: &IndexEntry| (place(entry), entry.records, entry.runs, entry.encoding);
        let alike = |(a, b): (&IndexEntry, &IndexEntry)| {
            (a.records, b.records) == (0, 0) || facts(a) == facts(b)
        };
        let same_bytes = |(a, b): (&IndexEntry, &IndexEntry)| {
            let bytes = |entry: &IndexEntry| TILE_CHUNK.stored(&self.container, &entry.span);
            a.span == b.span || bytes(a) == bytes(b)
        };
        // Checksums first, so that different passes differ soon.
        grid_a == grid_b
            && of_a.iter().zip(of_b).all(alike)
            && of_a.iter().zip(of_b).all(same_bytes)
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

/// For each pass the earlier pass whose tiles it has, or its own number: the start of the index of versions 4
/// and 5.
fn repeats(container: &Container, passes: &[Pass]) -> Result<Vec<usize>> {
    let bytes = container.chunk(TILE_INDEX)?;
    let (numbers, _) = bytes.as_chunks::<REPEAT_BYTES>();
    let malformed = |number: usize, expected: &str, found: String| {
        let at = (number * REPEAT_BYTES) as u64;
        container.malformed(TILE_INDEX, at, expected, found)
    };
    if numbers.len() < passes.len() {
        let found = format!("{} bytes", bytes.len());
        return Err(malformed(0, "a pass's number for each pass", found));
    }
    let mut repeats: Vec<usize> = Vec::with_capacity(passes.len());
    let mut of_each = vec![0u32; passes.len()];
    for (number, (pass, of)) in passes.iter().zip(numbers).enumerate() {
        let of = usize::try_from(u32::from_le_bytes(*of)).unwrap_or(usize::MAX);
        let has_entries = of == number || repeats.get(of) == Some(&of);
        let same_grid = passes
            .get(of)
            .is_some_and(|other| other.tiles == pass.tiles);
        if !has_entries || !same_grid {
            let expected =
                "its own number or that of an earlier pass of as many tiles that has its own";
            return Err(malformed(number, expected, of.to_string()));
        }
        if let Some(count) = of_each.get_mut(of).filter(|_| of != number) {
            *count += 1;
            if *count > MOST_REPEATS {
                let expected = format!("a pass that at most {MOST_REPEATS} others repeat");
                return Err(malformed(number, &expected, of.to_string()));
            }
        }
        repeats.push(of);
    }
    Ok(repeats)
}
