//! Writes a `.textrace`.

use super::geometry::{Geometry, GeometryView, Spool, TileLists};
use super::index::IndexEntry;
use super::sharing::{StoredTiles, repeated_passes};
use super::{
    Draw, Encoding, Pass, Tables, Tile, TraceMeta, VertexDraw, delta, invariant, planes, raw,
    tables, vertex_reads,
};
use crate::container::{
    AtomicFile, ContainerWriter, Kind, MAJOR_1, MAJOR_2, MAJOR_3, MAJOR_4, MAJOR_5,
};
use crate::error::{Broken, FormatError, Result};
use crate::records;
use crate::texture::{Part, Sampler, Texture};
use crate::tiles::TileSpan;
use std::io::{Cursor, Seek, Write};
use std::path::Path;

/// A tile's bytes, ready to be appended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EncodedTile {
    pub(super) encoding: Encoding,
    pub(super) records: u32,
    pub(super) runs: u32,
    pub(super) crc32: u32,
    pub(super) bytes: Vec<u8>,
}

impl EncodedTile {
    /// Encoded size.
    pub fn size_bytes(&self) -> usize {
        self.bytes.len()
    }

    /// The encoded bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Encodes a tile in the default encoding. A pure function, so that tiles can be encoded in parallel.
///
/// # Errors
/// The tile violates an invariant of the format.
pub fn encode_tile(tables: &Tables, tile: &Tile) -> Result<EncodedTile> {
    encode_tile_as(Encoding::default(), tables, tile)
}

/// Encodes a tile in a chosen encoding.
///
/// # Errors
/// The tile violates an invariant of the format.
pub fn encode_tile_as(encoding: Encoding, tables: &Tables, tile: &Tile) -> Result<EncodedTile> {
    invariant::check(&tables.draws, tile).map_err(Broken::unwritable)?;
    if tile.records.is_empty() {
        return Ok(EncodedTile::default());
    }
    let bytes = match encoding {
        Encoding::Raw => raw::encode(tile),
        Encoding::Delta => delta::encode(tile),
        Encoding::Planes => planes::encode(tile),
    };
    let too_many = |_| {
        let found = format!("{} records in {} bytes", tile.records.len(), bytes.len());
        Broken::new("tile", "less than 2^32 bytes", found).unwritable()
    };
    u32::try_from(bytes.len()).map_err(too_many)?;
    Ok(EncodedTile {
        encoding,
        records: u32::try_from(tile.records.len()).map_err(too_many)?,
        runs: u32::try_from(tile.runs.len()).map_err(too_many)?,
        crc32: crc32fast::hash(&bytes),
        bytes,
    })
}

/// Writes a trace, tiles in ascending order of pass and tile.
///
/// The tables come before the tiles if they are complete before the first tile and version 1 has all their
/// features. Otherwise they come after the tiles and can grow until then.
#[derive(Debug)]
pub struct TextraceWriter<W = AtomicFile> {
    container: ContainerWriter<W>,
    /// Whether the tables come after the tiles.
    tables_last: bool,
    tables: Tables,
    index: Vec<IndexEntry>,
    stored: StoredTiles,
    /// First index slot that the next tile may have.
    next_slot: usize,
    tile_bytes: u64,
    encoding: Encoding,
    geometry: Option<Spool>,
    vertex_reads: Vec<VertexDraw>,
}

impl TextraceWriter<AtomicFile> {
    /// Starts a trace; [`Self::finish`] renames it to `path`.
    ///
    /// # Errors
    /// The tables violate a rule of the format, or the file cannot be written.
    pub fn create(path: &Path, tables: &Tables) -> Result<Self> {
        Self::start(ContainerWriter::create(path, Kind::Textrace)?, tables)
    }

    /// Starts a trace with empty tables, which grow while tiles are written. [`Self::finish`] renames it to
    /// `path`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create_growing(path: &Path) -> Result<Self> {
        let container = ContainerWriter::create(path, Kind::Textrace)?;
        Self::start_with(true, container, &Tables::default())
    }

    /// Completes the file. Returns its size in bytes.
    ///
    /// # Errors
    /// Writing failed; no file is left.
    pub fn finish(self) -> Result<u64> {
        self.seal()?.finish()
    }
}

impl TextraceWriter<Cursor<Vec<u8>>> {
    /// Starts a trace in memory.
    ///
    /// # Errors
    /// The tables violate a rule of the format.
    pub fn in_memory(tables: &Tables) -> Result<Self> {
        Self::start(ContainerWriter::in_memory(Kind::Textrace)?, tables)
    }

    /// Starts a trace in memory without tables: see [`TextraceWriter::create_growing`].
    ///
    /// # Errors
    /// None in practice; the signature matches that for files.
    pub fn growing_in_memory() -> Result<Self> {
        let container = ContainerWriter::in_memory(Kind::Textrace)?;
        Self::start_with(true, container, &Tables::default())
    }

