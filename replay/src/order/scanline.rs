//! Scanline order: rows from the top, each from left to right.

use super::TileOrder;

/// Scanline order.
pub struct Scanline;

impl TileOrder for Scanline {
    fn curve(&self, [columns, rows]: [u32; 2]) -> Vec<[u32; 2]> {
        (0..rows)
            .flat_map(|y| (0..columns).map(move |x| [x, y]))
            .collect()
    }
}
