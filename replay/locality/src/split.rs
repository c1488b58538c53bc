//! Classifies misses as compulsory, capacity and conflict misses (Hill & Smith 1989), access by access as
//! Dinero IV does.

use crate::place::{ByOrigin, add};

/// Accesses of a cache, compared with a fully associative LRU cache of its size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MissSplit {
    /// First uses, which miss in every cache.
    pub compulsory: u64,
    /// Other misses of both caches, by location of the previous use.
    pub capacity: ByOrigin,
    /// Misses that hit in the fully associative cache.
    pub conflict: ByOrigin,
    /// Hits that miss in the fully associative cache: misses that limited associativity avoids.
    pub avoided: ByOrigin,
    /// Hits in both caches.
    pub hits_of_both: ByOrigin,
}

impl MissSplit {
    #[inline(always)]
    pub(crate) fn count(&mut self, origin: usize, hit: bool, hit_fully_associative: bool) {
        let counts = match (hit, hit_fully_associative) {
            (true, true) => &mut self.hits_of_both,
            (true, false) => &mut self.avoided,
            (false, true) => &mut self.conflict,
            (false, false) => &mut self.capacity,
        };
        counts[origin] += 1;
    }

    /// Hits of the cache.
    pub fn hits(&self) -> ByOrigin {
        let mut hits = self.hits_of_both;
        add(&mut hits, &self.avoided);
        hits
    }

    /// Misses of the cache.
    pub fn misses(&self) -> u64 {
        self.compulsory + sum(&self.capacity) + sum(&self.conflict)
    }

    /// Misses of the fully associative cache.
    pub fn fully_associative_misses(&self) -> u64 {
        self.compulsory + sum(&self.capacity) + sum(&self.avoided)
    }

    /// Adds the counts of another cache.
    pub(crate) fn add(&mut self, other: &Self) {
        self.compulsory += other.compulsory;
        add(&mut self.capacity, &other.capacity);
        add(&mut self.conflict, &other.conflict);
        add(&mut self.avoided, &other.avoided);
        add(&mut self.hits_of_both, &other.hits_of_both);
    }
}

fn sum(counts: &ByOrigin) -> u64 {
    counts.iter().sum()
}
