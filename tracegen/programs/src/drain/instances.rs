//! Gives each instance of a draw primitive numbers of its own.
//!
//! In a fragment shader, the primitives of all instances have the same numbers. The driver draws a block of 64x64
//! pixels in one thread, primitive by primitive, so the order of a block's records separates instances that overlap.
//! Each block counts its instances itself, so one instance may have different numbers in different blocks.

use crate::session::coverage_group;
use spool::{DrawInfo, RawSample, ShaderInfo};
use std::collections::{HashMap, HashSet};

/// Quads along the edge of a block, as a power of two.
const BLOCK_SHIFT: u32 = 5;

/// The state of a block after a record.
#[derive(Default)]
struct Block {
    /// Instances before the current one.
    instance: u32,
    /// The current primitive.
    primitive: u32,
    /// Its fragments so far: the lanes of each quad.
    covered: HashMap<u32, u8>,
}

/// Changes the primitives of a draw's records to `instance * primitives + primitive`, where `primitives` is the larger of
/// the given number and what the records need. A draw with too many numbers for 32 bits keeps its own.
pub fn number(shader: &ShaderInfo, info: &DrawInfo, primitives: u32, records: &mut [RawSample]) {
    let has_one = info.instances == 1 && info.caveats.is_empty();
    // A shader that runs for each sample records the lanes of a fragment several times.
    let by_sample = info.caveats.iter().any(|of| of == "sample shading");
    let Some(coverage) = coverage_group(shader).filter(|_| !has_one && !by_sample) else {
        return;
    };
    let before = before_coverage(records, coverage);
    let mut blocks: HashMap<[u32; 3], Block> = HashMap::new();
    let instances: Vec<u32> = (records.iter())
        .map(|record| {
            let [x, y] = record.quad().map(|at| at >> BLOCK_SHIFT);
            let block = blocks.entry([record.view(), x, y]).or_default();
            let covers = record.group() == coverage;
            let again = || {
                let covered = block.covered.get(&record.place).copied().unwrap_or(0);
                (covers || before.contains(&record.group())) && covered & record.lanes() != 0
            };
            let is_next = record.primitive < block.primitive
                || record.primitive == block.primitive && again();
            if is_next || record.primitive != block.primitive {
                block.instance += u32::from(is_next);
                block.primitive = record.primitive;
                block.covered.clear();
            }
            if covers {
                *block.covered.entry(record.place).or_default() |= record.lanes();
            }
            block.instance
        })
        .collect();
    let last = instances.iter().copied().max().unwrap_or(0);
    let own = records
        .iter()
        .map(|record| record.primitive.saturating_add(1));
    let primitives = own.max().unwrap_or(0).max(primitives);
    if primitives.checked_mul(last.saturating_add(1)).is_some() {
        for (record, instance) in records.iter_mut().zip(instances) {
            record.primitive += instance * primitives;
        }
    }
}

/// Groups that a fragment records before the one that all fragments record.
fn before_coverage(records: &[RawSample], coverage: u16) -> HashSet<u16> {
    let mut covered = HashSet::new();
    let mut before = HashSet::new();
    for record in records {
        let at = (record.primitive, record.place);
        if record.group() == coverage {
            covered.insert(at);
        } else if !before.contains(&record.group()) && !covered.contains(&at) {
            before.insert(record.group());
        }
    }
    before
}

#[cfg(test)]
mod tests {
    use super::*;
    use spool::buffer::LANES_SHIFT;
    use spool::{DepthTests, Form, Site, What};

    const COVERAGE: u16 = 4;

    /// Numbers records of group, primitive, column of the quad and lanes.
    fn numbered(records: &[(u16, u32, u32, u32)], instances: u32) -> Vec<u32> {
        let shader = ShaderInfo {
            shader: 0,
            tests: DepthTests::Either,
            sites: vec![Site {
                what: What::Coverage,
                form: Form::Quad,
                group: COVERAGE,
                unconditional: true,
            }],
        };
        let info = DrawInfo {
            instances,
            ..DrawInfo::default()
        };
        let mut records: Vec<_> = (records.iter())
            .map(|&(group, primitive, place, lanes)| RawSample {
                header: u32::from(group) | lanes << LANES_SHIFT,
                primitive,
                place,
                ..RawSample::default()
            })
            .collect();
        number(&shader, &info, 10, &mut records);
        records.iter().map(|record| record.primitive).collect()
    }

    fn covers(primitive: u32, place: u32, lanes: u32) -> (u16, u32, u32, u32) {
        (COVERAGE, primitive, place, lanes)
    }

    #[test]
    fn a_smaller_primitive_starts_an_instance() {
        let records = [(2, 0), (5, 0), (5, 1), (2, 0), (3, 0), (0, 1)];
        let records = records.map(|(primitive, place)| covers(primitive, place, 15));
        assert_eq!(numbered(&records, 3), [2, 5, 5, 12, 13, 20]);
        assert_eq!(numbered(&records, 1), [2, 5, 5, 2, 3, 0]);
    }

    #[test]
    fn blocks_count_their_instances_themselves() {
        let records = [(7, 0), (7, 32), (7, 0), (7, 32 << 13), (7, 33)];
        let records = records.map(|(primitive, place)| covers(primitive, place, 15));
        assert_eq!(numbered(&records, 3), [7, 7, 17, 7, 7]);
    }

    #[test]
    fn the_same_lanes_again_start_an_instance_and_parts_of_a_clipped_primitive_do_not() {
        let records = [5, 10, 1, 4].map(|lanes| covers(3, 0, lanes));
        assert_eq!(numbered(&records, 2), [3, 3, 13, 13]);
    }

    #[test]
    fn records_before_and_after_the_coverage_belong_to_its_instance() {
        // Group 1 comes before the coverage, in some fragments; group 6 after it, in a loop.
        let one = [(1, 0, 0, 1), covers(0, 0, 3), (6, 0, 0, 2), (6, 0, 0, 2)];
        let two = [(1, 0, 0, 2), (1, 0, 0, 2), covers(0, 0, 2), (6, 0, 0, 2)];
        let numbers = numbered(&[one, two].concat(), 2);
        assert_eq!(numbers, [0, 0, 0, 0, 10, 10, 10, 10]);
    }
}
