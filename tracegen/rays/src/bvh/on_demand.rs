//! The tree that is built on demand besides the binary and the eight-wide one.

use super::build::{Layout, emit_wide};
use super::compress::{CompressedNode, compressed};
use super::node::{NODE4_BYTES, Node2, Node8};
use super::treelets::in_treelets;
use formats::raytrace::{ChildOrder, TraversalKind};
use obvhs::bvh2::Bvh2;

/// The tree that is traversed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TreeOptions {
    /// Its kind.
    pub kind: TraversalKind,
    /// Size of its treelets. Without, nodes are depth first.
    pub treelet_bytes: Option<u32>,
    /// The order in which recorded rays visit children.
    pub child_order: ChildOrder,
    /// Whether a scene's repeated meshes are instances of one tree each.
    pub instances: bool,
    /// Whether the tree can be refitted to other positions of its triangles.
    pub refit: bool,
}

impl TreeOptions {
    /// Most nodes of a treelet, if there are treelets.
    pub(super) fn treelet_nodes(self) -> Option<usize> {
        let nodes = |bytes: u32| bytes as usize / node_bytes(self.kind);
        self.treelet_bytes.map(nodes)
    }
}

impl From<TraversalKind> for TreeOptions {
    fn from(kind: TraversalKind) -> Self {
        Self {
            kind,
            treelet_bytes: None,
            child_order: ChildOrder::Nearest,
            instances: false,
            refit: false,
        }
    }
}

/// Bytes of a node in a ray-tracing unit's memory.
pub(super) fn node_bytes(kind: TraversalKind) -> usize {
    match kind {
        TraversalKind::Bvh2 => size_of::<Node2>(),
        TraversalKind::Bvh4 => NODE4_BYTES,
        TraversalKind::Bvh8 => size_of::<Node8>(),
        TraversalKind::Cwbvh8 => size_of::<CompressedNode>(),
    }
}

/// A four-wide tree, or an eight-wide one of compressed nodes.
#[derive(Default)]
pub(super) struct OnDemandTree {
    pub kind: Option<TraversalKind>,
    /// Only the first four children are used in a four-wide tree.
    pub nodes: Vec<Node8>,
    /// By block, the slot of its first triangle.
    pub first_slots: Vec<u32>,
    pub depth: u32,
}

impl OnDemandTree {
    /// The tree that the options describe, if it is not one of the two others.
    pub fn new(options: TreeOptions, tree: &Bvh2, layout: &Layout, eight: (&[Node8], u32)) -> Self {
        let sorted = |nodes: Vec<Node8>| match options.treelet_nodes() {
            Some(most) => in_treelets(&nodes, most),
            None => nodes,
        };
        let kind = Some(options.kind);
        match options.kind {
            TraversalKind::Bvh2 | TraversalKind::Bvh8 => Self::default(),
            TraversalKind::Bvh4 => {
                let (nodes, depth) = emit_wide(tree, &layout.children, options.kind.width());
                Self {
                    kind,
                    nodes: sorted(nodes),
                    first_slots: layout.first_slots.clone(),
                    depth,
                }
            }
            TraversalKind::Cwbvh8 => {
                let nodes = sorted(eight.0.to_vec());
                let (nodes, first_slots) = compressed(&nodes, layout.blocks.len());
                Self {
                    kind,
                    nodes,
                    first_slots,
                    depth: eight.1,
                }
            }
        }
    }
}
