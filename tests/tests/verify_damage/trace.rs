//! A trace in parts that can be changed.

use formats::textrace::geometry::{Geometry, TileLists};
use formats::textrace::{NO_GROUP, QuadRecord, Tables, Textrace, TextraceWriter, Tile};
use std::path::Path;

/// Shadow cascades of the scene.
pub const CASCADES: usize = 4;

/// Whose records are changed.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Records {
    /// Those of textures.
    Material,
    /// Look-ups of shadow maps.
    Shadow,
}

impl Records {
    /// Whether a record of a draw with that many groups is one of them; the last groups are the cascades'.
    fn has(self, record: &QuadRecord, groups: usize) -> bool {
        let of_material = usize::from(record.group) < groups - CASCADES;
        match self {
            Self::Material => of_material,
            Self::Shadow => !of_material && record.group != NO_GROUP,
        }
    }
}

/// The parts of a trace.
#[derive(Clone)]
pub struct Trace {
    pub tables: Tables,
    /// By pass.
    pub tiles: Vec<Vec<Tile>>,
    pub geometry: Geometry,
    /// By view.
    pub lists: Vec<TileLists>,
}

impl Trace {
    pub fn read(path: &Path) -> Self {
        let trace = Textrace::open(path).expect("a trace");
        let tables = trace.tables().clone();
        let tile = |pass, number| {
            let mut tile = Tile::default();
            trace.decode_tile(pass, number, &mut tile).expect("a tile");
            tile
        };
        let passes = tables.passes.iter().enumerate();
        let tiles = passes
            .map(|(pass, info)| {
                (0..info.tile_count() as usize)
                    .map(|n| tile(pass, n))
                    .collect()
            })
            .collect();
        let geometry = trace.geometry().expect("geometry").clone();
        let lists = |view| trace.tile_lists(view).expect("lists");
        Self {
            tables,
            tiles,
            lists: (0..geometry.views.len()).map(lists).collect(),
            geometry,
        }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let writer = TextraceWriter::in_memory(&self.tables).expect("sound tables");
        let mut writer = writer
            .with_geometry(self.geometry.clone())
            .expect("sound meshes");
        for (view, lists) in self.geometry.views.iter().zip(&self.lists) {
            writer.append_view(*view, lists).expect("sound lists");
        }
        for (pass, tiles) in self.tiles.iter().enumerate() {
            for (number, tile) in tiles.iter().enumerate() {
                writer.write_tile(pass, number, tile).expect("a sound tile");
            }
        }
        writer.into_bytes().expect("in memory")
    }

    /// Changes every record of the groups of materials, or of look-ups of shadow maps.
    pub fn each(&mut self, whose: Records, change: impl Fn(&mut QuadRecord)) {
        for tile in self.tiles.iter_mut().flatten() {
            for run in &tile.runs {
                let groups = self.tables.draws[run.draw as usize].groups.len();
                let records = &mut tile.records[run.first as usize..][..run.count as usize];
                let records = records.iter_mut();
                records.filter(|r| whose.has(r, groups)).for_each(&change);
            }
        }
    }

    /// Changes one fully covered record, in the middle of a picture.
    pub fn one(&mut self, whose: Records, change: impl FnOnce(&mut QuadRecord)) {
        self.run_of_one(whose, |records, at| change(&mut records[at]));
    }

    /// The same, with all records of its run.
    pub fn run_of_one(&mut self, whose: Records, change: impl FnOnce(&mut [QuadRecord], usize)) {
        for tile in self.tiles[0].iter_mut().skip(30) {
            for run in &tile.runs {
                let groups = self.tables.draws[run.draw as usize].groups.len();
                let records = &mut tile.records[run.first as usize..][..run.count as usize];
                let found = records.iter().position(|r| {
                    r.mask == 15 && whose.has(r, groups) && r.dx[0].abs() > 0 && r.x < 7
                });
                if let Some(at) = found {
                    change(records, at);
                    return;
                }
            }
        }
        panic!("no whole record");
    }

