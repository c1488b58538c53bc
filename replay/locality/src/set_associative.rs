//! Set-associative LRU caches of many sizes and ways, simulated by the forest that sweeps use.

use crate::place::{ByOrigin, add};
use sim::memory::Forest;

/// Hits of a cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CacheHits {
    /// Capacity in lines.
    pub lines: u64,
    /// Associativity; none for fully associative.
    pub ways: Option<u32>,
    /// Hits by location of the previous use.
    pub hits: ByOrigin,
}

/// Caches that receive the same lines.
#[derive(Clone, Debug)]
pub(crate) struct SetAssociative {
    forest: Forest,
    trees: Vec<Tree>,
    depths: Vec<u8>,
}

/// All associativities of a number of sets.
#[derive(Clone, Debug)]
struct Tree {
    sets: u32,
    /// Requested associativities, ascending.
    ways: Vec<u32>,
    /// Reuses by depth.
    depths: Vec<ByOrigin>,
}

impl SetAssociative {
    /// Empty caches of at least one geometry: sets (a power of two) and ways.
    pub(crate) fn new(mut geometries: Vec<(u32, u32)>) -> Self {
        geometries.sort_unstable();
        geometries.dedup();
        let tree = |same_sets: &[(u32, u32)]| {
            let ways: Vec<u32> = same_sets.iter().map(|&(_, ways)| ways).collect();
            let deepest = ways.last().copied().unwrap_or(0) as usize;
            Tree {
                sets: same_sets[0].0,
                depths: vec![ByOrigin::default(); deepest + 1],
                ways,
            }
        };
        let trees: Vec<Tree> = geometries.chunk_by(|a, b| a.0 == b.0).map(tree).collect();
        let stacks = trees
            .iter()
            .map(|tree| (tree.sets, tree.depths.len() as u32 - 1));
        Self {
            forest: Forest::new(&stacks.collect::<Vec<_>>()),
            depths: vec![0; trees.len()],
            trees,
        }
    }

    /// Accesses a line for the first time or again.
    #[inline(always)]
    pub(crate) fn access(&mut self, line: u32, origin: Option<usize>) {
        self.forest.access(line, &mut self.depths);
        let Some(origin) = origin else { return };
        for (tree, &depth) in self.trees.iter_mut().zip(&self.depths) {
            tree.depths[usize::from(depth)][origin] += 1;
        }
    }

    /// Hits of each cache, by number of sets and ways.
    pub(crate) fn hits(&self) -> Vec<CacheHits> {
        let of_tree = |tree: &Tree| {
            let hits = |&ways: &u32| {
                let mut hits = ByOrigin::default();
                for depth in &tree.depths[..ways as usize] {
                    add(&mut hits, depth);
                }
                CacheHits {
                    lines: u64::from(tree.sets) * u64::from(ways),
                    ways: Some(ways),
                    hits,
                }
            };
            tree.ways.iter().map(hits).collect::<Vec<_>>()
        };
        self.trees.iter().flat_map(of_tree).collect()
    }
}
