//! Scanline order: rows from the top, each from left to right.

use super::{Ground, Path};
use crate::order::cost::Cost;

/// Scanline order.
#[derive(Debug)]
pub(crate) struct Scanline;

impl Path for Scanline {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid;
        (0..rows)
            .flat_map(|y| (0..columns).map(move |x| [x, y]))
            .collect()
    }

    /// Two counters.
    fn cost(&self, _grid: [u32; 2]) -> Cost {
        Cost::state(4).deciding_in(1)
    }
}