    /// Completes the trace.
    ///
    /// # Errors
    /// See [`Self::in_memory`].
    pub fn into_bytes(self) -> Result<Vec<u8>> {
        self.seal()?.into_bytes()
    }
}

impl<W: Write + Seek> TextraceWriter<W> {
    fn start(container: ContainerWriter<W>, tables: &Tables) -> Result<Self> {
        Self::start_with(tables::major_of(tables) > MAJOR_1, container, tables)
    }

    fn start_with(
        tables_last: bool,
        mut container: ContainerWriter<W>,
        tables: &Tables,
    ) -> Result<Self> {
        if !tables_last {
            tables::write(MAJOR_1, tables, &mut container)?;
        } else if *tables != Tables::default() {
            // Report errors of the tables before the work. A growing trace has no tables yet.
            tables::check_writable(tables)?;
        }
        container.begin_chunk(super::TILES)?;
        let slots: u64 = tables.passes.iter().map(Pass::tile_count_u64).sum();
        let tiles = usize::try_from(slots).map_err(|_| too_many_tiles(slots))?;
        Ok(Self {
            container,
            tables_last,
            tables: tables.clone(),
            index: vec![IndexEntry::default(); tiles],
            stored: StoredTiles::default(),
            next_slot: 0,
            tile_bytes: 0,
            encoding: Encoding::default(),
            geometry: None,
            vertex_reads: Vec::new(),
        })
    }

    /// The current tables.
    pub fn tables(&self) -> &Tables {
        &self.tables
    }

    /// The tables of a trace whose tables come last, to be extended. They are checked when the trace is
    /// completed.
    ///
    /// # Errors
    /// The tables have been written.
    fn growing(&mut self, what: &str) -> Result<&mut Tables> {
        match self.tables_last {
            true => Ok(&mut self.tables),
            false => {
                let expected = "a trace whose tables come last";
                Err(Broken::new(what, expected, "tables that have been written").unwritable())
            }
        }
    }

    /// Sets the description.
    ///
    /// # Errors
    /// The tables have been written.
    pub fn set_meta(&mut self, meta: TraceMeta) -> Result<()> {
        self.growing("a description")?.meta = meta;
        Ok(())
    }

    /// Sets the texture reads of vertex shaders, in the order of execution.
    ///
    /// # Errors
    /// The tables have been written.
    pub fn set_vertex_reads(&mut self, draws: Vec<VertexDraw>) -> Result<()> {
        self.growing("vertex reads")?;
        self.vertex_reads = draws;
        Ok(())
    }

    /// Adds a texture and returns its index.
    ///
    /// # Errors
    /// The tables have been written, or there are too many.
    pub fn add_texture(&mut self, texture: Texture) -> Result<u32> {
        let textures = &mut self.growing("a texture")?.textures;
        textures.push(texture);
        index_of_last("texture", textures.len())
    }

    /// Makes a texture a part of another one, or a texture of its own.
    ///
    /// # Errors
    /// The tables have been written, or there is no such texture.
    pub fn set_part(&mut self, texture: u32, part: Option<Part>) -> Result<()> {
        let what = "a part of a texture";
        let textures = &mut self.growing(what)?.textures;
        let found = textures.get_mut(texture as usize);
        found
            .map(|found| found.part = part)
            .ok_or_else(|| Broken::new(what, "a texture of the trace", texture).unwritable())
    }

    /// Adds a sampler and returns its index.
    ///
    /// # Errors
    /// The tables have been written, or there are too many.
    pub fn add_sampler(&mut self, sampler: Sampler) -> Result<u16> {
        let samplers = &mut self.growing("a sampler")?.samplers;
        samplers.push(sampler);
        index_of_last("sampler", samplers.len())
    }

    /// Adds a draw and returns its index.
    ///
    /// # Errors
    /// The tables have been written, or there are too many.
    pub fn add_draw(&mut self, draw: Draw) -> Result<u32> {
        let draws = &mut self.growing("a draw")?.draws;
        draws.push(draw);
        index_of_last("draw", draws.len())
    }

    /// Adds a pass and returns its index.
    ///
    /// # Errors
    /// The tables have been written, or the pass has too many tiles.
    pub fn add_pass(&mut self, pass: Pass) -> Result<usize> {
        let tiles = usize::try_from(pass.tile_count_u64()).ok();
        let slots = tiles.and_then(|tiles| self.index.len().checked_add(tiles));
        let slots = slots.ok_or_else(|| too_many_tiles(pass.tile_count_u64()))?;
        let passes = &mut self.growing("a pass")?.passes;
        passes.push(pass);
        let number = passes.len() - 1;
        self.index.resize(slots, IndexEntry::default());
        Ok(number)
    }

