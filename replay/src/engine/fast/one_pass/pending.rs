//! Footprints that some L1 does not hold: counted, and their misses sent on to the L2 caches, many at
//! once.
//!
//! What an L2 holds depends only on the order of its accesses, so it may lag behind the L1 caches. One
//! number of sets after another, the loops are short and have no branches that depend on what is found.

use super::tally::{Access, Level};
use crate::memory::Forest;

/// So many accesses are drained: few enough for the processor's first cache, and very few in tests, which
/// replay little.
const MOST: usize = if cfg!(test) { 16 } else { 1024 };

/// Lines of a footprint at most.
const LINES: usize = 4;

/// All L2 caches under one L1.
pub(super) struct Under {
    /// The L1: number of sets, ways, and rank of these.
    pub(super) tree: usize,
    pub(super) ways: u8,
    pub(super) rank: usize,
    pub(super) level: Level,
    pub(super) forest: Forest,
}

/// Accesses to L1 caches, in order, of all cores.
pub(super) struct Pending {
    accesses: Vec<Access>,
    /// How deep the lines lay, by number of sets; with room for one more footprint.
    depths: Vec<u8>,
    /// Numbers of sets of the L1 caches.
    trees: usize,
    /// Those that miss one L1, and how deep they lay for one number of sets of an L2.
    missed: Vec<Access>,
    l2_depths: Vec<u8>,
}

impl Pending {
    pub(super) fn new(trees: usize) -> Self {
        Self {
            accesses: Vec::with_capacity(MOST + LINES),
            depths: vec![0; (MOST + LINES) * trees],
            trees,
            missed: Vec::new(),
            l2_depths: Vec::new(),
        }
    }

    /// Where the next access' depths belong.
    #[inline(always)]
    pub(super) fn next_depths(&mut self) -> &mut [u8] {
        let first = self.accesses.len() * self.trees;
        &mut self.depths[first..first + self.trees]
    }

    /// A number for a footprint whose first access comes next.
    #[inline(always)]
    pub(super) fn footprint(&self) -> u32 {
        self.accesses.len() as u32
    }

    /// Adds an access whose depths are in place.
    #[inline(always)]
    pub(super) fn push(&mut self, access: Access) {
        self.accesses.push(access);
    }

    /// True if no other footprint may be added.
    #[inline(always)]
    pub(super) fn is_full(&self) -> bool {
        self.accesses.len() >= MOST
    }

    /// Counts all accesses and does those of the L2 caches.
    pub(super) fn drain(&mut self, l1: &mut Level, under: &mut [Under]) {
        for (tree, tally) in l1.tallies.iter_mut().enumerate() {
            let depths = of_tree(&self.depths, self.trees, tree);
            tally.count(&self.accesses, depths);
        }
        for under in under {
            let depths = of_tree(&self.depths, self.trees, under.tree);
            self.missed.clone_from(&self.accesses);
            retain(&mut self.missed, depths, under.ways);
            let last = under.level.tallies.len() - 1;
            for (tree, tally) in under.level.tallies.iter_mut().enumerate() {
                let lines = self.missed.iter().map(|access| access.line);
                under.forest.access_tree(tree, lines, &mut self.l2_depths);
                let depths = self.l2_depths.iter().copied();
                tally.count(&self.missed, depths.clone());
                if tree < last {
                    // A line on top with fewer sets is so with more.
                    retain(&mut self.missed, depths, 1);
                }
            }
        }
        self.accesses.clear();
    }
}

/// How deep the lines lay for one number of sets.
#[inline(always)]
fn of_tree(depths: &[u8], trees: usize, tree: usize) -> impl Iterator<Item = u8> {
    depths.chunks_exact(trees).map(move |depths| depths[tree])
}

/// Keeps the accesses whose lines lay so deep or deeper, without a branch.
#[inline(always)]
fn retain(accesses: &mut Vec<Access>, depths: impl Iterator<Item = u8>, least: u8) {
    let mut kept = 0;
    for (index, depth) in (0..accesses.len()).zip(depths) {
        // If it is not kept, the next one takes its place.
        accesses[kept] = accesses[index];
        kept += usize::from(depth >= least);
    }
    accesses.truncate(kept);
}
