//! Sources of tiles: a file, or memory (tests, benchmarks, generated traces).

use super::StreamError;
use formats::textrace::geometry::{Geometry, TileLists};
use formats::textrace::{Tables, Textrace, Tile};
use formats::view::TILE_SIZE_PX;

/// A trace that can be read tile by tile.
pub trait TileSource: Sync {
    /// Its tables.
    fn tables(&self) -> &Tables;

    /// Number of quad records of all tiles, as a measure of work. Includes records that reading leaves out.
    fn records(&self) -> u64;

    /// Width and height of a tile.
    fn tile_px(&self) -> u32 {
        TILE_SIZE_PX
    }

    /// Decodes a tile into `tile`, reusing its allocations.
    ///
    /// # Errors
    /// The tile does not exist or is damaged.
    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError>;

    /// Whether two passes have the same tiles. False if that is unknown.
    fn has_same_tiles(&self, _a: u32, _b: u32) -> bool {
        false
    }

    /// Meshes and views of a trace with geometry.
    fn geometry(&self) -> Option<&Geometry> {
        None
    }

    /// The primitive lists of a view of [`Self::geometry`].
    ///
    /// # Errors
    /// The view does not exist or is damaged.
    fn tile_lists(&self, view: usize) -> Result<TileLists, StreamError> {
        Err(StreamError::Tables(format!(
            "view {view} has no primitive lists"
        )))
    }
}

/// A trace in memory.
#[derive(Clone, Debug)]
pub struct MemoryTrace {
    /// Tables.
    pub tables: Tables,
    /// Tiles by pass.
    pub tiles: Vec<Vec<Tile>>,
}

impl TileSource for MemoryTrace {
    fn tables(&self) -> &Tables {
        &self.tables
    }

    fn records(&self) -> u64 {
        let tiles = self.tiles.iter().flatten();
        tiles.map(|tile| tile.records.len() as u64).sum()
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        let stored = self
            .tiles
            .get(pass as usize)
            .and_then(|tiles| tiles.get(index as usize))
            .ok_or_else(|| StreamError::Tile {
                pass,
                tile: index,
                message: "no such tile".to_owned(),
            })?;
        tile.runs.clone_from(&stored.runs);
        tile.records.clone_from(&stored.records);
        Ok(())
    }

    fn has_same_tiles(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|pass| self.tiles.get(pass as usize));
        a.is_some() && a == b
    }
}

impl TileSource for Textrace {
    fn tables(&self) -> &Tables {
        self.tables()
    }

    fn records(&self) -> u64 {
        self.records()
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        Ok(self.decode_tile(pass as usize, index as usize, tile)?)
    }

    fn has_same_tiles(&self, a: u32, b: u32) -> bool {
        self.has_same_tiles(a as usize, b as usize)
    }

    fn geometry(&self) -> Option<&Geometry> {
        self.geometry()
    }

    fn tile_lists(&self, view: usize) -> Result<TileLists, StreamError> {
        Ok(self.tile_lists(view)?)
    }
}
