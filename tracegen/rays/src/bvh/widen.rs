//! Chooses which nodes of the binary tree become nodes of the four- or eight-wide tree.
//!
//! The chosen nodes cost least: the cost is the sum of their areas and of the areas of the leaves
//! below each (Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs", HPG 2017, section 3.1, without its sum over triangles). The leaves stay as
//! they are.

use super::collapse::parents_first;
use obvhs::bvh2::Bvh2;

/// Most children of a wide node.
pub(super) const MAX_WIDTH: usize = 8;

/// Cost of a leaf's area for every wide node above it. A ray ends in a leaf, and more probably in a
/// large one, so large leaves belong close to the root.
const LEAF_DEPTH_COST: f32 = 0.6;

/// How many wide children the two children of a binary node become, or zeros if the node itself
/// becomes one.
type Shares = [u8; 2];

/// The choice for every node of a binary tree.
pub(super) struct Widening {
    /// By node and by the most wide children that its subtree may become, less one. The last is the
    /// choice for a wide node's own children.
    shares: Vec<[Shares; MAX_WIDTH]>,
    width: usize,
}

impl Widening {
    /// Finds the cheapest choice for nodes of up to `width` children, bottom up.
    pub(super) fn cheapest(tree: &Bvh2, width: usize) -> Self {
        let mut shares = vec![[[0; 2]; MAX_WIDTH]; tree.nodes.len()];
        // Least cost of all wide nodes of a subtree that becomes at most so many children.
        let mut costs = vec![[0.0f32; MAX_WIDTH]; tree.nodes.len()];
        let mut leaf_areas = vec![0.0f32; tree.nodes.len()];
        for at in parents_first(tree).into_iter().rev() {
            let node = &tree.nodes[at];
            if node.is_leaf() {
                leaf_areas[at] = node.aabb().half_area();
                continue;
            }
            let first = node.first_index as usize;
            leaf_areas[at] = leaf_areas[first] + leaf_areas[first + 1];
            let (left, right) = (costs[first], costs[first + 1]);
            let mut cost = [f32::INFINITY; MAX_WIDTH];
            for most in 2..=width {
                (cost[most - 1], shares[at][most - 1]) = (cost[most - 2], shares[at][most - 2]);
                for k in 1..most {
                    let sum = left[k - 1] + right[most - k - 1];
                    if sum < cost[most - 1] {
                        cost[most - 1] = sum;
                        shares[at][most - 1] = [k as u8, (most - k) as u8];
                    }
                }
            }
            // As one child, the node is wide and has all its children.
            let own = node.aabb().half_area() + LEAF_DEPTH_COST * leaf_areas[at];
            let whole = own + cost[width - 1];
            for most in 0..width - 1 {
                if whole <= cost[most] {
                    (cost[most], shares[at][most]) = (whole, [0; 2]);
                }
            }
            costs[at] = cost;
        }
        Self { shares, width }
    }

    /// The nodes that become the children of a wide node, in the order of the binary tree.
    pub(super) fn children(&self, tree: &Bvh2, node: u32) -> Vec<u32> {
        let mut children = Vec::with_capacity(self.width);
        let mut open = vec![(node, self.width)];
        while let Some((at, most)) = open.pop() {
            let [left, right] = self.shares[at as usize][most - 1].map(usize::from);
            if left == 0 {
                children.push(at);
            } else {
                let first = tree.nodes[at as usize].first_index;
                open.extend([(first + 1, right), (first, left)]);
            }
        }
        children
    }
}

#[cfg(test)]
mod tests {
    use super::super::build::build_binary;
    use super::*;
    use glam::DVec3;
    use lab::traversal::reference::TestMesh;

    /// The cost of all wide nodes, and the leaves below them in order.
    fn widened(tree: &Bvh2, width: usize, children: impl Fn(u32) -> Vec<u32>) -> (f64, Vec<u32>) {
        let (mut cost, mut leaves, mut open) = (0.0, Vec::new(), vec![(0, 0.0)]);
        while let Some((at, depth)) = open.pop() {
            let node = &tree.nodes[at as usize];
            let area = f64::from(node.aabb().half_area());
            if node.is_leaf() {
                leaves.push(at);
                cost += area * depth * f64::from(LEAF_DEPTH_COST);
                continue;
            }
            cost += area;
            let children = children(at);
            assert!((2..=width).contains(&children.len()));
            open.extend(children.into_iter().map(|child| (child, depth + 1.0)));
        }
        leaves.sort_unstable();
        (cost, leaves)
    }

    /// The widest child is opened until there are enough.
    fn greedy(tree: &Bvh2, width: usize, node: u32) -> Vec<u32> {
        let mut open = vec![node];
        while open.len() < width {
            let area = |at: u32| tree.nodes[at as usize].aabb().half_area();
            let inner = (0..open.len()).filter(|i| !tree.nodes[open[*i] as usize].is_leaf());
            let Some(i) = inner.max_by(|a, b| area(open[*a]).total_cmp(&area(open[*b]))) else {
                break;
            };
            let first = tree.nodes[open.swap_remove(i) as usize].first_index;
            open.extend([first, first + 1]);
        }
        open
    }

    #[test]
    fn the_cost_is_below_that_of_greedy_opening_and_leaves_are_kept() {
        for mesh in [TestMesh::torus(160, 80), TestMesh::sphere(4)] {
            let tree = build_binary(&mesh.rounded(DVec3::ZERO), 8);
            for (width, most) in [(4, 0.99), (8, 0.97)] {
                let widening = Widening::cheapest(&tree, width);
                let (cost, leaves) = widened(&tree, width, |at| widening.children(&tree, at));
                let (greedy_cost, greedy_leaves) =
                    widened(&tree, width, |at| greedy(&tree, width, at));
                assert_eq!(leaves, greedy_leaves);
                assert!(cost < most * greedy_cost, "{cost} of {greedy_cost}");
            }
        }
    }
}