    /// A tile with several primitives, in the middle of the left picture.
    pub fn tile(&mut self) -> &mut Tile {
        let mut tiles = self.tiles[0].iter_mut().skip(30);
        tiles.find(|tile| tile.runs.len() > 2).expect("a tile")
    }

    /// Leaves out the first record of a run with several, or the only one with its run.
    pub fn remove_record(tile: &mut Tile, at: usize) {
        let at = at as u32;
        tile.records.remove(at as usize);
        for run in &mut tile.runs {
            if run.first > at {
                run.first -= 1;
            } else if at < run.first + run.count {
                run.count -= 1;
            }
        }
        tile.runs.retain(|run| run.count > 0);
    }

    /// Moves the last quad of a run, if fully covered.
    pub fn move_quad(&mut self, by: [u8; 2]) {
        for tile in self.tiles.iter_mut().flatten() {
            for run in &tile.runs {
                let records = &mut tile.records[run.first as usize..][..run.count as usize];
                let Some(&QuadRecord { x, y, .. }) = records.last() else {
                    continue;
                };
                let same = |r: &&mut QuadRecord| (r.x, r.y) == (x, y);
                let mut of_quad: Vec<_> = records.iter_mut().filter(same).collect();
                if x % 2 == 0 && y % 2 == 0 && of_quad.iter().all(|r| r.mask == 15) {
                    for record in &mut of_quad {
                        [record.x, record.y] = [x + by[0], y + by[1]];
                    }
                    return;
                }
            }
        }
        panic!("no quad that may move");
    }

    /// Gives the next primitive's number to a run with a fully covered quad.
    pub fn next_primitive(&mut self) {
        let draws = &self.tables.draws;
        for tile in self.tiles.iter_mut().flatten() {
            for position in 0..tile.runs.len() {
                let run = tile.runs[position];
                let draw = &draws[run.draw as usize];
                let following = tile.runs.get(position + 1).map(|next| next.primitive);
                let is_free = following != Some(run.primitive + 1)
                    && run.primitive + 1 < draw.first_primitive + draw.primitives;
                let records = &tile.records[run.first as usize..][..run.count as usize];
                if is_free && records.iter().any(|r| r.mask == 15) {
                    tile.runs[position].primitive += 1;
                    return;
                }
            }
        }
        panic!("no run that may have another primitive");
    }

    /// Replaces the list of a tile of a view.
    pub fn replace(&mut self, view: usize, tile: usize, list: &[u32]) {
        let lists = &mut self.lists[view];
        let range = lists.starts[tile] as usize..lists.starts[tile + 1] as usize;
        let more = list.len() as i64 - range.len() as i64;
        lists.primitives.splice(range, list.iter().copied());
        for start in &mut lists.starts[tile + 1..] {
            *start = (i64::from(*start) + more) as u32;
        }
    }

    /// The shadow cascade with most look-ups.
    pub fn most_looked_up(&self) -> u32 {
        let mut counts = [0; CASCADES];
        for tile in self.tiles.iter().flatten() {
            for run in &tile.runs {
                let first = self.tables.draws[run.draw as usize].groups.len() - CASCADES;
                for record in &tile.records[run.first as usize..][..run.count as usize] {
                    let cascade = usize::from(record.group).checked_sub(first);
                    if let Some(count) = cascade.and_then(|cascade| counts.get_mut(cascade)) {
                        *count += 1;
                    }
                }
            }
        }
        let most = (0..CASCADES).max_by_key(|cascade| counts[*cascade]);
        most.unwrap_or(0) as u32
    }

    /// The draw of a primitive.
    pub fn draw_of(&self, primitive: u32) -> u32 {
        let draws = &self.tables.draws;
        draws.partition_point(|draw| draw.first_primitive <= primitive) as u32 - 1
    }

    /// Leaves a draw and its primitives out of the lists of a view.
    pub fn leave_out(&mut self, view: usize, draw: u32) {
        self.lists[view].draws.retain(|other| *other != draw);
        for tile in 0..self.lists[view].starts.len() - 1 {
            let list = self.lists[view].tile(tile).iter().copied();
            let kept: Vec<u32> = list.filter(|p| self.draw_of(*p) != draw).collect();
            self.replace(view, tile, &kept);
        }
    }
}
