//! A miss fetches the whole aligned block around its line. In Morton-ordered textures, a block of
//! lines is a square of texels or half of one.

use super::{Demand, Prefetcher};

/// Lines per block, a power of two.
pub(super) struct AlignedBlock {
    pub lines: u32,
}

impl Prefetcher for AlignedBlock {
    fn observe(&mut self, line: u32, demand: Demand, lines: &mut Vec<u32>) {
        if demand == Demand::Miss {
            // Nearest first: in a block of four, 5 is followed by 4, 7 and 6.
            lines.extend((1..self.lines).map(|other| line ^ other));
        }
    }
}
