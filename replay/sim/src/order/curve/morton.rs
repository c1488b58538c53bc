//! Morton order (Z-order curve), the Z2 paper's baseline.

use super::{Ground, Path};
use crate::order::cost::Cost;
use formats::layout::interleave;

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
        cells.sort_unstable_by_key(|&[x, y]| interleave(x) | interleave(y) << 1);
        cells
    }

    /// A counter whose even and odd bits are column and row. It skips outside cells by quadrants, in at most
    /// one step per level.
    fn cost(&self, grid: [u32; 2]) -> Cost {
        let side = grid[0].max(grid[1]).max(1).next_power_of_two();
        Cost::state(4).deciding_in(1 + side.ilog2())
    }
}
