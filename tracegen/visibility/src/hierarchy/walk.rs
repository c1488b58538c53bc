//! Finds the draws that may be in a volume.

use super::{Hierarchy, Node, WIDTH};
use crate::draw_set::DrawSet;
use crate::volume::{Prepared, Sides};

/// Memory that is reused between walks.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// Nodes to visit, each with those planes of the volume that it may cross.
    stack: Vec<(u32, Sides)>,
    found: DrawSet,
}

impl Hierarchy {
    /// Writes the draws that may be in any of the volumes to `list`, ascending. Returns the number of tests
    /// of one box against one volume.
    ///
    /// The tests are conservative: draws outside may be included.
    pub(crate) fn collect(
        &self,
        volumes: &[Prepared],
        scratch: &mut Scratch,
        list: &mut Vec<u32>,
    ) -> u64 {
        scratch.found.reserve(self.len());
        for &draw in &self.unbounded {
            scratch.found.insert(draw);
        }
        let tests = (volumes.iter())
            .map(|volume| self.walk(volume, scratch))
            .sum();
        list.clear();
        scratch.found.drain_into(list);
        tests
    }

    fn walk(&self, volume: &Prepared, scratch: &mut Scratch) -> u64 {
        let Scratch { stack, found } = scratch;
        let mut tests = 0;
        if !self.nodes.is_empty() {
            stack.push((0, volume.sides()));
        }
        while let Some((number, sides)) = stack.pop() {
            let node = &self.nodes[number as usize];
            tests += u64::from(node.count);
            let tested = volume.test(&node.corners, sides);
            let mut lanes = !tested.outside & ((1 << node.count) - 1);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let left = tested.left(sides, lane);
                match node.part(lane) {
                    Subtree::Draws(child, _) if left != 0 => stack.push((child, left)),
                    Subtree::Draws(_, [begin, end]) => {
                        for &draw in &self.order[begin as usize..end as usize] {
                            found.insert(draw);
                        }
                    }
                    Subtree::Draw(slot) => found.insert(self.order[slot as usize]),
                }
            }
        }
        tests
    }
}

/// Contents of a box.
enum Subtree {
    /// One draw, by its index in the order.
    Draw(u32),
    /// Several draws: the node with their boxes, and their range in the order.
    Draws(u32, [u32; 2]),
}

impl Node {
    fn part(&self, lane: usize) -> Subtree {
        debug_assert!(lane < WIDTH);
        let [begin, end] = [self.begin[lane], self.begin[lane + 1]];
        if end - begin == 1 {
            Subtree::Draw(begin)
        } else {
            Subtree::Draws(self.child[lane], [begin, end])
        }
    }
}
