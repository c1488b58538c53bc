//! Random order: a control without locality.

use super::scanline::Scanline;
use super::{Ground, Path};
use crate::order::cost::Cost;

/// Seeded shuffle; view by view, the tiles of both views are shuffled together.
#[derive(Debug)]
pub struct Random;

/// Fisher-Yates.
pub(crate) fn shuffle<T>(seed: u64, items: &mut [T]) {
    let mut random = formats::random::Random(seed);
    for last in (1..items.len()).rev() {
        items.swap(last, random.below(last + 1));
    }
}

impl Path for Random {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let mut cells = Scanline.cells(ground);
        shuffle(ground.seed, &mut cells);
        cells
    }

    /// A list of all cells.
    fn cost(&self, [columns, rows]: [u32; 2]) -> Cost {
        let cells = u64::from(columns) * u64::from(rows);
        Cost::state(4).with_table(4 * cells).deciding_in(1)
    }
}
