//! Counts of what a trace accesses: the same for every order and every cache.

use super::Accesses;
use crate::order::TileRef;
use formats::textrace::Tables;
use formats::textrace::tables::MAX_TEXTURE_SIZE;
use formats::view::Eye;

/// Left, right, and passes that belong to no eye.
const VIEWS: [&str; 3] = ["left", "right", "shared"];

/// Where things count: a number for each (view, texture, mip level), called a cell, and for each
/// tile. All counters of a replay are lists by these numbers.
#[derive(Debug)]
pub struct Bins {
    textures: usize,
    /// View by pass.
    views: Vec<usize>,
    /// First tile by pass; empty where tiles are not counted and all share one number.
    first_tiles: Vec<usize>,
    tiles: usize,
}

/// Where a quad counts: its view's first cell and its tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    first_cell: usize,
    pub(super) tile: usize,
}

/// What a cell stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Index into [`Bins::view_names`].
    pub view: usize,
    /// Index into the texture table.
    pub texture: usize,
    /// Mip level.
    pub level: usize,
}

impl Bins {
    /// Levels of the largest texture that a trace can have.
    pub const LEVELS: usize = MAX_TEXTURE_SIZE.ilog2() as usize + 1;

    /// Bins for the textures and passes of a trace.
    #[must_use]
    pub fn new(tables: &Tables, tile_maps: bool) -> Self {
        let mut tiles = 0;
        let mut first_tiles = Vec::new();
        for pass in &tables.passes {
            first_tiles.push(tiles);
            tiles += pass.tile_count() as usize;
        }
        if !tile_maps {
            (tiles, first_tiles) = (1, Vec::new());
        }
        let view = |eye| match eye {
            Some(Eye::Left) => 0,
            Some(Eye::Right) => 1,
            None => 2,
        };
        Self {
            textures: tables.textures.len(),
            views: tables.passes.iter().map(|pass| view(pass.eye)).collect(),
            first_tiles,
            tiles,
        }
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        VIEWS.len() * self.textures * Self::LEVELS
    }

    /// Number of tiles.
    #[must_use]
    pub fn tiles(&self) -> usize {
        self.tiles
    }

    /// First tile of each pass; empty if tiles are not counted.
    #[must_use]
    pub fn first_tiles(&self) -> &[usize] {
        &self.first_tiles
    }

    /// Names of the views.
    #[must_use]
    pub fn view_names(&self) -> [&'static str; 3] {
        VIEWS
    }

    /// True if a pass of the trace shows this view.
    #[must_use]
    pub fn has_view(&self, view: usize) -> bool {
        self.views.contains(&view)
    }

    /// What a cell stands for.
    #[must_use]
    pub fn meaning(&self, cell: usize) -> Cell {
        Cell {
            view: cell / (Self::LEVELS * self.textures),
            texture: cell / Self::LEVELS % self.textures,
            level: cell % Self::LEVELS,
        }
    }

    #[inline]
    pub(super) fn place(&self, at: TileRef) -> Place {
        let pass = at.pass as usize;
        let tile = self.first_tiles.get(pass);
        Place {
            first_cell: self.views[pass] * self.textures * Self::LEVELS,
            tile: tile.map_or(0, |first| first + at.tile as usize),
        }
    }

    #[inline(always)]
    pub(super) fn cell(&self, place: Place, texture: u32, level: u8) -> usize {
        place.first_cell + texture as usize * Self::LEVELS + usize::from(level)
    }
}

/// Accesses of one cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellAccesses {
    /// Bilinear footprints.
    pub footprints: u64,
    /// Distinct lines of a footprint, summed over footprints.
    pub line_lookups: u64,
}

/// Accesses of one tile.
#[derive(Clone, Copy, Debug, Default)]
pub struct TileAccesses {
    /// Covered lanes.
    pub lanes: u32,
    /// Footprints.
    pub footprints: u32,
}

/// All that is counted of a trace.
#[derive(Debug)]
pub struct TraceCounts {
    /// Quads.
    pub quads: u64,
    /// Covered lanes.
    pub lanes: u64,
    /// Hash of all line accesses, which does not depend on their order.
    pub hash: u64,
    /// By cell.
    pub cells: Vec<CellAccesses>,
    /// By tile.
    pub tiles: Vec<TileAccesses>,
}

impl TraceCounts {
    pub(super) fn new(bins: &Bins) -> Self {
        Self {
            quads: 0,
            lanes: 0,
            hash: 0,
            cells: vec![CellAccesses::default(); bins.cells()],
            tiles: vec![TileAccesses::default(); bins.tiles()],
        }
    }

    #[inline]
    pub(super) fn quad(&mut self, tile: usize, lanes: u32) {
        self.quads += 1;
        self.lanes += u64::from(lanes);
        let tile = &mut self.tiles[tile];
        tile.lanes = tile.lanes.wrapping_add(lanes);
    }

    #[inline(always)]
    pub(super) fn footprints(&mut self, cell: usize, tile: usize, accesses: &Accesses) {
        self.hash = self.hash.wrapping_add(accesses.hash);
        let cell = &mut self.cells[cell];
        cell.footprints += u64::from(accesses.footprints);
        cell.line_lookups += u64::from(accesses.line_lookups);
        let tile = &mut self.tiles[tile];
        tile.footprints = tile.footprints.wrapping_add(accesses.footprints);
    }
}
