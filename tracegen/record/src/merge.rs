//! Merges records of single fragments into records of quads.
//!
//! A driver whose lanes cannot exchange their coverage records every fragment separately, as if it were the
//! only covered lane of its quad. The coordinates and depths of the merged quad are those of its first
//! covered lane, as on a driver with exchange. The trace is therefore the same in both cases.

use super::raw::{RawDepth, RawRecord, RawRecords};
use rayon::prelude::*;

/// Bits of [`RawRecord::passing`] for lanes. In a record of a fragment, the bits above hold a tag. All
/// fragments of a quad have the same tag. If a clipped primitive covers a quad twice, the tags of both parts
/// differ, except by accident.
const LANES: u32 = 15;

/// Quads merged from fragments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MergedQuads {
    quads: Vec<RawRecord>,
    depths: Vec<RawDepth>,
}

impl MergedQuads {
    /// Merges the fragments of a region.
    ///
    /// # Panics
    /// Depths are present, but fewer than records.
    pub fn new(fragments: RawRecords<'_>) -> Self {
        let mut order: Vec<(u64, u32)> = (fragments.quads.par_iter().enumerate())
            .map(|(index, fragment)| (key(fragment), index as u32))
            .collect();
        order.par_sort_unstable();
        let mut merged = Self::default();
        for place in order.chunk_by(|a, b| a.0 >> LANE_BITS == b.0 >> LANE_BITS) {
            merged.add(fragments, place);
        }
        merged
    }

    /// The merged quads, in no particular order.
    pub fn records(&self) -> RawRecords<'_> {
        RawRecords {
            quads: &self.quads,
            depths: &self.depths,
        }
    }

    /// Adds the fragments of one primitive and group in a quad, by ascending lane.
    fn add(&mut self, fragments: RawRecords<'_>, place: &[(u64, u32)]) {
        let first = self.quads.len();
        for &(_, index) in place {
            let fragment = &fragments.quads[index as usize];
            let tag = |record: &RawRecord| record.passing & !LANES;
            let found = self.quads[first..].iter_mut();
            if let Some(quad) = found.into_iter().find(|quad| tag(quad) == tag(fragment)) {
                quad.header |= RawRecord::pack(0, 0, fragment.mask(), 0);
                quad.passing |= fragment.passing & LANES;
            } else {
                self.quads.push(*fragment);
                if !fragments.depths.is_empty() {
                    self.depths.push(fragments.depths[index as usize]);
                }
            }
        }
        for quad in &mut self.quads[first..] {
            quad.passing &= LANES;
        }
    }
}

/// Bits of the lane in a [`key`].
const LANE_BITS: u32 = 2;

/// Sort key: primitive, position of the quad, group, lane.
fn key(fragment: &RawRecord) -> u64 {
    let place = fragment.qx() | fragment.qy() << 12;
    let lane = u64::from(fragment.mask().trailing_zeros() & 3);
    u64::from(fragment.primitive) << 32
        | u64::from(place) << 6
        | u64::from(fragment.group()) << LANE_BITS
        | lane
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(place: [u32; 2], primitive: u32, [mask, passing]: [u8; 2], group: u8) -> RawRecord {
        RawRecord {
            header: RawRecord::pack(place[0], place[1], mask, group),
            primitive,
            draw: 7,
            passing: passing.into(),
            uv: [primitive as f32, f32::from(group)],
            ..RawRecord::default()
        }
    }

    /// The fragments of a quad. All except the first have different coordinates and depths.
    fn fragments(quad: &RawRecord, tag: u32) -> Vec<(RawRecord, RawDepth)> {
        let first = quad.mask().trailing_zeros();
        (0..4)
            .filter(|lane| quad.mask() >> lane & 1 == 1)
            .map(|lane| {
                let mut fragment = *quad;
                let header = RawRecord::pack(0, 0, 1 << lane, 0);
                fragment.header = quad.header & !RawRecord::pack(0, 0, 15, 0) | header;
                fragment.passing = quad.passing & 1 << lane | tag << 4;
                fragment.uv[0] += (lane - first) as f32;
                let depth = [(lane - first) as f32; 4];
                (fragment, RawDepth { depth })
            })
            .collect()
    }

    fn merged(fragments: &[(RawRecord, RawDepth)]) -> MergedQuads {
        let (quads, depths): (Vec<_>, Vec<_>) = fragments.iter().copied().unzip();
        MergedQuads::new(RawRecords {
            quads: &quads,
            depths: &depths,
        })
    }

    #[test]
    fn fragments_in_any_order_are_merged_into_their_quads() {
        let mut quads = Vec::new();
        for number in 0..400_u32 {
            let mask = (number % 15 + 1) as u8;
            let place = [number % 5, 4095 - number % 3];
            quads.push(quad(
                place,
                number / 15,
                [mask, mask & 5],
                (number % 2) as u8,
            ));
        }
        quads.dedup_by_key(|q| key(q) >> LANE_BITS);
        let mut all: Vec<_> = quads.iter().flat_map(|q| fragments(q, 9)).collect();
        let middle = all.len() / 2;
        all.rotate_left(middle);
        all.reverse();
        let mut found = merged(&all);
        assert!(found.depths.iter().all(|depth| depth.depth == [0.0; 4]));
        assert_eq!(found.depths.len(), found.quads.len());
        let sort = |quads: &mut Vec<RawRecord>| quads.sort_by_key(|q| key(q) >> LANE_BITS);
        sort(&mut found.quads);
        sort(&mut quads);
        assert_eq!(found.quads, quads);
    }

    #[test]
    fn two_parts_of_a_clipped_primitive_in_one_quad_are_not_merged() {
        let [left, mut right] = [[0b0101, 0], [0b1010, 0]].map(|lanes| quad([3, 4], 5, lanes, 0));
        right.uv = [9.0; 2];
        let all = [fragments(&left, 1), fragments(&right, 2)].concat();
        assert_eq!(merged(&all).quads, [left, right]);
    }

    #[test]
    fn records_without_depths_are_merged_without_depths() {
        let record = quad([0, 0], 0, [1, 0], 0);
        let merged = MergedQuads::new(RawRecords {
            quads: &[record],
            depths: &[],
        });
        assert_eq!(merged.records().quads, [record]);
        assert!(merged.records().depths.is_empty());
    }
}
