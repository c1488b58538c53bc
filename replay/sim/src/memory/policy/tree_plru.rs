//! Tree pseudo-LRU: one bit per node of a binary tree over the ways points to the half that was not used last.

use super::{Geometry, Policy};

/// Tree bits by set: node 1 is the root, node `n` has the children `2n` and `2n + 1`.
pub(super) struct TreePlru {
    trees: Vec<u64>,
    ways: u32,
}

/// A tree of 64 bits has at most 64 leaves.
pub(super) fn accepts_ways(ways: u32) -> bool {
    ways.is_power_of_two() && ways <= 64
}

impl TreePlru {
    pub(super) fn new(geometry: Geometry) -> Self {
        Self {
            trees: vec![0; geometry.sets as usize],
            ways: geometry.ways,
        }
    }
}

impl Policy for TreePlru {
    /// Points every node on the way's path to the other half.
    fn hit(&mut self, set: u32, way: u32, _line: u32) {
        let tree = &mut self.trees[set as usize];
        let mut node = way + self.ways;
        while node > 1 {
            let parent = node / 2;
            if node.is_multiple_of(2) {
                *tree |= 1 << parent;
            } else {
                *tree &= !(1 << parent);
            }
            node = parent;
        }
    }

    fn fill(&mut self, set: u32, way: u32, line: u32) {
        self.hit(set, way, line);
    }

    fn victim(&mut self, set: u32) -> u32 {
        let mut node = 1;
        while node < self.ways {
            node = 2 * node + (self.trees[set as usize] >> node & 1) as u32;
        }
        node - self.ways
    }
}
