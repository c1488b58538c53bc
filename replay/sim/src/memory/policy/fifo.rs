//! First in, first out: a hit changes nothing, and the oldest line is evicted.

use super::{Geometry, Policy};

/// When each line was filled, by place.
pub(super) struct Fifo {
    filled: Vec<u64>,
    fills: u64,
    ways: u32,
}

impl Fifo {
    pub(super) fn new(geometry: Geometry) -> Self {
        Self {
            filled: vec![0; geometry.lines()],
            fills: 0,
            ways: geometry.ways,
        }
    }
}

impl Policy for Fifo {
    fn fill(&mut self, set: u32, way: u32, _line: u32) {
        self.fills += 1;
        self.filled[(set * self.ways + way) as usize] = self.fills;
    }

    fn victim(&mut self, set: u32) -> u32 {
        let filled = |way: &u32| self.filled[(set * self.ways + way) as usize];
        (0..self.ways).min_by_key(filled).unwrap_or(0)
    }
}
