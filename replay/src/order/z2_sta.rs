//! Z2 simultaneous tile access (Z2 paper section 3): the tile pair goes to one core, which renders
//! the triangles of the two lists in turn.

use super::{Interleave, Morton, Pairing, TileOrder};

/// Z2 STA.
pub struct Z2Sta;

impl TileOrder for Z2Sta {
    fn curve(&self, tiles: [u32; 2]) -> Vec<[u32; 2]> {
        Morton.curve(tiles)
    }

    fn pairing(&self) -> Pairing {
        Pairing::OneCore(Interleave::Alternate)
    }
}
