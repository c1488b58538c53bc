//! Zig-zag order (boustrophedon): every other row from right to left, so that each tile touches
//! the one before.

use super::TileOrder;

/// Zig-zag order.
pub struct ZigZag;

impl TileOrder for ZigZag {
    fn curve(&self, [columns, rows]: [u32; 2]) -> Vec<[u32; 2]> {
        (0..rows)
            .flat_map(|y| {
                (0..columns).map(move |x| [if y % 2 == 0 { x } else { columns - 1 - x }, y])
            })
            .collect()
    }
}
