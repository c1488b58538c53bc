//! Inclusion between levels: an inclusive level invalidates lines of the levels above, an exclusive
//! level receives the evictions of the level above.

use super::below::Below;
use crate::config::{Inclusion, RunConfig};

/// Evictions that affect other levels.
pub(super) struct Evictions {
    is_l2_inclusive: bool,
    /// L2 evictions since the last call of [`Self::follow`].
    pub evicted: Vec<u32>,
    /// Lines to be invalidated in the L1 caches.
    invalidated: Vec<u32>,
    /// Lines invalidated in the L1 caches and the L2 so far.
    pub invalidated_lines: u64,
}

impl Evictions {
    /// None if levels evict independently.
    pub fn build(config: &RunConfig) -> Option<Self> {
        config.level.depend_on_evictions().then(|| Self {
            is_l2_inclusive: config.level.l2.inclusion == Inclusion::Inclusive,
            evicted: Vec::new(),
            invalidated: Vec::new(),
            invalidated_lines: 0,
        })
    }

    /// Processes the evictions of the L2 and of lower levels since the last call. `remove` removes
    /// a line from all L2 caches and returns how many held it.
    pub fn follow(&mut self, below: &mut Below, mut remove: impl FnMut(u32) -> u64) {
        if self.is_l2_inclusive {
            self.invalidated.extend_from_slice(&self.evicted);
        }
        for &line in &self.evicted {
            below.take_evicted_by_l2(line);
        }
        for line in below.take_invalidated().into_iter().flatten() {
            self.invalidated_lines += remove(line);
            self.invalidated.push(line);
        }
        self.evicted.clear();
    }

    /// True if lines still have to be invalidated in the L1 caches.
    #[inline(always)]
    pub fn are_pending(&self) -> bool {
        !self.invalidated.is_empty()
    }

    /// Calls `remove` for each line to be invalidated in the L1 caches; it returns how many held the line.
    pub fn invalidate_l1(&mut self, mut remove: impl FnMut(u32) -> u64) {
        for line in self.invalidated.drain(..) {
            self.invalidated_lines += remove(line);
        }
    }
}
