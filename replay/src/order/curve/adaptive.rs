//! Rows to and fro where the L2 holds the lines of one, bands where it does not, as the last frame's rows had them.

use super::band::lay;
use super::{Ground, Path};
use crate::order::cost::{Cost, Knows};

/// A row's lines may take so many eighths of the L2, so that rows are worth more than bands. Chosen on the design
/// cameras of docs/orders.md, like the bands' height.
const EIGHTHS: u64 = 10;
const ROWS_OF_A_BAND: u32 = 4;

/// Size of the L2.
pub(super) fn l2_kib(l2_bytes: u64) -> u32 {
    u32::try_from(l2_bytes / 1024).unwrap_or(u32::MAX).max(1)
}

/// Rows and bands by the lines of rows; rows where nothing is known of a last frame.
#[derive(Debug)]
pub struct Adaptive;

impl Path for Adaptive {
    fn cells(&self, ground: &Ground<'_>) -> Vec<[u32; 2]> {
        let [columns, rows] = ground.grid;
        let most = u64::from(ground.size) * 1024 * EIGHTHS / 8;
        let known = ground.row_bytes.unwrap_or_default();
        let fits = |row: u32| known.get(row as usize).is_none_or(|&bytes| bytes <= most);
        let mut cells = Vec::with_capacity(columns as usize * rows as usize);
        let (mut first, mut leftwards) = (0, false);
        while first < rows {
            let height = if fits(first) { 1 } else { ROWS_OF_A_BAND };
            let end = (first + height).min(rows);
            lay([first, end], leftwards, columns, &mut cells);
            (first, leftwards) = (end, !leftwards);
        }
        cells
    }

    /// A band's counters and bounds and a sum; of each row of the last frame, whether it fits: a bit.
    fn cost(&self, [_, rows]: [u32; 2]) -> Cost {
        Cost::state(12)
            .with_table(rows.div_ceil(8).into())
            .deciding_in(2)
            .knowing(Knows::LastFrame)
    }
}
