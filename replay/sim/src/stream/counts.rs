//! Counts of a trace's accesses, which are the same for every order and every cache.

use super::StreamError;
use super::tag::Tag;
use crate::config::CountBy;
use crate::order::TileRef;
use formats::textrace::Tables;
use formats::view::Eye;

/// Left, right, and passes shared by both eyes.
const VIEWS: [&str; 3] = ["left", "right", "shared"];

/// The bins of all counters. Each (view, texture, mip level) or (view, draw) has a number, called a cell,
/// and so has each tile. All counters of a replay are indexed by these numbers.
#[derive(Debug)]
pub struct Bins {
    by: CountBy,
    /// First cell of each texture or draw within a view, and the number of cells per view.
    first_levels: Vec<usize>,
    /// View by pass.
    views: Vec<usize>,
    /// First tile by pass.
    first_tiles: Vec<usize>,
    tiles: usize,
}

/// The bins of a tile: first cell of its view, and tile number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct TileBins {
    pub(super) first_cell: u32,
    pub(super) tile: u32,
}

/// The meaning of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Index into [`Bins::view_names`].
    pub view: usize,
    /// Index into the texture table or the draw table.
    pub part: usize,
    /// Mip level; 0 if counts are by draw.
    pub level: usize,
}

impl Bins {
    /// Bins for the textures and passes of a trace.
    ///
    /// # Errors
    /// More mip levels than a [`Tag`] can hold, or more than 2^32 tiles.
    pub fn new(tables: &Tables, by: CountBy) -> Result<Self, StreamError> {
        let mut first_levels = vec![0];
        let mut levels = 0;
        let textures = tables
            .textures
            .iter()
            .map(|texture| texture.levels as usize);
        let of_each: Vec<usize> = match by {
            CountBy::Texture => textures.collect(),
            CountBy::Draw => vec![1; tables.draws.len()],
        };
        for cells in of_each {
            levels += cells;
            first_levels.push(levels);
        }
        if levels > Tag::CELLS {
            return Err(StreamError::Tables(format!(
                "textures have {levels} levels or draws: expected at most {}",
                Tag::CELLS
            )));
        }
        let mut tiles = 0;
        let mut first_tiles = Vec::new();
        for pass in &tables.passes {
            first_tiles.push(tiles);
            tiles += pass.tile_count() as usize;
        }
        if u32::try_from(tiles).is_err() {
            return Err(StreamError::Tables(format!(
                "passes have {tiles} tiles: expected fewer than 2^32"
            )));
        }
        let view = |eye| match eye {
            Some(Eye::Left) => 0,
            Some(Eye::Right) => 1,
            None => 2,
        };
        Ok(Self {
            by,
            first_levels,
            views: tables.passes.iter().map(|pass| view(pass.eye)).collect(),
            first_tiles,
            tiles,
        })
    }

    /// One cell per kind of access, for lines without tiles.
    pub fn of_kinds() -> Self {
        Self {
            by: CountBy::Texture,
            first_levels: vec![0, 1],
            views: Vec::new(),
            first_tiles: Vec::new(),
            tiles: 0,
        }
    }

    /// Cells per view.
    fn view_cells(&self) -> usize {
        self.first_levels.last().copied().unwrap_or(0)
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        VIEWS.len() * self.view_cells()
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.tiles
    }

    /// First tile of each pass.
    pub fn first_tiles(&self) -> &[usize] {
        &self.first_tiles
    }

    /// Names of the views.
    pub fn view_names(&self) -> [&'static str; 3] {
        VIEWS
    }

    /// True if a pass of the trace belongs to this view.
    pub fn has_view(&self, view: usize) -> bool {
        self.views.contains(&view)
    }

    /// The meaning of a cell.
    pub fn meaning(&self, cell: usize) -> Cell {
        let (view, within) = (cell / self.view_cells(), cell % self.view_cells());
        // Textures without levels share their first cell with the next texture that has levels.
        let part = self.first_levels.partition_point(|&first| first <= within) - 1;
        Cell {
            view,
            part,
            level: within - self.first_levels[part],
        }
    }

    pub(super) fn place(&self, at: TileRef) -> TileBins {
        TileBins {
            first_cell: self.first_cell(at) as u32,
            tile: self.tile(at) as u32,
        }
    }

    /// First cell of the tile's view.
    pub(super) fn first_cell(&self, at: TileRef) -> usize {
        self.views[at.pass as usize] * self.view_cells()
    }

    /// Number of the tile.
    pub(super) fn tile(&self, at: TileRef) -> usize {
        self.first_tiles[at.pass as usize] + at.tile as usize
    }

    /// Cell within a view.
    #[inline(always)]
    pub(super) fn cell(&self, draw: u32, texture: u32, level: u8) -> u32 {
        match self.by {
            CountBy::Texture => (self.first_levels[texture as usize] + usize::from(level)) as u32,
            CountBy::Draw => draw,
        }
    }
}

/// Accesses of one cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellAccesses {
    /// Bilinear footprints.
    pub footprints: u64,
    /// Distinct lines per footprint, summed over footprints.
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

/// All counts of a trace.
#[derive(Clone, Debug)]
pub struct TraceCounts {
    /// Quads.
    pub quads: u64,
    /// Covered lanes.
    pub lanes: u64,
    /// Order-independent hash of all line accesses.
    pub hash: u64,
    /// Distinct lines.
    pub unique_lines: u64,
    /// By cell.
    pub cells: Vec<CellAccesses>,
    /// By tile.
    pub tiles: Vec<TileAccesses>,
}

impl TraceCounts {
    /// All zero.
    pub fn new(bins: &Bins) -> Self {
        Self {
            tiles: vec![TileAccesses::default(); bins.tiles()],
            ..Self::without_tiles(bins)
        }
    }

    /// Counts of a worker thread.
    pub(super) fn without_tiles(bins: &Bins) -> Self {
        Self {
            quads: 0,
            lanes: 0,
            hash: 0,
            unique_lines: 0,
            cells: vec![CellAccesses::default(); bins.cells()],
            tiles: Vec::new(),
        }
    }

    /// Adds the counts of a worker thread.
    pub(super) fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, quads, lanes);
        self.hash = self.hash.wrapping_add(other.hash);
        for (cell, other) in self.cells.iter_mut().zip(&other.cells) {
            formats::add_fields!(cell, other, footprints, line_lookups);
        }
    }

    /// The sums over all tiles.
    pub(super) fn sums(&self) -> Self {
        Self {
            cells: self.cells.clone(),
            tiles: Vec::new(),
            ..*self
        }
    }

    /// What was counted since the sums were `before`.
    pub(super) fn since(&self, before: &Self) -> Self {
        let cells = self.cells.iter().zip(&before.cells);
        let counted = |(now, before): (&CellAccesses, &CellAccesses)| CellAccesses {
            footprints: now.footprints - before.footprints,
            line_lookups: now.line_lookups - before.line_lookups,
        };
        Self {
            quads: self.quads - before.quads,
            lanes: self.lanes - before.lanes,
            hash: self.hash.wrapping_sub(before.hash),
            unique_lines: 0,
            cells: cells.map(counted).collect(),
            tiles: Vec::new(),
        }
    }

    /// Copies the counts of a pass's tiles from another pass with as many.
    pub(super) fn repeat_tiles(&mut self, bins: &Bins, to: u32, from: u32) {
        let first = |pass: u32| bins.first_tiles[pass as usize];
        let end = |pass: u32| bins.first_tiles.get(pass as usize + 1).copied();
        let tiles = first(from)..end(from).unwrap_or(bins.tiles);
        self.tiles.copy_within(tiles, first(to));
    }
}
