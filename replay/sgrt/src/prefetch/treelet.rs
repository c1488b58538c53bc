//! Treelet prefetch (Chou, Nowicki, Aamodt, "Treelet Prefetching For Ray Tracing", MICRO 2023): the hierarchy is split into
//! connected parts of limited size, and a ray that visits the root of one fetches all of it.
//!
//! The paper's traversal with two stacks, which visits a treelet completely before the next, is not part of it: the order
//! of visits is the trace's.

use super::{PrefetchRow, RayPrefetcher, Step};
use formats::raytrace::{BvhSummary, ChildKind, Hierarchy, Visit};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

pub(super) const ROW: PrefetchRow = PrefetchRow {
    name: "treelet",
    help: "The rest of the treelet of at most `treelet_bytes` at whose root a ray arrives (MICRO 2023)",
    build: Some(|config, bvh, hierarchy| {
        Box::new(Treelets::new(config.treelet_bytes.into(), bvh, hierarchy))
    }),
};

/// By node: for the root of a treelet, the treelet's other nodes and leaves; empty for all other nodes.
pub(super) struct Treelets {
    pub(super) below: Vec<Vec<ChildKind>>,
}

impl Treelets {
    /// Forms treelets from the root down. Each takes, of the children of its nodes, the one with the largest box first,
    /// because most rays visit it; the first one that no longer fits ends it.
    pub(super) fn new(most_bytes: u64, bvh: &BvhSummary, hierarchy: &Hierarchy) -> Self {
        let width = bvh.traversal.width();
        let bytes = |kind: ChildKind| match kind {
            ChildKind::Node(_) => u64::from(bvh.bytes_per_node),
            ChildKind::Leaf(_, count) => u64::from(count) * u64::from(bvh.bytes_per_triangle),
        };
        let mut below = vec![Vec::new(); hierarchy.children.len() / width];
        let mut roots = if below.is_empty() { vec![] } else { vec![0u32] };
        while let Some(root) = roots.pop() {
            let mut used = bytes(ChildKind::Node(root));
            let mut candidates = BinaryHeap::new();
            let mut open = root;
            loop {
                let first = width * open as usize;
                for (at, child) in hierarchy.children[first..first + width].iter().enumerate() {
                    if let Some(child) = child {
                        let [x, y, z] = [0, 1, 2].map(|axis| child.max[axis] - child.min[axis]);
                        // Bits of numbers that are not negative sort like the numbers.
                        let area = (x * y + y * z + z * x).to_bits();
                        candidates.push((area, Reverse(first + at)));
                    }
                }
                // The next node to open; leaves on the way join at once.
                let next = std::iter::from_fn(|| candidates.pop().map(|(_, Reverse(at))| at))
                    .find_map(|at| {
                        let kind = hierarchy.children[at].as_ref()?.kind;
                        used += bytes(kind);
                        if used > most_bytes {
                            return Some(Err(at));
                        }
                        below[root as usize].push(kind);
                        match kind {
                            ChildKind::Node(node) => Some(Ok(node)),
                            ChildKind::Leaf(..) => None,
                        }
                    });
                match next {
                    Some(Ok(node)) => open = node,
                    Some(Err(at)) => {
                        let rest = candidates
                            .into_iter()
                            .map(|(_, Reverse(at))| at)
                            .chain([at]);
                        let kinds =
                            rest.filter_map(|at| Some(hierarchy.children[at].as_ref()?.kind));
                        roots.extend(kinds.filter_map(|kind| match kind {
                            ChildKind::Node(node) => Some(node),
                            ChildKind::Leaf(..) => None,
                        }));
                        break;
                    }
                    None => break,
                }
            }
        }
        Self { below }
    }
}

impl RayPrefetcher for Treelets {
    fn observe(&self, step: &Step<'_>, ahead: &mut Vec<ChildKind>) {
        if let Visit::Node(node) = step.visit
            && let Some(below) = self.below.get(node as usize)
        {
            ahead.extend(below);
        }
    }
}
