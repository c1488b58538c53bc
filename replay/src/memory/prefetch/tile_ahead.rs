//! The lines of the next work item are fetched when an item starts: an upper bound of what a tile-based GPU can know ahead, since
//! it has the next tile's primitives before it shades this one.

use super::{Demand, Prefetcher};

/// Fetches up to so many lines of the next item, in the order of their first use.
pub struct TileAhead {
    pub lines: u32,
}

impl Prefetcher for TileAhead {
    fn observe(&mut self, _line: u32, _demand: Demand, _lines: &mut Vec<u32>) {}

    fn lines_of_next_item(&self) -> usize {
        self.lines as usize
    }
}
