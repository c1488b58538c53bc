//! Horizontal bands. Each is traversed in columns of alternating direction, every other band from the right.
//! Neighbours in a band follow each other so closely that a small cache holds their common lines.

use super::{Ground, Path};
use crate::order::cost::Cost;

/// The default number of rows of a band.
pub(super) const USUAL_ROWS: u32 = 4;

/// Bands with the number of rows in the curve's name. The last band may have fewer.
#[derive(Debug)]
pub(super) struct Band;

impl Path for Band {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid;
        let height = ground.size.max(1);
        let mut cells = Vec::with_capacity(columns as usize * rows as usize);
        let (mut first, mut leftwards) = (0, false);
        while first < rows {
            let end = first.saturating_add(height).min(rows);
            lay([first, end], leftwards, columns, &mut cells);
            (first, leftwards) = (end, !leftwards);
        }
        cells
    }

    /// Two counters and the band's bounds.
    fn cost(&self, _grid: [u32; 2]) -> Cost {
        Cost::state(8).deciding_in(1)
    }
}

/// Appends the cells of a band.
pub(super) fn lay(
    [first, end]: [u32; 2],
    leftwards: bool,
    columns: u32,
    cells: &mut Vec<[u32; 2]>,
) {
    for column in 0..columns {
        let x = if leftwards {
            columns - 1 - column
        } else {
            column
        };
        let y = |y| {
            if column % 2 == 0 {
                y
            } else {
                first + end - 1 - y
            }
        };
        cells.extend((first..end).map(|at| [x, y(at)]));
    }
}
