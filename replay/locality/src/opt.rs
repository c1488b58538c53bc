//! Belady's OPT (MIN): the minimum number of misses of a cache that fills on every miss.
//!
//! A line kept between two uses occupies one of the cache's lines for that interval. One line must stay
//! free for the other accesses in between, so a cache of `n` lines can keep intervals in `n - 1` places,
//! each holding one interval at a time. Maximising hits is interval scheduling on machines (Carlisle &
//! Lloyd 1995, Faigle & Nawijn 1995): process intervals in order of their end, and assign each to the place
//! that became free last before its start. This needs no look-ahead, so one pass over the stream suffices,
//! and many sizes share it.

use crate::axis::{Renumbering, TimeSet};
use crate::place::ByOrigin;

/// A fully associative cache under OPT.
#[derive(Clone, Debug)]
pub(crate) struct FullyAssociative {
    /// Capacity.
    pub(crate) lines: u32,
    /// Times at which places became free: the last use before the end of the interval they held.
    free_since: TimeSet,
    /// Places without an interval so far.
    unused: u32,
    /// Hits by location of the previous use.
    pub(crate) hits: ByOrigin,
}

impl FullyAssociative {
    /// An empty cache of at least one line, on an axis of `times`.
    pub(crate) fn new(lines: u32, times: u32) -> Self {
        Self {
            lines,
            free_since: TimeSet::new(times),
            unused: lines - 1,
            hits: ByOrigin::default(),
        }
    }

    /// Processes a use whose previous use at `before` is earlier than the access before `now`. Returns
    /// whether the line was kept.
    #[inline(always)]
    pub(crate) fn reuse(&mut self, before: u32, now: u32) -> bool {
        if let Some(free) = self.free_since.last_until(before) {
            self.free_since.remove(free);
        } else if self.unused > 0 {
            self.unused -= 1;
        } else {
            return false;
        }
        self.free_since.insert(now - 1);
        true
    }

    /// Times at which its places became free.
    pub(crate) fn times(&self) -> &TimeSet {
        &self.free_since
    }

    pub(crate) fn renumber(&mut self, numbers: &Renumbering, times: u32) {
        self.free_since = self.free_since.renumbered(numbers, times);
    }
}

/// A set-associative cache under OPT, with independent sets.
#[derive(Clone, Debug)]
pub(crate) struct OptSets {
    /// By set: the time of its last use, then the times since which its other places are free. Times count
    /// from 1; zero is before all.
    sets: Vec<u32>,
    ways: usize,
    set_mask: u32,
    /// Hits by location of the previous use.
    pub(crate) hits: ByOrigin,
}

impl OptSets {
    /// An empty cache; `sets` is a power of two.
    pub(crate) fn new(sets: u32, ways: u32) -> Self {
        Self {
            sets: vec![0; sets as usize * ways as usize],
            ways: ways as usize,
            set_mask: sets - 1,
            hits: ByOrigin::default(),
        }
    }

    /// Processes a first use or a use after `before`. Returns whether the line was kept.
    #[inline(always)]
    pub(crate) fn access(&mut self, line: u32, before: Option<u32>, now: u32) -> bool {
        let first = (line & self.set_mask) as usize * self.ways;
        let set = &mut self.sets[first..first + self.ways];
        let Some((last, free)) = set.split_first_mut() else {
            return false;
        };
        let hit = before.is_some_and(|before| {
            let before = before + 1;
            if before == *last {
                return true;
            }
            let best = free.iter_mut().filter(|since| **since <= before).max();
            best.map(|since| *since = *last).is_some()
        });
        *last = now + 1;
        hit
    }

    pub(crate) fn renumber(&mut self, numbers: &Renumbering) {
        for time in self.sets.iter_mut().filter(|time| **time > 0) {
            *time = numbers.of(*time - 1) + 1;
        }
    }
}
