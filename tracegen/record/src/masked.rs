//! Repeats the depth test between the primitives of a draw whose fragments may be discarded.
//!
//! A masked draw is captured with an early depth test against the depth of earlier draws (see
//! `fragment_masked_record`), so the driver has not tested its primitives against each other. An in-order GPU
//! with early test and late write would have done so. There, a lane survives if it passes the depth test
//! against all earlier primitives of the draw whose alpha test passed at that pixel.

use super::raw::{RawDepth, RawRecord};

/// Depth test between the primitives of a draw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthReplay {
    /// No test: the driver has done it, or no primitive of the draw hides another.
    #[default]
    None,
    /// Depth test *less*: the nearer fragment passes.
    Less,
    /// Depth test *less or equal*.
    LessOrEqual,
    /// Depth test *greater*.
    Greater,
    /// Depth test *greater or equal*.
    GreaterOrEqual,
}

impl DepthReplay {
    /// Whether a fragment at `depth` passes against the depth `written`.
    fn passes(self, depth: f32, written: f32) -> bool {
        match self {
            Self::None => true,
            Self::Less => depth < written,
            Self::LessOrEqual => depth <= written,
            Self::Greater => depth > written,
            Self::GreaterOrEqual => depth >= written,
        }
    }

    /// The initial depth, against which every fragment passes.
    fn initial(self) -> f32 {
        match self {
            Self::Greater | Self::GreaterOrEqual => f32::NEG_INFINITY,
            _ => f32::INFINITY,
        }
    }
}

/// Number of quads along the edge of a tile.
const EDGE: usize = formats::textrace::TILE_QUADS as usize;

/// Depth that a masked draw has written in a tile so far.
#[derive(Clone, Debug)]
pub(crate) struct MaskedDepth {
    draw: Option<u32>,
    /// Depth of the four lanes of each quad, quads row by row.
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
    /// Resets all depths for the next tile.
    pub fn clear(&mut self) {
        self.draw = None;
    }

    /// Covered lanes of a quad that survive. Quads must come in submission order.
    pub fn survivors(&mut self, test: DepthReplay, quad: &RawRecord, depth: &RawDepth) -> u8 {
        let (x, y) = ((quad.qx() & 7) as usize, (quad.qy() & 7) as usize);
        if self.draw.replace(quad.draw) != Some(quad.draw) {
            self.nearest.fill([test.initial(); 4]);
        }
        let nearest = &mut self.nearest[y * EDGE + x];
        let nearer = (nearest.iter().zip(&depth.depth).enumerate())
            .map(|(lane, (nearest, depth))| u8::from(test.passes(*depth, *nearest)) << lane)
            .sum::<u8>();
        let survivors = quad.mask() & nearer;
        // Branchless, because passing lanes are unpredictable.
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

    /// Survivors of the quad at `[x, y]` of a tile with these covered and passing lanes.
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
        nearest.survivors(DepthReplay::Less, &quad, &RawDepth { depth })
    }

    #[test]
    fn each_depth_test_passes_the_specified_fragments() {
        use DepthReplay::{Greater, GreaterOrEqual, Less, LessOrEqual};
        let cases = [
            (Less, [0b0010, 0b0000]),
            (LessOrEqual, [0b0011, 0b0000]),
            (Greater, [0b0100, 0b0100]),
            (GreaterOrEqual, [0b0101, 0b0101]),
        ];
        // The second quad has equal, nearer and farther lanes; the third is the same again.
        for (test, expected) in cases {
            let mut nearest = MaskedDepth::default();
            let mut lanes = |depth| {
                let quad = RawRecord {
                    header: RawRecord::pack(2, 3, 0b0111, 0),
                    draw: 9,
                    passing: 0b0111,
                    ..RawRecord::default()
                };
                nearest.survivors(test, &quad, &RawDepth { depth })
            };
            assert_eq!(lanes([0.5; 4]), 0b0111, "{test:?}");
            assert_eq!(lanes([0.5, 0.4, 0.6, 0.5]), expected[0], "{test:?}");
            let again = lanes([0.5, 0.5, 0.7, 0.5]);
            let or_equal = matches!(test, LessOrEqual | GreaterOrEqual);
            let same = u8::from(or_equal);
            assert_eq!(again & 0b0001, same, "{test:?}");
            assert_eq!(again & 0b0100, expected[1] & 0b0100, "{test:?}");
        }
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
