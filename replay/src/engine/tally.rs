//! Counters of a replay, by view, texture, level and tile.

use crate::order::TileRef;
use crate::result::{LevelCounters, LevelResult, Part, RunResult, TileMap};
use formats::textrace::Tables;
use formats::textrace::tables::MAX_TEXTURE_SIZE;
use formats::view::{Eye, TILE_SIZE_PX};

/// Levels of the largest texture that a trace can have.
const LEVELS: usize = MAX_TEXTURE_SIZE.ilog2() as usize + 1;
/// Left, right, and passes that belong to no eye.
const VIEWS: usize = 3;

/// L1 and L2 counters of one (view, texture, level).
#[derive(Clone, Copy, Debug, Default)]
pub struct Cell {
    /// First level.
    pub l1: LevelCounters,
    /// Second level.
    pub l2: LevelCounters,
}

/// Counts of one tile.
#[derive(Clone, Copy, Debug, Default)]
pub struct TileCell {
    /// Covered lanes.
    pub lanes: u32,
    /// Footprints.
    pub footprints: u32,
    /// Footprints with an L1 miss.
    pub l1_misses: u32,
    /// Lines fetched from memory.
    pub l2_misses: u32,
}

/// All counters of a replay.
#[derive(Debug)]
pub struct Tally {
    cells: Vec<Cell>,
    textures: usize,
    /// View by pass.
    views: Vec<u8>,
    /// First tile of each pass in `tiles`.
    first_tile: Vec<usize>,
    tiles: Vec<TileCell>,
    tile_maps: bool,
    /// Lines seen, one bit each.
    seen: Vec<u64>,
    /// Order-independent hash of all line accesses.
    pub hash: u64,
    /// Quads replayed.
    pub quads: u64,
    /// Covered lanes.
    pub lanes: u64,
}

/// Where a quad counts: its view's cells and its tile.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    view: usize,
    tile: usize,
}

impl Tally {
    /// All zero, for addresses of `lines` lines.
    #[must_use]
    pub fn new(tables: &Tables, lines: u64, tile_maps: bool) -> Self {
        let mut first_tile = Vec::with_capacity(tables.passes.len());
        let mut tiles = 0;
        for pass in &tables.passes {
            first_tile.push(tiles);
            tiles += pass.tile_count() as usize;
        }
        let textures = tables.textures.len();
        Self {
            cells: vec![Cell::default(); VIEWS * textures * LEVELS],
            textures,
            views: tables
                .passes
                .iter()
                .map(|pass| match pass.eye {
                    Some(Eye::Left) => 0,
                    Some(Eye::Right) => 1,
                    None => 2,
                })
                .collect(),
            first_tile,
            tiles: vec![TileCell::default(); if tile_maps { tiles } else { 1 }],
            tile_maps,
            seen: vec![0; lines.div_ceil(64) as usize],
            hash: 0,
            quads: 0,
            lanes: 0,
        }
    }

    /// Counts a quad and says where its accesses count.
    #[inline]
    pub fn quad(&mut self, at: TileRef, lanes: u32) -> Place {
        self.quads += 1;
        self.lanes += u64::from(lanes);
        let pass = at.pass as usize;
        let tile = if self.tile_maps {
            self.first_tile[pass] + at.tile as usize
        } else {
            0
        };
        self.tiles[tile].lanes = self.tiles[tile].lanes.wrapping_add(lanes);
        Place {
            view: usize::from(self.views[pass]) * self.textures * LEVELS,
            tile,
        }
    }

    /// Index of the cell of a texture's level.
    #[inline(always)]
    #[must_use]
    pub fn cell_index(&self, place: Place, texture: u32, level: u8) -> usize {
        place.view + texture as usize * LEVELS + usize::from(level)
    }

    /// The cell at an index.
    #[inline(always)]
    pub fn cell(&mut self, index: usize) -> &mut Cell {
        &mut self.cells[index]
    }

    /// The tile of a place.
    #[inline(always)]
    pub fn tile(&mut self, place: Place) -> &mut TileCell {
        &mut self.tiles[place.tile]
    }

    /// Marks a line as touched. Only first-level misses need to: a line's first access is one.
    #[inline(always)]
    pub fn touch(&mut self, line: u32) {
        self.seen[line as usize / 64] |= 1 << (line % 64);
    }

