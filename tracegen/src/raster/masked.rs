//! Replays the depth test inside an alpha-masked draw.
//!
//! A masked draw is captured with a forced early test against the depth of the draws before it
//! (see `fragment_masked_record`), so the driver has not tested its primitives against each other.
//! An in-order GPU with early test and late write would have: a lane survives if it is nearer than
//! every earlier primitive of the draw whose alpha passed at that pixel.

use super::backend::RawRecord;

/// Pixels along a tile's edge.
const EDGE: usize = formats::view::TILE_SIZE_PX as usize;

/// Depth that one masked draw has written so far in one tile.
#[derive(Clone, Debug)]
pub struct MaskedDepth {
    draw: Option<u32>,
    nearest: [f32; EDGE * EDGE],
}

impl Default for MaskedDepth {
    fn default() -> Self {
        Self {
            draw: None,
            nearest: [f32::INFINITY; EDGE * EDGE],
        }
    }
}

impl MaskedDepth {
    /// Forgets everything, for the next tile.
    pub fn clear(&mut self) {
        self.draw = None;
    }

    /// Lanes of a quad that survive, given its depth record; quads must come in submission order.
    /// `x` and `y` are the quad's column and row in the tile.
    pub fn survivors(&mut self, record: &RawRecord, x: u8, y: u8) -> u8 {
        if self.draw.replace(record.draw) != Some(record.draw) {
            self.nearest.fill(f32::INFINITY);
        }
        let depths = [record.uv[0], record.uv[1], record.dx[0], record.dx[1]];
        let passing = record.mask();
        let covered = covered(record);
        let mut survivors = 0;
        for (lane, &depth) in depths.iter().enumerate() {
            let pixel = (2 * usize::from(y) + (lane >> 1)) * EDGE + 2 * usize::from(x) + (lane & 1);
            let Some(nearest) = self.nearest.get_mut(pixel) else { continue };
            if covered >> lane & 1 == 1 && depth < *nearest {
                survivors |= 1 << lane;
                if passing >> lane & 1 == 1 {
                    *nearest = depth;
                }
            }
        }
        survivors
    }
}

/// Covered lanes of a depth record, whose mask holds the lanes that pass the alpha test.
#[must_use]
pub fn covered(record: &RawRecord) -> u8 {
    (record.dy[0].to_bits() & 15) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::backend::DEPTH_GROUP;

    fn record(draw: u32, covered: u8, passing: u8, depths: [f32; 4]) -> RawRecord {
        RawRecord {
            header: RawRecord::pack(0, 0, passing, DEPTH_GROUP),
            draw,
            uv: [depths[0], depths[1]],
            dx: [depths[2], depths[3]],
            dy: [f32::from_bits(covered.into()), 0.0],
            ..RawRecord::default()
        }
    }

    #[test]
    fn a_lane_behind_an_earlier_passing_primitive_is_killed() {
        let mut depth = MaskedDepth::default();
        assert_eq!(depth.survivors(&record(3, 0b1111, 0b0101, [0.5; 4]), 7, 7), 0b1111);
        assert_eq!(depth.survivors(&record(3, 0b1111, 0b1111, [0.6; 4]), 7, 7), 0b1010);
    }

    #[test]
    fn a_nearer_lane_survives_and_equal_depth_does_not() {
        let mut depth = MaskedDepth::default();
        depth.survivors(&record(3, 0b1111, 0b1111, [0.5; 4]), 0, 0);
        assert_eq!(depth.survivors(&record(3, 0b0111, 0, [0.4, 0.5, 0.6, 0.1]), 0, 0), 0b0001);
    }

    #[test]
    fn a_killed_lane_writes_no_depth() {
        let mut depth = MaskedDepth::default();
        depth.survivors(&record(3, 1, 1, [0.5; 4]), 0, 0);
        depth.survivors(&record(3, 1, 1, [0.7; 4]), 0, 0);
        assert_eq!(depth.survivors(&record(3, 1, 1, [0.6; 4]), 0, 0), 0);
        assert_eq!(depth.survivors(&record(3, 1, 1, [0.45; 4]), 0, 0), 1);
    }

    #[test]
    fn draws_do_not_see_each_others_depth() {
        let mut depth = MaskedDepth::default();
        depth.survivors(&record(3, 1, 1, [0.5; 4]), 0, 0);
        assert_eq!(depth.survivors(&record(4, 1, 1, [0.9; 4]), 0, 0), 1);
    }
}
