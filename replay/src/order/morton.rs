//! Morton order (Z-order curve), the Z2 paper's baseline.

use super::TileOrder;

/// Morton order. On a grid that is no power of two the curve of the next larger square is
/// followed and what lies outside is skipped.
pub struct Morton;

impl TileOrder for Morton {
    fn curve(&self, [columns, rows]: [u32; 2]) -> Vec<[u32; 2]> {
        let mut tiles: Vec<[u32; 2]> = (0..rows)
            .flat_map(|y| (0..columns).map(move |x| [x, y]))
            .collect();
        // Sorting by the code is the curve with the outside skipped, at no cost for long grids.
        tiles.sort_unstable_by_key(|&[x, y]| spread(x) | spread(y) << 1);
        tiles
    }
}

/// Puts a zero bit above every bit of `x`.
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
