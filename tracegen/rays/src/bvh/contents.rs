//! The content of a tree, as traces store it.

use super::Bvh;
use super::node::{Block, Child, MASKED};
use formats::raytrace::{ChildKind, Hierarchy, HierarchyChild, HierarchyTriangle, TraversalKind};

impl Bvh {
    /// All inner nodes of a tree, with the boxes that its traversal tests, and the triangles of both trees.
    #[must_use]
    pub fn contents(&self, traversal: TraversalKind) -> Hierarchy {
        let children = match traversal {
            TraversalKind::Bvh2 => (self.nodes2.iter())
                .flat_map(|node| {
                    [0, 1].map(|side| {
                        let corner = |far: usize| node.bounds.map(|axis| axis[side + 2 * far]);
                        self.child(node.children[side], corner(0), corner(1))
                    })
                })
                .collect(),
            TraversalKind::Bvh8 => (self.nodes8.iter())
                .flat_map(|node| {
                    std::array::from_fn::<_, 8, _>(|side| {
                        let [min, max] = [0, 1].map(|far| node.bounds.map(|axis| axis[far][side]));
                        self.child(node.children[side], min, max)
                    })
                })
                .collect(),
        };
        Hierarchy {
            children,
            triangles: self.blocks.iter().flat_map(triangles).collect(),
        }
    }

    fn child(&self, child: Child, min: [f32; 3], max: [f32; 3]) -> Option<HierarchyChild> {
        let kind = if child == Child::NONE {
            return None;
        } else if child.is_leaf() {
            let (block, count) = child.leaf_range();
            ChildKind::Leaf(self.first_slots[block as usize], count)
        } else {
            ChildKind::Node(child.0)
        };
        Some(HierarchyChild { kind, min, max })
    }
}

/// The triangles of a block. Its unused lanes come last.
fn triangles(block: &Block) -> impl Iterator<Item = HierarchyTriangle> {
    let used = |lane: &usize| !block.vertices[0][0][*lane].is_nan();
    let lanes = (0..block.primitives.len()).filter(used);
    lanes.map(|lane| HierarchyTriangle {
        primitive: block.primitives[lane] & !MASKED,
        masked: block.primitives[lane] & MASKED != 0,
        vertices: block.triangle(lane),
    })
}