    /// Adds geometry: its meshes and draws now, its views by [`Self::append_view`].
    ///
    /// # Errors
    /// The geometry violates a rule of the format.
    pub fn with_geometry(mut self, geometry: Geometry) -> Result<Self> {
        self.geometry = Some(Spool::new(geometry, &self.tables)?);
        Ok(self)
    }

    /// Whether the trace has geometry.
    pub fn has_geometry(&self) -> bool {
        self.geometry.is_some()
    }

    /// Appends the primitive lists of a view, in rendering order. Ignored without geometry.
    ///
    /// # Errors
    /// The lists violate a rule of the format, or cannot be stored.
    pub fn append_view(&mut self, view: GeometryView, lists: &TileLists) -> Result<()> {
        match &mut self.geometry {
            Some(spool) => spool.append(&self.tables, view, lists),
            None => Ok(()),
        }
    }

    /// Sets the encoding of tiles.
    #[must_use]
    pub fn with_encoding(self, encoding: Encoding) -> Self {
        Self { encoding, ..self }
    }

    /// The encoding to use for tiles passed to [`Self::append`].
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Encodes and appends one tile.
    ///
    /// # Errors
    /// The tile violates an invariant, is out of order, or cannot be written.
    pub fn write_tile(&mut self, pass: usize, tile_index: usize, tile: &Tile) -> Result<()> {
        let encoded = encode_tile_as(self.encoding, &self.tables, tile)?;
        self.append(pass, tile_index, encoded)
    }

    /// Appends an encoded tile. Tiles must be in ascending order of pass and tile; untouched tiles may be
    /// left out.
    ///
    /// # Errors
    /// The tile does not exist, is out of order, or cannot be written.
    pub fn append(&mut self, pass: usize, tile_index: usize, tile: EncodedTile) -> Result<()> {
        let unwritable = |expected: String| {
            Broken::new(format!("tile {tile_index} of pass {pass}"), expected, "it").unwritable()
        };
        let passes = &self.tables.passes;
        let tiles = passes.get(pass).map_or(0, Pass::tile_count_u64);
        if tile_index as u64 >= tiles {
            return Err(unwritable(format!("one of {tiles} tiles")));
        }
        let before: u64 = passes.iter().take(pass).map(Pass::tile_count_u64).sum();
        let slot = usize::try_from(before).unwrap_or(usize::MAX) + tile_index;
        if slot < self.next_slot {
            return Err(unwritable("tiles in ascending order".to_owned()));
        }
        self.next_slot = slot + 1;
        if tile.records == 0 {
            return Ok(());
        }
        let entry = IndexEntry {
            span: TileSpan {
                offset: self.tile_bytes,
                bytes: tile.bytes.len() as u32,
                crc32: tile.crc32,
            },
            records: tile.records,
            runs: tile.runs,
            encoding: tile.encoding,
        };
        self.index[slot] = self.stored.entry(&tile.bytes, entry);
        if self.index[slot] != entry {
            return Ok(());
        }
        self.tile_bytes += tile.bytes.len() as u64;
        self.container.append(&tile.bytes)
    }

    fn seal(mut self) -> Result<ContainerWriter<W>> {
        let shares = self.stored.has_shared();
        let mut bytes = Vec::new();
        let mut first = 0;
        let repeats = shares.then(|| repeated_passes(&self.tables.passes, &self.index));
        for (number, pass) in (0..).zip(&self.tables.passes) {
            let end = first + pass.tile_count() as usize;
            let of_pass = first..end;
            first = end;
            let repeated = repeats.as_ref().map_or(number, |all| all[number as usize]);
            if repeated == number {
                for entry in &self.index[of_pass] {
                    records::write(MAJOR_2, entry, &mut bytes)?;
                }
            }
        }
        if let Some(repeats) = repeats {
            let numbers = repeats.iter().flat_map(|number| number.to_le_bytes());
            bytes = numbers.chain(bytes).collect();
        }
        self.container.chunk(super::TILE_INDEX, &bytes)?;
        if self.tables_last {
            let major = match shares {
                true => MAJOR_3,
                false => tables::major_of(&self.tables).max(MAJOR_2),
            };
            tables::write(major, &self.tables, &mut self.container)?;
        }
        if let Some(spool) = self.geometry {
            spool.write(&self.tables, &mut self.container)?;
        }
        if shares {
            let major = if self.tables_last { MAJOR_5 } else { MAJOR_4 };
            self.container.set_major(major);
        }
        vertex_reads::write(&self.vertex_reads, &self.tables, &mut self.container)?;
        Ok(self.container)
    }
}

fn too_many_tiles(tiles: u64) -> FormatError {
    let expected = "a number of tiles that fits in memory";
    Broken::new("tile index", expected, tiles).unwritable()
}

fn index_of_last<T: TryFrom<usize>>(what: &str, entries: usize) -> Result<T> {
    T::try_from(entries - 1).map_err(|_| {
        let expected = "entries that their indices can name";
        Broken::new(format!("{what} table"), expected, entries).unwritable()
    })
}
