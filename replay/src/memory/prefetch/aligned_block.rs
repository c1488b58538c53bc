//! A miss fetches the whole aligned block around its line. In textures of Morton order, a block of lines is a square of texels
//! or half of one.

use super::{Demand, Prefetcher};

/// Blocks of so many lines, a power of two.
pub struct AlignedBlock {
    pub lines: u32,
}

impl Prefetcher for AlignedBlock {
    fn observe(&mut self, line: u32, demand: Demand, lines: &mut Vec<u32>) {
        if demand == Demand::Miss {
            // The nearest first: 5 is followed by 4, 7, 6 in a block of four.
            lines.extend((1..self.lines).map(|other| line ^ other));
        }
    }
}
