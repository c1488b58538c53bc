//! The content of a tree, as traces store it.

use super::Bvh;
use super::node::{Block, Child, MASKED, Node8};
use formats::raytrace::{ChildKind, Hierarchy, HierarchyChild, HierarchyTriangle, TraversalKind};

impl Bvh {
    /// All inner nodes of a tree without instances, with the boxes that its traversal tests, and its triangles by slot.
    pub fn contents(&self, traversal: TraversalKind) -> Hierarchy {
        let slots = self.slots_of(traversal);
        let wide = |nodes: &[Node8]| wide_children(nodes, traversal.width(), slots);
        let children = match traversal {
            TraversalKind::Bvh2 => (self.nodes2.iter())
                .flat_map(|node| {
                    [0, 1].map(|side| {
                        let corner = |far: usize| node.bounds.map(|axis| axis[side + 2 * far]);
                        content(node.children[side], slots, corner(0), corner(1))
                    })
                })
                .collect(),
            TraversalKind::Bvh8 => wide(&self.nodes8),
            TraversalKind::Bvh4 | TraversalKind::Cwbvh8 => wide(&self.on_demand.nodes),
        };
        let mut blocks: Vec<_> = slots.iter().zip(&self.blocks).collect();
        blocks.sort_unstable_by_key(|(slot, _)| **slot);
        let triangles = blocks.into_iter().flat_map(|(_, block)| triangles(block));
        Hierarchy {
            children,
            triangles: triangles.collect(),
        }
    }
}

fn wide_children(nodes: &[Node8], width: usize, slots: &[u32]) -> Vec<Option<HierarchyChild>> {
    let children = nodes.iter().flat_map(|node| {
        (0..width).map(|side| {
            let [min, max] = [0, 1].map(|far| node.bounds.map(|axis| axis[far][side]));
            content(node.children[side], slots, min, max)
        })
    });
    children.collect()
}

fn content(child: Child, slots: &[u32], min: [f32; 3], max: [f32; 3]) -> Option<HierarchyChild> {
    let kind = if child == Child::NONE {
        return None;
    } else if child.is_leaf() {
        let (block, count) = child.leaf_range();
        ChildKind::Leaf(slots[block as usize], count)
    } else {
        ChildKind::Node(child.0)
    };
    Some(HierarchyChild { kind, min, max })
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
