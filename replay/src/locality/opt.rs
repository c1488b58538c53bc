//! Belady's OPT (MIN): the fewest misses that a cache of a size can have, filled by every miss.
//!
//! A line that is kept from one use to the next takes a place meanwhile; every other use in between
//! takes one, too, but only for itself. So a cache of `n` lines can keep those lines, and no more,
//! that `n - 1` places can hold, where a place holds one line at a time. Which gives most hits is
//! the scheduling of intervals on machines (Carlisle & Lloyd 1995, Faigle & Nawijn 1995): take
//! intervals as they end, each into the place that became free last before it began. That needs no
//! look ahead, so a pass over the stream is enough, and many sizes share it.

use super::axis::{Renumbering, TimeSet};
use super::place::ByOrigin;

/// A fully associative cache under OPT.
#[derive(Clone, Debug)]
pub(super) struct FullyAssociative {
    /// Capacity.
    pub(super) lines: u32,
    /// When places became free: the time of the last use before the end of what they held.
    free_since: TimeSet,
    /// Places that held nothing yet.
    unused: u32,
    /// Hits by where the use before was.
    pub(super) hits: ByOrigin,
}

impl FullyAssociative {
    /// An empty cache of at least one line, on an axis of `times`.
    pub(super) fn new(lines: u32, times: u32) -> Self {
        Self {
            lines,
            free_since: TimeSet::new(times),
            unused: lines - 1,
            hits: ByOrigin::default(),
        }
    }

    /// A line that was used last at `before`, earlier than the time before `now`, is used: whether
    /// it was kept.
    #[inline(always)]
    pub(super) fn reuse(&mut self, before: u32, now: u32) -> bool {
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

    /// Times when its places became free.
    pub(super) fn times(&self) -> &TimeSet {
        &self.free_since
    }

    pub(super) fn renumber(&mut self, numbers: &Renumbering, times: u32) {
        self.free_since = self.free_since.renumbered(numbers, times);
    }
}

/// A set-associative cache under OPT: each set is a cache of its own.
#[derive(Clone, Debug)]
pub(super) struct SetAssociative {
    /// By set: the time of its last use, then since when its other places are free; times are
    /// counted from 1, and zero is before all.
    sets: Vec<u32>,
    ways: usize,
    set_mask: u32,
    /// Hits by where the use before was.
    pub(super) hits: ByOrigin,
}

impl SetAssociative {
    /// An empty cache; `sets` is a power of two.
    pub(super) fn new(sets: u32, ways: u32) -> Self {
        Self {
            sets: vec![0; sets as usize * ways as usize],
            ways: ways as usize,
            set_mask: sets - 1,
            hits: ByOrigin::default(),
        }
    }

    /// A line is used, for the first time or after the use at `before`: whether it was kept.
    #[inline(always)]
    pub(super) fn access(&mut self, line: u32, before: Option<u32>, now: u32) -> bool {
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

    pub(super) fn renumber(&mut self, numbers: &Renumbering) {
        for time in self.sets.iter_mut().filter(|time| **time > 0) {
            *time = numbers.of(*time - 1) + 1;
        }
    }
}
