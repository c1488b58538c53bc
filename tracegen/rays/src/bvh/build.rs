//! Builds the binary tree with obvhs and lays the trees out for traversal.

use super::collapse::{BLOCK_COST, MAX_TRIANGLES, collapse};
use super::node::{BLOCK, Block, Child, MASKED, Node2, Node8};
use super::widen::{MAX_WIDTH, Widening};
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocSearchDistance, SortPrecision};
use std::time::Duration;

/// Fixed settings: counts of two traces are comparable only with the same builder. The presets
/// limit PLOC's search near the leaves, which makes trees of regular tessellations four times as
/// costly. [`collapse`] creates the leaves, not obvhs.
const SETTINGS: BvhBuildParams = BvhBuildParams {
    pre_split: false,
    ploc_search_distance: PlocSearchDistance::Medium,
    search_depth_threshold: 0,
    reinsertion_batch_ratio: 1.0,
    post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
    sort_precision: SortPrecision::U64,
    max_prims_per_leaf: 1,
    collapse_traversal_cost: 1.0,
};

/// Rounds of reinsertion over the collapsed tree, each over every node. They save 5 % of the steps
/// on the meadow; further rounds save 1 %.
const REINSERTIONS_AFTER_COLLAPSE: u32 = 2;

/// The settings by name, for the trace.
pub fn settings() -> Vec<(String, String)> {
    let s = SETTINGS;
    [
        ("ploc_search_distance", "14".to_owned()),
        (
            "search_depth_threshold",
            s.search_depth_threshold.to_string(),
        ),
        (
            "reinsertion_batch_ratio",
            s.reinsertion_batch_ratio.to_string(),
        ),
        ("sort_bits", "64".to_owned()),
        ("max_triangles_per_leaf", MAX_TRIANGLES.to_string()),
        ("triangles_per_block", BLOCK.to_string()),
        ("block_cost_steps", BLOCK_COST.to_string()),
        (
            "reinsertions_after_collapse",
            REINSERTIONS_AFTER_COLLAPSE.to_string(),
        ),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}

/// A tree in obvhs's format, in which the children of every inner node are adjacent.
/// Leaves have up to `most` triangles.
pub(super) fn build_binary(triangles: &[[[f32; 3]; 3]], most: u32) -> Bvh2 {
    let boxes: Vec<Aabb> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(Vec3A::from);
            Aabb::new(a.min(b).min(c), a.max(b).max(c))
        })
        .collect();
    let mut tree = collapse(
        &build_bvh2(&boxes, SETTINGS, &mut Duration::default()),
        most,
    );
    let mut optimizer = ReinsertionOptimizer::default();
    for _ in 0..REINSERTIONS_AFTER_COLLAPSE {
        optimizer.run(&mut tree, 1.0, None);
    }
    tree
}

/// Results of the layout.
#[derive(Default)]
pub(super) struct Layout {
    pub nodes2: Vec<Node2>,
    pub blocks: Vec<Block>,
    pub first_slots: Vec<u32>,
    /// By node of the binary tree, its leaf.
    pub children: Vec<Child>,
    pub leaves: u64,
    pub depth2: u32,
    pub sah_cost: f64,
}

/// Lays out leaves and binary tree depth first, so that related nodes share pages.
///
/// `numbers[i]` is the primitive number (with its mask flag) of triangle `i`.
pub(super) fn lay_out(tree: &Bvh2, triangles: &[[[f32; 3]; 3]], numbers: &[u32]) -> Layout {
    let mut out = Layout::default();
    if tree.nodes.is_empty() {
        return out;
    }
    let leaves = place_leaves(tree, triangles, numbers, &mut out);
    out.sah_cost = sah_cost(tree);
    emit2(tree, &leaves, &mut out);
    out.children = leaves;
    out
}

/// Places the blocks of every leaf in depth-first order. The result maps a tree node to its leaf.
fn place_leaves(
    tree: &Bvh2,
    triangles: &[[[f32; 3]; 3]],
    numbers: &[u32],
    out: &mut Layout,
) -> Vec<Child> {
    let mut leaves = vec![Child::NONE; tree.nodes.len()];
    let mut stack = vec![0u32];
    let mut slot = 0u32;
    while let Some(at) = stack.pop() {
        let node = &tree.nodes[at as usize];
        if !node.is_leaf() {
            stack.extend([node.first_index + 1, node.first_index]);
            continue;
        }
        let first = node.first_index as usize;
        let mut members: Vec<u32> =
            tree.primitive_indices[first..first + node.prim_count as usize].to_vec();
        members.sort_unstable_by_key(|m| numbers[*m as usize] & !MASKED);
        leaves[at as usize] = Child::leaf(out.blocks.len() as u32, node.prim_count);
        out.leaves += 1;
        for chunk in members.chunks(BLOCK) {
            let mut block = Block::EMPTY;
            for (lane, member) in chunk.iter().enumerate() {
                block.primitives[lane] = numbers[*member as usize];
                for (v, vertex) in triangles[*member as usize].iter().enumerate() {
                    for (a, value) in vertex.iter().enumerate() {
                        block.vertices[v][a][lane] = *value;
                    }
                }
            }
            out.first_slots.push(slot);
            slot += chunk.len() as u32;
            out.blocks.push(block);
        }
    }
    leaves
}

