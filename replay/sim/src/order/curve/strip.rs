//! Vertical strips. Each is traversed in rows of alternating direction, every other strip from the bottom. The
//! lines of a strip's row are still in the L2 when the strip's next row needs them, whatever the width of the
//! picture.

use super::{Ground, Path};
use crate::order::cost::Cost;

/// Bytes of L2 per column of a strip. Chosen on the design cameras of docs/results/orders.md, where a pair of
/// tiles has about 100 distinct lines of 16 bytes.
const BYTES_PER_COLUMN: u64 = 1536;

/// The number of columns whose row an L2 holds.
pub(super) fn columns(l2_bytes: u64) -> u32 {
    u32::try_from(l2_bytes / BYTES_PER_COLUMN)
        .unwrap_or(u32::MAX)
        .max(1)
}

/// Strips that are at most as wide as the number after the name. Their number is odd and their widths nearly
/// equal, so that no strip ends in the middle of the picture, because textures left and right of the middle are
/// often the same.
#[derive(Debug)]
pub(super) struct Strip;

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

    /// Two counters and the strip's bounds. The lowest bits of the counters are the directions.
    fn cost(&self, _grid: [u32; 2]) -> Cost {
        Cost::state(8).deciding_in(1)
    }
}
