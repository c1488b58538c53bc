//! Z2 STA with the two triangle lists merged by primitive number: the same triangle is rendered
//! for both eyes back to back, even where one eye sees triangles that the other does not.

use super::{Interleave, Morton, Pairing, TileOrder};

/// Z2 STA, lists merged.
pub struct Z2StaMerge;

impl TileOrder for Z2StaMerge {
    fn curve(&self, tiles: [u32; 2]) -> Vec<[u32; 2]> {
        Morton.curve(tiles)
    }

    fn pairing(&self) -> Pairing {
        Pairing::OneCore(Interleave::Merge)
    }
}
