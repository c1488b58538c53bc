//! Z2 left-right tile assignment (Z2 paper section 3): L0 R0 L1 R1 ... along the Z-order curve, so
//! that of two cores one works on the left tile while the other works on the right one.

use super::{Morton, Pairing, TileOrder};

/// Z2 LRTA.
pub struct Z2Lrta;

impl TileOrder for Z2Lrta {
    fn curve(&self, tiles: [u32; 2]) -> Vec<[u32; 2]> {
        Morton.curve(tiles)
    }

    fn pairing(&self) -> Pairing {
        Pairing::InTurn
    }
}
