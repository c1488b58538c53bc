//! Vertical strips, each traversed row by row to and fro, every other strip from the bottom: what a row of a strip
//! fetched is still in the L2 when the next row of the strip asks for it, however wide the picture.

use super::{Ground, Path};
use crate::order::cost::Cost;

/// Bytes of L2 for each column of tiles that a strip is wide. Chosen on the design cameras of docs/orders.md: a pair of
/// tiles has about 100 distinct lines of 16 bytes.
const BYTES_PER_COLUMN: u64 = 1536;

/// Columns that an L2 holds a row of.
pub(super) fn columns(l2_bytes: u64) -> u32 {
    u32::try_from(l2_bytes / BYTES_PER_COLUMN)
        .unwrap_or(u32::MAX)
        .max(1)
}

/// Strips at most as wide as the number behind the name; an odd number of them of nearly the same width, so that none
/// ends in the middle of the picture, where what lies left and right of it is often alike.
#[derive(Debug)]
pub struct Strip;

impl Path for Strip {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid;
        let strips = columns.div_ceil(ground.size.max(1)) | 1;
        let bound = |strip: u32| (u64::from(columns) * u64::from(strip) / u64::from(strips)) as u32;
        let mut cells = Vec::with_capacity(columns as usize * rows as usize);
        for strip in 0..strips {
            let (first, end) = (bound(strip), bound(strip + 1));
            for row in 0..rows {
                let y = if strip % 2 == 0 { row } else { rows - 1 - row };
                let x = |x| if row % 2 == 0 { x } else { first + end - 1 - x };
                cells.extend((first..end).map(|at| [x(at), y]));
            }
        }
        cells
    }

    /// Two counters and the strip's bounds; the counters' lowest bits are the directions.
    fn cost(&self, _grid: [u32; 2]) -> Cost {
        Cost::state(8).deciding_in(1)
    }
}
