//! The content of the hierarchy: boxes and children of the inner nodes, and the triangle of each slot.

use super::tables::in_range;
use super::{BvhSummary, TraversalKind};
use crate::error::{Broken, ensure};
use serde::Serialize;

/// What a node refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChildKind {
    /// An inner node.
    Node(u32),
    /// A leaf: its first slot and its number of triangles, at least 1.
    Leaf(u32, u32),
}

/// A child of an inner node, with its box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HierarchyChild {
    /// Inner node or leaf.
    pub kind: ChildKind,
    /// Corner of the box with the smallest coordinates, relative to the trace's origin.
    pub min: [f32; 3],
    /// Corner with the largest coordinates.
    pub max: [f32; 3],
}

/// The triangle of a slot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HierarchyTriangle {
    /// Primitive number: triangles of all instances in submission order.
    pub primitive: u32,
    /// Whether a ray that meets the triangle looks up its alpha (masked, blended or glass).
    pub masked: bool,
    /// Vertices relative to the trace's origin, counter-clockwise from the front.
    pub vertices: [[f32; 3]; 3],
}

/// All inner nodes and triangles of the tree that the rays traversed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hierarchy {
    /// Children of every inner node, [`TraversalKind::width`] each; `None` where there is none.
    pub children: Vec<Option<HierarchyChild>>,
    /// Triangles by slot.
    pub triangles: Vec<HierarchyTriangle>,
}

impl TraversalKind {
    /// Largest number of children of an inner node.
    pub const fn width(self) -> usize {
        match self {
            Self::Bvh2 => 2,
            Self::Bvh4 => 4,
            Self::Bvh8 | Self::Cwbvh8 => 8,
        }
    }
}

/// The parents of nodes and slots, for checks of visits.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Parents {
    /// The node of which each node is a child; `u32::MAX` for the root.
    pub of_nodes: Vec<u32>,
    /// The node of which each slot's leaf is a child.
    pub of_slots: Vec<u32>,
}

impl Hierarchy {
    /// Checks nodes and triangles against the summary, and returns their parents. Every node but the root is
    /// a child of one node before it, and every slot is in one leaf.
    pub(super) fn check(&self, bvh: &BvhSummary) -> Result<Parents, Broken> {
        let width = bvh.traversal.width();
        let nodes = self.children.len() / width;
        let counts = [
            (nodes as u64, bvh.nodes),
            (self.triangles.len() as u64, bvh.triangles),
        ];
        let [(found_nodes, _), (found_triangles, _)] = counts;
        ensure(
            counts.iter().all(|(found, expected)| found == expected)
                && self.children.len().is_multiple_of(width),
            "hierarchy",
            format_args!("{} nodes and {} triangles", bvh.nodes, bvh.triangles),
            format_args!("{found_nodes} and {found_triangles}"),
        )?;
        let mut parents = Parents {
            of_nodes: vec![u32::MAX; nodes],
            of_slots: vec![u32::MAX; self.triangles.len()],
        };
        let mut leaves = 0;
        for (number, children) in (0u32..).zip(self.children.chunks_exact(width)) {
            let what = format_args!("node {number}");
            let is_child = number == 0 || parents.of_nodes.get(number as usize) != Some(&u32::MAX);
            ensure(is_child, what, "a child of a node before it", "of none")?;
            for child in children.iter().flatten() {
                let HierarchyChild { kind, min, max } = child;
                let corners = min.iter().zip(max);
                ensure(
                    { corners }.all(|(min, max)| min <= max && in_range(&[*min, *max])),
                    what,
                    "boxes within 1e18 m, minimum first",
                    format_args!("{min:?} to {max:?}"),
                )?;
                let (adopted, expected) = parents.adopt(number, *kind);
                ensure(adopted, what, expected, format_args!("{kind:?}"))?;
                leaves += u64::from(matches!(child.kind, ChildKind::Leaf(..)));
            }
        }
        let is_whole = parents.of_slots.iter().all(|parent| *parent != u32::MAX);
        ensure(
            is_whole,
            "hierarchy",
            "every slot in a leaf",
            "a slot in none",
        )?;
        let expected = format_args!("{} leaves", bvh.leaves);
        ensure(leaves == bvh.leaves, "hierarchy", expected, leaves)?;
        for (slot, triangle) in self.triangles.iter().enumerate() {
            ensure(
                in_range(triangle.vertices.as_flattened()),
                format_args!("slot {slot}"),
                "vertices within 1e18 m",
                format_args!("{:?}", triangle.vertices),
            )?;
        }
        Ok(parents)
    }
}

impl Parents {
    /// Enters a child of a node: whether it fits, and what was expected.
    fn adopt(&mut self, node: u32, kind: ChildKind) -> (bool, &'static str) {
        let free = |entry: &mut u32| std::mem::replace(entry, node) == u32::MAX;
        match kind {
            ChildKind::Node(child) => {
                let entry = self.of_nodes.get_mut(child as usize);
                let fits = entry.filter(|_| child > node).is_some_and(free);
                (fits, "a node behind its parent and of no other")
            }
            ChildKind::Leaf(first, count) => {
                let range = first as usize..(first as usize).saturating_add(count as usize);
                let slots = self.of_slots.get_mut(range).filter(|_| count > 0);
                let fits = slots.is_some_and(|slots| slots.iter_mut().all(free));
                (fits, "a leaf of slots of no other leaf")
            }
        }
    }
}
