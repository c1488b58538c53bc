//! The nodes of a file as a tree, and their transforms at a time.

use super::Joint;
use glam::DAffine3;

/// The nodes of a file, by their index in it.
#[derive(Clone, Debug)]
pub(crate) struct Skeleton {
    pub joints: Vec<Joint>,
    pub tree: Tree,
}

/// The hierarchy of the nodes.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    pub parents: Vec<Option<usize>>,
    /// All nodes; parents come first.
    pub order: Vec<usize>,
}

impl Tree {
    /// A node and its ancestors.
    pub fn chain(&self, node: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(node), |&node| self.parents[node])
    }

    /// For each node, whether it or one of its ancestors satisfies `is_one`.
    pub fn below(&self, is_one: impl Fn(usize) -> bool) -> Vec<bool> {
        let mut below = vec![false; self.parents.len()];
        for &node in &self.order {
            below[node] = is_one(node) || self.parents[node].is_some_and(|parent| below[parent]);
        }
        below
    }
}

impl Skeleton {
    /// The transforms to the world, by node.
    pub fn worlds(&self, time_s: f64) -> Vec<DAffine3> {
        let mut worlds = vec![DAffine3::IDENTITY; self.joints.len()];
        for &node in &self.tree.order {
            let local = self.joints[node].transform(time_s);
            worlds[node] = self.tree.parents[node].map_or(local, |parent| worlds[parent] * local);
        }
        worlds
    }
}
