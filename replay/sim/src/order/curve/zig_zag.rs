//! Zig-zag order (boustrophedon): every other row from right to left, so that each tile touches
//! the one before.

use super::{Ground, Path};
use crate::order::cost::Cost;

/// Zig-zag order.
#[derive(Debug)]
pub(super) struct ZigZag;

impl Path for ZigZag {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid;
        (0..rows)
            .flat_map(|y| {
                (0..columns).map(move |x| [if y % 2 == 0 { x } else { columns - 1 - x }, y])
            })
            .collect()
    }

    /// Two counters. The lowest bit of the row counter is the direction.
    fn cost(&self, _grid: [u32; 2]) -> Cost {
        Cost::state(4).deciding_in(1)
    }
}
