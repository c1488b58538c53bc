//! Layout of nodes in treelets: connected parts of the tree that fit a given size, each contiguous
//! in memory (Aila and Karras, "Architecture Considerations for Tracing Incoherent Rays", HPG
//! 2010, section 4).

use super::node::{Child, Node2, Node8};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A node whose children can be renumbered.
pub(super) trait Renumbered: Copy {
    /// Children, [`Child::NONE`] where missing.
    fn children(&mut self) -> &mut [Child];
    /// Half the surface area of a child's box.
    fn half_area(&self, side: usize) -> f32;
}

impl Renumbered for Node2 {
    fn children(&mut self) -> &mut [Child] {
        &mut self.children
    }

    fn half_area(&self, side: usize) -> f32 {
        half_area(self.bounds.map(|axis| axis[side + 2] - axis[side]))
    }
}

impl Renumbered for Node8 {
    fn children(&mut self) -> &mut [Child] {
        &mut self.children
    }

    fn half_area(&self, side: usize) -> f32 {
        half_area(self.bounds.map(|axis| axis[1][side] - axis[0][side]))
    }
}

fn half_area([x, y, z]: [f32; 3]) -> f32 {
    x * y + y * z + z * x
}

/// A node that can join a treelet, first the one that most rays visit: the one with the largest
/// box, and of equal ones the first.
type Candidate = (u32, Reverse<u32>);

/// Sorts nodes by treelets of at most `most` nodes. Every node stays behind its parent.
pub(super) fn in_treelets<N: Renumbered>(nodes: &[N], most: usize) -> Vec<N> {
    let mut order = Vec::with_capacity(nodes.len());
    let mut roots: Vec<Candidate> = Vec::new();
    if !nodes.is_empty() {
        roots.push((0, Reverse(0)));
    }
    while let Some(root) = roots.pop() {
        let mut candidates = BinaryHeap::from([root]);
        for _ in 0..most.max(1) {
            let Some((_, Reverse(at))) = candidates.pop() else {
                break;
            };
            order.push(at);
            let mut node = nodes[at as usize];
            let inner = |(_, child): &(usize, Child)| !child.is_leaf();
            let children: Vec<_> = node.children().iter().copied().enumerate().collect();
            for (side, child) in children.into_iter().filter(inner) {
                // Bits of numbers that are not negative sort like the numbers.
                let area = node.half_area(side).max(0.0).to_bits();
                candidates.push((area, Reverse(child.0)));
            }
        }
        // The largest of the nodes below begins the next treelet.
        roots.extend(candidates.into_sorted_vec());
    }
    let mut numbers = vec![0; nodes.len()];
    for (number, at) in (0u32..).zip(&order) {
        numbers[*at as usize] = number;
    }
    let renumbered = |at: u32| {
        let mut node = nodes[at as usize];
        for child in node.children().iter_mut().filter(|child| !child.is_leaf()) {
            *child = Child(numbers[child.0 as usize]);
        }
        node
    };
    order.into_iter().map(renumbered).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Bvh;
    use super::*;
    use glam::DVec3;
    use lab::traversal::reference::TestMesh;

    /// Children of every node, without the numbers of nodes, in depth-first order.
    fn shape(nodes: &[Node8]) -> Vec<Vec<Option<Child>>> {
        let (mut out, mut open) = (Vec::new(), vec![Child(0)]);
        while let Some(child) = open.pop() {
            let mut node = nodes[child.0 as usize];
            let leaf = |child: &Child| child.is_leaf().then_some(*child);
            out.push(node.children().iter().map(leaf).collect());
            open.extend(node.children().iter().filter(|child| !child.is_leaf()));
        }
        out
    }

    #[test]
    fn treelets_keep_the_tree_and_join_parents_with_their_largest_children() {
        let triangles = TestMesh::torus(160, 80).rounded(DVec3::ZERO);
        let bvh = Bvh::build(&triangles, |_| false).expect("builds");
        let sorted = in_treelets(&bvh.nodes8, 16);
        assert_eq!(shape(&sorted), shape(&bvh.nodes8));
        // The area of children that are close behind their parents.
        let near = |nodes: &[Node8]| {
            let mut area = 0.0;
            for (number, node) in (0u32..).zip(nodes) {
                for (side, child) in node.children.iter().enumerate() {
                    if !child.is_leaf() {
                        assert!(child.0 > number);
                        area += f32::from(u8::from(child.0 - number < 16)) * node.half_area(side);
                    }
                }
            }
            area
        };
        let (before, after) = (near(&bvh.nodes8), near(&sorted));
        assert!(after > 1.2 * before, "{after} of {before}");
        // Treelets of one node are depth first.
        assert_eq!(in_treelets(&bvh.nodes8, 1).len(), bvh.nodes8.len());
    }
}
