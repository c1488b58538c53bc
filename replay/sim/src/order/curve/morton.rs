//! Morton order (Z-order curve), the Z2 paper's baseline.

use super::{Ground, Path};
use crate::order::cost::Cost;

/// Morton order. On other grids than squares of a power of two, follows the curve of the next larger such
/// square and skips cells outside of the grid.
#[derive(Debug)]
pub struct Morton;

impl Path for Morton {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid;
        let mut cells: Vec<[u32; 2]> = (0..rows)
            .flat_map(|y| (0..columns).map(move |x| [x, y]))
            .collect();
        // Sorting by the code yields the curve without outside cells, and is fast for long grids.
        cells.sort_unstable_by_key(|&[x, y]| spread(x) | spread(y) << 1);
        cells
    }

    /// A counter whose even and odd bits are column and row. It skips outside cells by quadrants, in at most
    /// one step per level.
    fn cost(&self, grid: [u32; 2]) -> Cost {
        let side = grid[0].max(grid[1]).max(1).next_power_of_two();
        Cost::state(4).deciding_in(1 + side.ilog2())
    }
}

/// Inserts a zero bit above every bit of `x`.
fn spread(x: u32) -> u64 {
    let mut x = u64::from(x);
    for (shift, mask) in [
        (16, 0x0000_ffff_0000_ffff),
        (8, 0x00ff_00ff_00ff_00ff),
        (4, 0x0f0f_0f0f_0f0f_0f0f),
        (2, 0x3333_3333_3333_3333),
        (1, 0x5555_5555_5555_5555),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}
