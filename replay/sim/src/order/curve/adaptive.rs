//! Rows in alternating direction if the L2 holds the lines of a row, otherwise bands. The more lines the last
//! frame accessed, the fewer rows a band has.

use super::band::lay;
use super::{Ground, Path};
use crate::order::cost::{Cost, Information};

/// Minimum and maximum rows of a band, and the number of adjacent columns of a band that the L2 should hold.
/// Chosen on the design cameras of docs/results/orders.md with four texel formats, three line sizes and shadow
/// maps.
const ROWS: [u64; 2] = [3, 8];
const COLUMNS: u64 = 6;

/// The size of the L2 in KiB.
pub(super) fn l2_kib(l2_bytes: u64) -> u32 {
    u32::try_from(l2_bytes / 1024).unwrap_or(u32::MAX).max(1)
}

/// Rows or bands. Rows if no counters of a last frame are known.
#[derive(Debug)]
pub(super) struct Adaptive;

impl Path for Adaptive {
    fn cells(&self, ground: &Ground) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid;
        let height = ground.frame_bytes.map_or(1, |bytes| height(ground, bytes));
        let mut cells = Vec::with_capacity(columns as usize * rows as usize);
        let (mut first, mut leftwards) = (0, false);
        while first < rows {
            let end = (first + height).min(rows);
            lay([first, end], leftwards, columns, &mut cells);
            (first, leftwards) = (end, !leftwards);
        }
        cells
    }

    /// The counters and bounds of a band, its height, and a sum.
    fn cost(&self, _grid: [u32; 2]) -> Cost {
        Cost::state(14)
            .deciding_in(1)
            .with_information(Information::LastFrame)
    }
}

/// The number of rows of a band.
fn height(ground: &Ground, frame_bytes: u64) -> u32 {
    let [columns, rows] = ground.grid.map(u64::from);
    let l2_bytes = u64::from(ground.size) * 1024;
    let row_bytes = frame_bytes / rows.max(1);
    if row_bytes <= l2_bytes {
        return 1;
    }
    let held = columns * l2_bytes / row_bytes;
    let [least, most] = ROWS;
    (held / COLUMNS).clamp(least, most) as u32
}
