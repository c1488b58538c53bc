//! Groups of neighbouring items by the lines that they read from DRAM in the last frame. Half of the cores take the group
//! with most lines, the others the one with fewest, so that DRAM and cores are busy at the same time.

use super::{HandOut, Inputs, Queue};
use sim::order::WorkItem;
use std::cmp::Reverse;
use std::ops::Range;

/// Items of the largest group: four by four along the Morton curve.
const MOST: usize = 16;

/// Groups per core at least, if there are enough items.
const GROUPS_PER_CORE: usize = 8;

/// Items per group: the largest square on the Morton curve that leaves enough groups.
fn group_items(items: usize, cores: usize) -> usize {
    let mut group = MOST;
    while group > 1 && items < group * GROUPS_PER_CORE * cores {
        group /= 4;
    }
    group
}

/// The groups, those with most lines first. Equal groups keep their order.
pub fn plan(items: Vec<WorkItem>, inputs: &Inputs<'_>) -> Queue {
    let group = group_items(items.len(), inputs.config.cores as usize);
    let starts = (0..items.len()).step_by(group);
    let ranges = starts.map(|start| start..(start + group).min(items.len()));
    let mut groups: Vec<Range<usize>> = ranges.collect();
    let lines = |group: &Range<usize>| -> f64 {
        let of_items = items[group.clone()].iter().map(|item| inputs.last.of(item));
        of_items.sum()
    };
    groups.sort_by_cached_key(|group| Reverse(lines(group) as u64));
    Queue {
        items,
        hand_out: HandOut::BothEnds(groups),
    }
}

/// A counter of 16 bits and a position of 16 bits per group.
pub fn bits(items: u64, cores: u64) -> u64 {
    32 * items.div_ceil(group_items(items as usize, cores as usize) as u64)
}

#[cfg(test)]
mod tests {
    use super::super::Pressure;
    use super::*;
    use sim::config::RunConfig;
    use sim::order::TileRef;

    #[test]
    fn the_groups_with_most_lines_come_first() {
        let item = |tile| WorkItem::Tile(TileRef { pass: 3, tile });
        let mut last = Pressure::new(3);
        last.add(&item(200), 7);
        last.add(&item(333), 9);
        let config = RunConfig::default();
        let inputs = Inputs {
            config: &config,
            last: &last,
        };
        let HandOut::BothEnds(groups) = plan((0..340).map(item).collect(), &inputs).hand_out else {
            panic!("groups");
        };
        assert_eq!(groups[..3], [320..336, 192..208, 0..16]);
        assert_eq!(groups.len(), 22);
        assert_eq!(
            [group_items(255, 2), group_items(60, 2), group_items(0, 9)],
            [4, 1, 1]
        );
    }
}
