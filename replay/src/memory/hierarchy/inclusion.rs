//! What evictions of one level mean for others: an inclusive level invalidates the lines of those above, an exclusive one takes
//! what the level above evicts.

use super::below::Below;
use crate::config::{Inclusion, RunConfig};

/// Evictions that other levels have to follow.
pub struct Evictions {
    is_l2_inclusive: bool,
    /// Lines that the L2 has evicted since the last call of [`Self::follow`].
    pub evicted: Vec<u32>,
    /// Lines that the L1 caches must give up.
    invalidated: Vec<u32>,
    /// Lines that were invalidated in L1 caches and in the L2.
    pub invalidated_lines: u64,
}

impl Evictions {
    /// None where levels evict independently.
    pub fn build(config: &RunConfig) -> Option<Self> {
        config.level.depend_on_evictions().then(|| Self {
            is_l2_inclusive: config.level.l2.inclusion == Inclusion::Inclusive,
            evicted: Vec::new(),
            invalidated: Vec::new(),
            invalidated_lines: 0,
        })
    }

    /// Follows the evictions of the L2 and of the levels below since the last call. `remove` takes a line out of all caches of
    /// the L2 and returns how many held it.
    pub fn follow(&mut self, below: Option<&mut Below>, mut remove: impl FnMut(u32) -> u64) {
        if self.is_l2_inclusive {
            self.invalidated.extend_from_slice(&self.evicted);
        }
        if let Some(below) = below {
            for &line in &self.evicted {
                below.take_evicted_by_l2(line);
            }
            for line in below.take_invalidated().into_iter().flatten() {
                self.invalidated_lines += remove(line);
                self.invalidated.push(line);
            }
        }
        self.evicted.clear();
    }

    /// True if L1 caches hold lines that they must give up.
    #[inline(always)]
    pub fn are_pending(&self) -> bool {
        !self.invalidated.is_empty()
    }

    /// Calls `remove` on each line that the L1 caches must give up; it returns how many held it.
    pub fn invalidate_l1(&mut self, mut remove: impl FnMut(u32) -> u64) {
        for line in self.invalidated.drain(..) {
            self.invalidated_lines += remove(line);
        }
    }
}