    /// Sums everything up; `line_bytes` turns misses into traffic.
    #[must_use]
    pub fn finish(self, tables: &Tables, line_bytes: u32) -> RunResult {
        let part = |name: String, pick: &dyn Fn(usize, usize, usize) -> bool| {
            let mut part = Part {
                name,
                ..Part::default()
            };
            for (index, cell) in self.cells.iter().enumerate() {
                let (level, texture) = (index % LEVELS, index / LEVELS % self.textures);
                if pick(index / (LEVELS * self.textures), texture, level) {
                    part.l1.add(&cell.l1);
                    part.l2.add(&cell.l2);
                }
            }
            part
        };
        let all = part(String::new(), &|_, _, _| true);
        let views = ["left", "right", "shared"];
        let by_view = (0..VIEWS)
            .filter(|&view| self.views.iter().any(|&v| usize::from(v) == view))
            .map(|view| part(views[view].to_owned(), &|v, _, _| v == view))
            .collect();
        let mut by_texture: Vec<Part> = tables
            .textures
            .iter()
            .map(|texture| Part {
                name: texture.name.clone(),
                ..Part::default()
            })
            .collect();
        for (index, cell) in self.cells.iter().enumerate() {
            let part = &mut by_texture[index / LEVELS % self.textures];
            part.l1.add(&cell.l1);
            part.l2.add(&cell.l2);
        }
        let levels = tables
            .textures
            .iter()
            .map(|t| t.levels as usize)
            .max()
            .unwrap_or(0);
        let by_level = (0..levels)
            .map(|level| part(format!("level {level}"), &|_, _, l| l == level))
            .collect();
        let rate = |part: u64, whole: u64| {
            if whole == 0 {
                0.0
            } else {
                part as f64 / whole as f64
            }
        };
        RunResult {
            quads: self.quads,
            lanes: self.lanes,
            footprints: all.l1.footprints,
            l1: LevelResult {
                miss_rate: rate(all.l1.footprint_misses, all.l1.footprints),
                misses: all.l1.line_misses,
                counters: all.l1,
            },
            l2: LevelResult {
                miss_rate: rate(all.l2.line_misses, all.l2.line_lookups),
                misses: all.l2.line_misses,
                counters: all.l2,
            },
            external_bytes: all.l2.line_misses * u64::from(line_bytes),
            unique_lines: self
                .seen
                .iter()
                .map(|word| u64::from(word.count_ones()))
                .sum(),
            access_hash: format!("{:016x}", self.hash),
            tmu: None,
            cycles: None,
            by_view,
            by_texture,
            by_level,
            tile_maps: self.tile_maps(tables),
        }
    }

    fn tile_maps(&self, tables: &Tables) -> Vec<TileMap> {
        if !self.tile_maps {
            return Vec::new();
        }
        let maps = tables.passes.iter().zip(&self.first_tile).enumerate();
        maps.map(|(index, (pass, &first))| {
            let tiles = &self.tiles[first..first + pass.tile_count() as usize];
            // The last tiles are cut by the image's edge.
            let pixels = |tile: usize| {
                let at = [tile as u32 % pass.tiles[0], tile as u32 / pass.tiles[0]];
                let side = |axis: usize| {
                    pass.size_px[axis]
                        .saturating_sub(at[axis] * TILE_SIZE_PX)
                        .min(TILE_SIZE_PX)
                };
                (side(0) * side(1)).max(1) as f32
            };
            TileMap {
                pass: index as u32,
                tiles: pass.tiles,
                overdraw: tiles
                    .iter()
                    .enumerate()
                    .map(|(i, t)| t.lanes as f32 / pixels(i))
                    .collect(),
                footprints: tiles.iter().map(|t| t.footprints).collect(),
                l1_misses: tiles.iter().map(|t| t.l1_misses).collect(),
                l2_misses: tiles.iter().map(|t| t.l2_misses).collect(),
            }
        })
        .collect()
    }
}

/// Hash of one line access; accesses are summed, so their order does not matter.
#[inline(always)]
#[must_use]
pub fn access_hash(line: u32) -> u64 {
    let mixed = (u64::from(line) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93)
}
