//! When the tiles of a frame were rendered.

use super::pack::{Packed, packed};
use sim::result::{TileMap, Timeline};

/// The tiles of a frame in an order.
pub(super) struct Times {
    /// First and last cycle of the frame.
    pub cycles: [u64; 2],
    /// Pass, tile, core, start and end.
    tiles: Vec<(u32, u32, u32, [u64; 2])>,
}

/// The tiles of a pass: core, start since that of the frame, and length, in cycles.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub(super) struct PassTimes {
    core: Packed,
    start: Packed,
    cycles: Packed,
}

impl Times {
    pub fn new(timeline: Option<&Timeline>, passes: &[u32]) -> Self {
        let items = timeline.map_or(&[][..], |timeline| &timeline.items);
        let mut tiles = Vec::new();
        for item in items {
            let of_frame = item.tiles.iter().filter(|at| passes.contains(&at.pass));
            let times = [item.start_cycle, item.end_cycle];
            tiles.extend(of_frame.map(|at| (at.pass, at.tile, item.core, times)));
        }
        let starts = tiles.iter().map(|tile| tile.3[0]);
        let ends = tiles.iter().map(|tile| tile.3[1]);
        Self {
            cycles: [starts.min().unwrap_or(0), ends.max().unwrap_or(0)],
            tiles,
        }
    }

    /// A tile that is rendered in parts lasts from its first to its last part.
    pub fn of_pass(&self, map: &TileMap) -> PassTimes {
        let tiles = map.footprints.len();
        let (mut cores, mut starts, mut ends) =
            (vec![0; tiles], vec![u32::MAX; tiles], vec![0; tiles]);
        for (_, tile, core, times) in self.tiles.iter().filter(|tile| tile.0 == map.pass) {
            let [start, end] = times.map(|cycle| (cycle - self.cycles[0]) as u32);
            let tile = *tile as usize;
            cores[tile] = *core;
            starts[tile] = starts[tile].min(start);
            ends[tile] = ends[tile].max(end);
        }
        for (start, end) in starts.iter_mut().zip(&ends) {
            *start = (*start).min(*end);
        }
        let lengths = starts.iter().zip(&ends).map(|(start, end)| end - start);
        PassTimes {
            cycles: lengths.collect(),
            core: packed(&cores),
            start: packed(&starts),
        }
    }
}
