//! Fetches the lines of the next work item when an item starts. This is an upper bound for
//! prefetching in a tile-based GPU, which knows the next tile's primitives before it shades the
//! current tile.

use super::{Demand, Prefetcher};

/// Fetches up to this many lines of the next item, in order of first use.
pub(super) struct TileAhead {
    pub lines: u32,
}

impl Prefetcher for TileAhead {
    fn observe(&mut self, _line: u32, _demand: Demand, _lines: &mut Vec<u32>) {}

    fn lines_of_next_item(&self) -> usize {
        self.lines as usize
    }
}
