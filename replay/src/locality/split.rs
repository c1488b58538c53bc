//! Why a cache misses: compulsory, capacity and conflict misses (Hill & Smith 1989), access by
//! access as Dinero IV tells them apart.

use super::place::{ByOrigin, add};

/// What became of the accesses to a cache, held against a fully associative LRU cache of its size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MissSplit {
    /// First uses: no cache has the line.
    pub compulsory: u64,
    /// Misses of both caches but the first uses, by where the use before was.
    pub capacity: ByOrigin,
    /// Misses where the fully associative cache hits.
    pub conflict: ByOrigin,
    /// Hits where the fully associative cache misses.
    pub spared: ByOrigin,
    /// Hits of both.
    pub hits_of_both: ByOrigin,
}

impl MissSplit {
    #[inline(always)]
    pub(super) fn count(&mut self, origin: usize, hit: bool, hit_fully_associative: bool) {
        let counts = match (hit, hit_fully_associative) {
            (true, true) => &mut self.hits_of_both,
            (true, false) => &mut self.spared,
            (false, true) => &mut self.conflict,
            (false, false) => &mut self.capacity,
        };
        counts[origin] += 1;
    }

    /// Hits of the cache.
    #[must_use]
    pub fn hits(&self) -> ByOrigin {
        let mut hits = self.hits_of_both;
        add(&mut hits, &self.spared);
        hits
    }

    /// Misses of the cache.
    #[must_use]
    pub fn misses(&self) -> u64 {
        self.compulsory + sum(&self.capacity) + sum(&self.conflict)
    }

    /// Misses of the fully associative cache.
    #[must_use]
    pub fn fully_associative_misses(&self) -> u64 {
        self.compulsory + sum(&self.capacity) + sum(&self.spared)
    }

    /// Adds another cache's.
    pub(super) fn add(&mut self, other: &Self) {
        self.compulsory += other.compulsory;
        add(&mut self.capacity, &other.capacity);
        add(&mut self.conflict, &other.conflict);
        add(&mut self.spared, &other.spared);
        add(&mut self.hits_of_both, &other.hits_of_both);
    }
}

fn sum(counts: &ByOrigin) -> u64 {
    counts.iter().sum()
}
