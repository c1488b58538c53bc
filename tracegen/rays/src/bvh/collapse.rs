//! Merges subtrees into leaves where that lowers the surface-area cost, counted per block.

use super::node::BLOCK;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

/// Most triangles in a leaf: two blocks.
pub(super) const MAX_TRIANGLES: u32 = 2 * BLOCK as u32;
/// Cost of testing a block, in steps. Testing four triangles costs as much as testing one, so a
/// leaf's cost is per block. The collapse in obvhs counts it per triangle.
pub(super) const BLOCK_COST: f32 = 1.0;

/// The tree with cheap subtrees of up to `most` triangles replaced by leaves.
pub(super) fn collapse(tree: &Bvh2, most: u32) -> Bvh2 {
    let Some(root) = tree.nodes.first() else {
        return Bvh2::default();
    };
    let order = parents_first(tree);
    let is_leaf = choose_leaves(tree, &order, most);
    let mut out = Bvh2 {
        nodes: vec![*root],
        ..Bvh2::default()
    };
    // Pairs of a node of the tree and its place in the output.
    let mut stack = vec![(0, 0)];
    while let Some((from, to)) = stack.pop() {
        let node: &Bvh2Node = &tree.nodes[from];
        let (count, first) = if is_leaf[from] {
            let first = out.primitive_indices.len();
            push_triangles(tree, from, &mut out.primitive_indices);
            (out.primitive_indices.len() - first, first)
        } else {
            let (child, place) = (node.first_index as usize, out.nodes.len());
            out.nodes.extend_from_slice(&tree.nodes[child..child + 2]);
            stack.extend([(child + 1, place + 1), (child, place)]);
            (0, place)
        };
        out.nodes[to] = Bvh2Node::new(*node.aabb(), count as u32, first as u32);
    }
    out
}

/// All nodes, each before its children.
pub(super) fn parents_first(tree: &Bvh2) -> Vec<usize> {
    let mut order = Vec::with_capacity(tree.nodes.len());
    let mut stack = vec![0];
    while let Some(at) = stack.pop() {
        order.push(at);
        let node = &tree.nodes[at];
        if !node.is_leaf() {
            let first = node.first_index as usize;
            stack.extend([first + 1, first]);
        }
    }
    order
}

/// Chooses bottom up whether keeping a node or making it a leaf is cheaper.
fn choose_leaves(tree: &Bvh2, parents_first: &[usize], most: u32) -> Vec<bool> {
    let mut triangles = vec![0u32; tree.nodes.len()];
    let mut cost = vec![0.0f32; tree.nodes.len()];
    let mut is_leaf = vec![false; tree.nodes.len()];
    for &at in parents_first.iter().rev() {
        let node = &tree.nodes[at];
        let area = node.aabb().half_area();
        if node.is_leaf() {
            triangles[at] = node.prim_count;
            cost[at] = f32::INFINITY;
        } else {
            let (left, right) = (node.first_index as usize, node.first_index as usize + 1);
            triangles[at] = triangles[left] + triangles[right];
            cost[at] = area + cost[left] + cost[right];
        }
        let as_leaf = area * BLOCK_COST * triangles[at].div_ceil(BLOCK as u32) as f32;
        if triangles[at] <= most && as_leaf <= cost[at] {
            is_leaf[at] = true;
            cost[at] = as_leaf;
        }
    }
    is_leaf
}

fn push_triangles(tree: &Bvh2, root: usize, out: &mut Vec<u32>) {
    let mut stack = vec![root];
    while let Some(at) = stack.pop() {
        let node = &tree.nodes[at];
        let first = node.first_index as usize;
        if node.is_leaf() {
            out.extend(&tree.primitive_indices[first..first + node.prim_count as usize]);
        } else {
            stack.extend([first + 1, first]);
        }
    }
}
