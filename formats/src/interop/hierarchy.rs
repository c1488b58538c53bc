//! The content of a hierarchy as rows and as JSON.

use super::columns::{Field, Tabular, columns};
use crate::raytrace::{BvhSummary, ChildKind, Hierarchy, HierarchyChild, HierarchyTriangle, Visit};
use serde::Serialize;

/// A child of an inner node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChildRow {
    /// The inner node.
    pub node: u32,
    /// Number of the child within the node.
    pub number: u8,
    /// The child.
    pub child: HierarchyChild,
}

const CHILD_KINDS: &[&str] = &["node", "leaf"];

impl ChildRow {
    /// Node, or first slot of the leaf; and the number of triangles.
    fn index(&self) -> (u32, u32) {
        match self.child.kind {
            ChildKind::Node(index) => (index, 0),
            ChildKind::Leaf(first, count) => (first, count),
        }
    }
}

impl Tabular for ChildRow {
    const FIELDS: &'static [Field<Self>] = columns![r:
        "node" U32 r.node,
        "child" U8 r.number,
        "kind" [CHILD_KINDS] u8::from(matches!(r.child.kind, ChildKind::Leaf(..))),
        "index" U32 r.index().0,
        "triangles" U32 r.index().1,
        "min_x" F32 r.child.min[0],
        "min_y" F32 r.child.min[1],
        "min_z" F32 r.child.min[2],
        "max_x" F32 r.child.max[0],
        "max_y" F32 r.child.max[1],
        "max_z" F32 r.child.max[2],
    ];
}

/// The triangle of a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlotRow {
    /// Its slot.
    pub slot: u32,
    /// The triangle.
    pub triangle: HierarchyTriangle,
}

impl Tabular for SlotRow {
    const FIELDS: &'static [Field<Self>] = columns![r:
        "slot" U32 r.slot,
        "primitive" U32 r.triangle.primitive,
        "masked" U8 u8::from(r.triangle.masked),
        "v0_x" F32 r.triangle.vertices[0][0],
        "v0_y" F32 r.triangle.vertices[0][1],
        "v0_z" F32 r.triangle.vertices[0][2],
        "v1_x" F32 r.triangle.vertices[1][0],
        "v1_y" F32 r.triangle.vertices[1][1],
        "v1_z" F32 r.triangle.vertices[1][2],
        "v2_x" F32 r.triangle.vertices[2][0],
        "v2_y" F32 r.triangle.vertices[2][1],
        "v2_z" F32 r.triangle.vertices[2][2],
    ];
}

/// The children of all inner nodes, node by node.
pub fn child_rows(bvh: &BvhSummary, hierarchy: &Hierarchy) -> impl Iterator<Item = ChildRow> {
    let nodes = (0u32..).zip(hierarchy.children.chunks(bvh.traversal.width()));
    nodes.flat_map(|(node, children)| {
        (0u8..).zip(children).filter_map(move |(number, child)| {
            child.map(|child| ChildRow {
                node,
                number,
                child,
            })
        })
    })
}

/// The triangles of all slots.
pub fn slot_rows(hierarchy: &Hierarchy) -> impl Iterator<Item = SlotRow> {
    let triangles = (0u32..).zip(&hierarchy.triangles);
    triangles.map(|(slot, &triangle)| SlotRow { slot, triangle })
}

#[derive(Serialize)]
struct NodeLine {
    node: u32,
    address: u64,
    children: Vec<Option<ChildLine>>,
}

#[derive(Serialize)]
struct ChildLine {
    #[serde(skip_serializing_if = "Option::is_none")]
    node: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    slot: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<u32>,
    min: [f32; 3],
    max: [f32; 3],
}

impl From<&HierarchyChild> for ChildLine {
    fn from(child: &HierarchyChild) -> Self {
        let (node, leaf) = match child.kind {
            ChildKind::Node(index) => (Some(index), None),
            ChildKind::Leaf(first, count) => (None, Some((first, count))),
        };
        Self {
            node,
            slot: leaf.map(|(first, _)| first),
            triangles: leaf.map(|(_, count)| count),
            min: child.min,
            max: child.max,
        }
    }
}

/// An inner node as `replay dump --nodes` prints it.
///
/// # Errors
/// None in practice; the signature is the serialiser's.
pub fn node_to_json(
    bvh: &BvhSummary,
    node: u32,
    children: &[Option<HierarchyChild>],
) -> serde_json::Result<String> {
    serde_json::to_string(&NodeLine {
        node,
        address: bvh.address(Visit::Node(node)),
        children: (children.iter())
            .map(|child| child.as_ref().map(ChildLine::from))
            .collect(),
    })
}

#[derive(Serialize)]
struct SlotLine<'a> {
    slot: u32,
    address: u64,
    #[serde(flatten)]
    triangle: &'a HierarchyTriangle,
}

/// The triangle of a slot as `replay dump --slots` prints it.
///
/// # Errors
/// See [`node_to_json`].
pub fn slot_to_json(bvh: &BvhSummary, row: &SlotRow) -> serde_json::Result<String> {
    serde_json::to_string(&SlotLine {
        slot: row.slot,
        address: bvh.address(Visit::Triangle(row.slot)),
        triangle: &row.triangle,
    })
}
