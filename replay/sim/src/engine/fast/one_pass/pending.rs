//! Footprints that miss in some L1, collected to be counted and sent to the L2 caches in batches.
//!
//! An L2's contents depend only on the order of its accesses, so it may lag behind the L1 caches.
//! Processing a batch for one number of sets at a time keeps the loops short and free of unpredictable
//! branches.

use super::tally::{FootprintLine, LevelTallies};
use crate::memory::Forest;

/// Accesses per batch: few enough for the processor's L1 cache, and very few in tests, which replay little.
const MOST: usize = if cfg!(test) { 16 } else { 1024 };

/// Maximum lines per footprint.
const LINES: usize = 4;

/// All L2 caches below one L1.
pub(super) struct Under {
    /// The L1's number of sets, its number of ways, and the rank of the latter.
    pub(super) tree: usize,
    pub(super) ways: u8,
    pub(super) rank: usize,
    pub(super) level: LevelTallies,
    pub(super) forest: Forest,
    /// Another treatment's counts when this L2 started to follow that one's.
    pub(super) followed_since: Option<LevelTallies>,
}

impl Under {
    /// Follows the L2 caches of another treatment, which get the same accesses from now on, if the contents are the same.
    pub(super) fn follow(&mut self, first: &Self) {
        if self.followed_since.is_none() && self.forest == first.forest {
            self.followed_since = Some(first.level.clone());
        }
    }
}

/// Accesses to the L1 caches of all cores, in order.
pub(super) struct PendingLines {
    accesses: Vec<FootprintLine>,
    /// Depth of each line, by number of sets, with room for one more footprint.
    depths: Vec<u8>,
    /// Number of L1 set counts.
    trees: usize,
    /// Misses of one L1.
    selected: Vec<FootprintLine>,
    /// Those that are not on top of the sets of some L2, with their depths for one number of L2 sets.
    missed: Vec<FootprintLine>,
    l2_depths: Vec<u8>,
}

impl PendingLines {
    pub(super) fn new(trees: usize) -> Self {
        Self {
            accesses: Vec::with_capacity(MOST + LINES),
            depths: vec![0; (MOST + LINES) * trees],
            trees,
            selected: Vec::new(),
            missed: Vec::new(),
            l2_depths: Vec::new(),
        }
    }

    /// The slot for the depths of the next access.
    #[inline(always)]
    pub(super) fn next_depths(&mut self) -> &mut [u8] {
        let first = self.accesses.len() * self.trees;
        &mut self.depths[first..first + self.trees]
    }

    /// Identifies the footprint whose first access comes next.
    #[inline(always)]
    pub(super) fn footprint(&self) -> u32 {
        self.accesses.len() as u32
    }

    /// Adds an access whose depths have been written.
    #[inline(always)]
    pub(super) fn push(&mut self, access: FootprintLine) {
        self.accesses.push(access);
    }

    /// True if there is no room for another footprint.
    #[inline(always)]
    pub(super) fn is_full(&self) -> bool {
        self.accesses.len() >= MOST
    }

    /// Counts all accesses in the L1 caches.
    pub(super) fn count(&self, l1: &mut LevelTallies) {
        for (tree, tally) in l1.tallies.iter_mut().enumerate() {
            let depths = of_tree(&self.depths, self.trees, tree);
            tally.count(&self.accesses, depths);
        }
    }

    /// Selects the misses of one L1.
    pub(super) fn select(&mut self, tree: usize, ways: u8) {
        let depths = of_tree(&self.depths, self.trees, tree);
        self.selected.clone_from(&self.accesses);
        retain(&mut self.selected, depths, ways);
    }

    /// Simulates the L2 caches under that L1.
    pub(super) fn send(&mut self, under: &mut Under) {
        self.missed.clone_from(&self.selected);
        let last = under.level.tallies.len() - 1;
        for (tree, tally) in under.level.tallies.iter_mut().enumerate() {
            let lines = self.missed.iter().map(|access| access.line);
            match tally.is_modulo {
                true => under.forest.access_tree(tree, lines, &mut self.l2_depths),
                false => {
                    let lines = lines.map(|line| tally.placed(line));
                    under.forest.access_tree(tree, lines, &mut self.l2_depths);
                }
            }
            let depths = self.l2_depths.iter().copied();
            tally.count(&self.missed, depths.clone());
            if tree < last && tally.is_modulo {
                // A line on top with fewer sets is on top with more sets. Not so with hashed sets, which come first.
                retain(&mut self.missed, depths, 1);
            }
        }
    }

    /// Forgets all accesses.
    pub(super) fn clear(&mut self) {
        self.accesses.clear();
    }
}

/// Depths for one number of sets.
#[inline(always)]
fn of_tree(depths: &[u8], trees: usize, tree: usize) -> impl Iterator<Item = u8> {
    depths.chunks_exact(trees).map(move |depths| depths[tree])
}

/// Branch-free: keeps the accesses with a depth of at least `least`.
#[inline(always)]
fn retain(accesses: &mut Vec<FootprintLine>, depths: impl Iterator<Item = u8>, least: u8) {
    let mut kept = 0;
    for (index, depth) in (0..accesses.len()).zip(depths) {
        // A dropped access is overwritten by the next one.
        accesses[kept] = accesses[index];
        kept += usize::from(depth >= least);
    }
    accesses.truncate(kept);
}
