//! Random order: the control that shows what any locality is worth.

use super::{Scanline, TileOrder, TileRef, View, WorkItem};

/// Seeded shuffle of the tiles of both views together.
pub struct Random {
    /// Seed; the same seed gives the same order on every machine.
    pub seed: u64,
}

impl Random {
    /// Fisher-Yates with SplitMix64 (Steele, Lea, Flood 2014).
    fn shuffle<T>(&self, items: &mut [T]) {
        let mut state = self.seed;
        for last in (1..items.len()).rev() {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^= z >> 31;
            let pick = (u128::from(z) * (last as u128 + 1)) >> 64;
            items.swap(last, pick as usize);
        }
    }
}

impl TileOrder for Random {
    fn curve(&self, tiles: [u32; 2]) -> Vec<[u32; 2]> {
        let mut tiles = Scanline.curve(tiles);
        self.shuffle(&mut tiles);
        tiles
    }

    fn stereo(&self, left: View, right: View) -> Vec<WorkItem> {
        let mut items: Vec<WorkItem> = [left, right]
            .iter()
            .flat_map(|view| {
                (0..view.tiles[0] * view.tiles[1]).map(|tile| {
                    WorkItem::Tile(TileRef {
                        pass: view.pass,
                        tile,
                    })
                })
            })
            .collect();
        self.shuffle(&mut items);
        items
    }
}