/// Expected cost of a random ray: inner nodes and triangles weighted by their area.
fn sah_cost(tree: &Bvh2) -> f64 {
    let area = |i: usize| f64::from(tree.nodes[i].aabb().half_area());
    let root = area(0);
    if root <= 0.0 {
        return 0.0;
    }
    let cost: f64 = (0..tree.nodes.len())
        .map(|i| area(i) * f64::from(tree.nodes[i].prim_count.max(1)))
        .sum();
    cost / root
}

const INSIDE_OUT: ([f32; 3], [f32; 3]) = ([f32::MAX; 3], [f32::MIN; 3]);

fn corners(tree: &Bvh2, node: u32) -> ([f32; 3], [f32; 3]) {
    let aabb = tree.nodes[node as usize].aabb();
    (aabb.min.to_array(), aabb.max.to_array())
}

fn emit2(tree: &Bvh2, leaves: &[Child], out: &mut Layout) {
    // A tree with one leaf still gets an inner node, so that traversal always starts at one.
    let root_is_leaf = tree.nodes[0].is_leaf();
    let mut stack = vec![(0u32, None, 1u32)];
    while let Some((at, parent, depth)) = stack.pop() {
        let here = out.nodes2.len() as u32;
        if let Some((node, side)) = parent {
            let node: &mut Node2 = &mut out.nodes2[node as usize];
            node.children[side as usize] = Child(here);
        }
        out.depth2 = out.depth2.max(depth);
        let mut node = Node2 {
            bounds: [[0.0; 4]; 3],
            children: [Child::NONE; 2],
        };
        let first = tree.nodes[at as usize].first_index;
        // The larger child, which is visited more often, directly follows its parent.
        let area = |side: u32| tree.nodes[(first + side) as usize].aabb().half_area();
        let order = if !root_is_leaf && area(1) > area(0) {
            [0u32, 1]
        } else {
            [1, 0]
        };
        for side in order {
            let member = match (root_is_leaf, side) {
                (true, 0) => Some(0),
                (true, _) => None,
                (false, _) => Some(first + side),
            };
            let (min, max) = member.map_or(INSIDE_OUT, |m| corners(tree, m));
            for axis in 0..3 {
                node.bounds[axis][side as usize] = min[axis];
                node.bounds[axis][side as usize + 2] = max[axis];
            }
            if let Some(m) = member {
                if tree.nodes[m as usize].is_leaf() {
                    node.children[side as usize] = leaves[m as usize];
                } else {
                    stack.push((m, Some((here, side)), depth + 1));
                }
            }
        }
        out.nodes2.push(node);
    }
}

/// Nodes of a wide tree, depth first, and its depth.
pub(super) fn emit_wide(tree: &Bvh2, leaves: &[Child], width: usize) -> (Vec<Node8>, u32) {
    let (mut nodes, mut deepest): (Vec<Node8>, _) = (Vec::new(), 0);
    if tree.nodes.is_empty() {
        return (nodes, deepest);
    }
    let widening = Widening::cheapest(tree, width);
    let mut stack = vec![(0u32, None, 1u32)];
    while let Some((at, parent, depth)) = stack.pop() {
        let here = nodes.len() as u32;
        if let Some((node, side)) = parent {
            let node: &mut Node8 = &mut nodes[node as usize];
            let side: usize = side;
            node.children[side] = Child(here);
        }
        deepest = deepest.max(depth);
        let mut node = Node8 {
            bounds: [[[f32::MAX; MAX_WIDTH], [f32::MIN; MAX_WIDTH]]; 3],
            children: [Child::NONE; MAX_WIDTH],
        };
        for (side, member) in widening.children(tree, at).into_iter().enumerate().rev() {
            let (min, max) = corners(tree, member);
            for axis in 0..3 {
                node.bounds[axis][0][side] = min[axis];
                node.bounds[axis][1][side] = max[axis];
            }
            if tree.nodes[member as usize].is_leaf() {
                node.children[side] = leaves[member as usize];
            } else {
                stack.push((member, Some((here, side)), depth + 1));
            }
        }
        nodes.push(node);
    }
    (nodes, deepest)
}
