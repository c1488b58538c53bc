//! Random order: a control without locality.

use super::scanline::Scanline;
use super::{Ground, Path};
use crate::order::cost::Cost;

/// Seeded shuffle; view by view, the tiles of both views are shuffled together.
#[derive(Debug)]
pub struct Random;

/// Fisher-Yates with SplitMix64 (Steele, Lea, Flood 2014).
pub fn shuffle<T>(seed: u64, items: &mut [T]) {
    let mut state = seed;
    for last in (1..items.len()).rev() {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        let pick = (u128::from(z) * (last as u128 + 1)) >> 64;
        items.swap(last, pick as usize);
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
