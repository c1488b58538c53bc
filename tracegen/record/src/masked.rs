//! Replays the depth test inside an alpha-masked draw.
//!
//! A masked draw is captured with a forced early test against the depth of the draws before it
//! (see `fragment_masked_record`), so the driver has not tested its primitives against each other.
//! An in-order GPU with early test and late write would have: a lane survives if it is nearer than
//! every earlier primitive of the draw whose alpha passed at that pixel.

use super::raw::{RawDepth, RawRecord};

/// Quads along a tile's edge.
const EDGE: usize = formats::textrace::TILE_QUADS as usize;

/// Depth that one masked draw has written so far in one tile.
#[derive(Clone, Debug)]
pub(crate) struct MaskedDepth {
    draw: Option<u32>,
    /// Four lanes a quad, quads row by row.
    nearest: [[f32; 4]; EDGE * EDGE],
}

impl Default for MaskedDepth {
    fn default() -> Self {
        Self {
            draw: None,
            nearest: [[f32::INFINITY; 4]; EDGE * EDGE],
        }
    }
}

impl MaskedDepth {
    /// Forgets everything, for the next tile.
    pub fn clear(&mut self) {
        self.draw = None;
    }

    /// Covered lanes of a quad that survive; quads must come in submission order.
    pub fn survivors(&mut self, quad: &RawRecord, depth: &RawDepth) -> u8 {
        let (x, y) = ((quad.qx() & 7) as usize, (quad.qy() & 7) as usize);
        if self.draw.replace(quad.draw) != Some(quad.draw) {
            self.nearest.fill([f32::INFINITY; 4]);
        }
        let nearest = &mut self.nearest[y * EDGE + x];
        let nearer = (nearest.iter().zip(&depth.depth).enumerate())
            .map(|(lane, (nearest, depth))| u8::from(depth < nearest) << lane)
            .sum::<u8>();
        let survivors = quad.mask() & nearer;
        // Without a branch: which lanes pass is as good as random.
        let written = u32::from(survivors) & quad.passing;
        for (lane, (nearest, &depth)) in nearest.iter_mut().zip(&depth.depth).enumerate() {
            *nearest = if written >> lane & 1 == 1 {
                depth
            } else {
                *nearest
            };
        }
        survivors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Survivors of quad `[x, y]` of a tile, with its covered and its passing lanes.
    fn survivors(
        nearest: &mut MaskedDepth,
        draw: u32,
        [x, y]: [u32; 2],
        [covered, passing]: [u8; 2],
        depth: [f32; 4],
    ) -> u8 {
        let quad = RawRecord {
            header: RawRecord::pack(x, y, covered, 0),
            draw,
            passing: passing.into(),
            ..RawRecord::default()
        };
        nearest.survivors(&quad, &RawDepth { depth })
    }

    #[test]
    fn a_lane_behind_an_earlier_passing_primitive_is_killed() {
        let mut depth = MaskedDepth::default();
        assert_eq!(
            survivors(&mut depth, 3, [7, 7], [0b1111, 0b0101], [0.5; 4]),
            0b1111
        );
        assert_eq!(
            survivors(&mut depth, 3, [7, 7], [0b1111, 0b1111], [0.6; 4]),
            0b1010
        );
    }

    #[test]
    fn a_nearer_lane_survives_and_equal_depth_does_not() {
        let mut depth = MaskedDepth::default();
        survivors(&mut depth, 3, [0, 0], [0b1111, 0b1111], [0.5; 4]);
        let next = [0.4, 0.5, 0.6, 0.1];
        assert_eq!(survivors(&mut depth, 3, [0, 0], [0b0111, 0], next), 0b0001);
    }

    #[test]
    fn a_killed_lane_writes_no_depth() {
        let mut depth = MaskedDepth::default();
        let mut lane = |passing, at: f32| survivors(&mut depth, 3, [0, 0], [1, passing], [at; 4]);
        lane(1, 0.5);
        lane(1, 0.7);
        assert_eq!(lane(1, 0.6), 0);
        assert_eq!(lane(1, 0.45), 1);
    }

    #[test]
    fn draws_do_not_see_each_others_depth() {
        let mut depth = MaskedDepth::default();
        survivors(&mut depth, 3, [0, 0], [1, 1], [0.5; 4]);
        assert_eq!(survivors(&mut depth, 4, [0, 0], [1, 1], [0.9; 4]), 1);
    }
}
