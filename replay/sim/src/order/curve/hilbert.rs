//! Hilbert order: hierarchical like Morton order, but every step goes to a neighbour.

use super::{Ground, Path};
use crate::order::cost::Cost;

/// Hilbert order. On other grids than squares of a power of two, follows the curve of the next larger such
/// square and skips cells outside of the grid.
#[derive(Debug)]
pub struct Hilbert;

impl Path for Hilbert {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid;
        let side = columns.max(rows).max(1).next_power_of_two();
        let mut cells: Vec<[u32; 2]> = (0..rows)
            .flat_map(|y| (0..columns).map(move |x| [x, y]))
            .collect();
        cells.sort_unstable_by_key(|&at| distance(side, at));
        cells
    }

    /// A counter, whose bits are converted to column and row level by level. Outside cells are skipped as on
    /// the Morton curve.
    fn cost(&self, grid: [u32; 2]) -> Cost {
        let side = grid[0].max(grid[1]).max(1).next_power_of_two();
        Cost::state(4).deciding_in(1 + 2 * side.ilog2())
    }
}

/// Distance along the Hilbert curve of a square of `side` (a power of two) tiles.
fn distance(side: u32, [mut x, mut y]: [u32; 2]) -> u64 {
    let mut d = 0;
    let mut s = side / 2;
    while s > 0 {
        let right = u32::from(x & s != 0);
        let down = u32::from(y & s != 0);
        d += u64::from(s) * u64::from(s) * u64::from((3 * right) ^ down);
        // Rotates the quadrant so that its curve starts and ends like that of the whole square.
        if down == 0 {
            if right == 1 {
                x = (side - 1) - x;
                y = (side - 1) - y;
            }
            std::mem::swap(&mut x, &mut y);
        }
        s /= 2;
    }
    d
}
