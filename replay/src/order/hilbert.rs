//! Hilbert order: like Morton hierarchical, but every step goes to a neighbour.

use super::TileOrder;

/// Hilbert order. On a grid that is no power of two the curve of the next larger square is
/// followed and what lies outside is skipped.
pub struct Hilbert;

impl TileOrder for Hilbert {
    fn curve(&self, [columns, rows]: [u32; 2]) -> Vec<[u32; 2]> {
        let side = columns.max(rows).max(1).next_power_of_two();
        let mut tiles: Vec<[u32; 2]> = (0..rows)
            .flat_map(|y| (0..columns).map(move |x| [x, y]))
            .collect();
        tiles.sort_unstable_by_key(|&at| distance(side, at));
        tiles
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
        // Turn the quadrant so that its curve starts and ends as the whole square's does.
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
