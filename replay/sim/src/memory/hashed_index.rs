//! A set index that depends on all bits of a line: its low bits XOR each further group of as many bits. Strides of a
//! power of two then spread over the sets.

use super::cache::{Cache, EMPTY};

/// A cache that sees each line under its hashed number. Hashing changes only the bits of the set, so a line is found
/// from its hashed number by hashing again.
pub(super) struct HashedIndex {
    cache: Box<dyn Cache>,
    set_bits: u32,
}

impl HashedIndex {
    /// `sets` is a power of two.
    pub(super) fn new(cache: Box<dyn Cache>, sets: u32) -> Self {
        Self {
            cache,
            set_bits: sets.ilog2(),
        }
    }

    fn hashed(&self, line: u32) -> u32 {
        hashed(line, self.set_bits)
    }
}

/// The hashed number of a line in a cache of 2^`set_bits` sets.
pub(crate) fn hashed(line: u32, set_bits: u32) -> u32 {
    if set_bits == 0 || line == EMPTY {
        return line;
    }
    let (mut hashed, mut rest) = (line, line >> set_bits);
    let mask = (1 << set_bits) - 1;
    while rest != 0 {
        hashed ^= rest & mask;
        rest >>= set_bits;
    }
    hashed
}

impl Cache for HashedIndex {
    fn lookup(&mut self, line: u32) -> bool {
        self.cache.lookup(self.hashed(line))
    }

    fn contains(&self, line: u32) -> bool {
        self.cache.contains(self.hashed(line))
    }

    fn fill(&mut self, line: u32) -> u32 {
        let evicted = self.cache.fill(self.hashed(line));
        self.hashed(evicted)
    }

    fn remove(&mut self, line: u32) -> bool {
        self.cache.remove(self.hashed(line))
    }

    fn clear(&mut self) {
        self.cache.clear();
    }

    fn repeat_safe_lines(&self) -> u32 {
        self.cache.repeat_safe_lines()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::AnyCache;
    use proptest::prelude::*;

    fn cache(sets: u32, ways: u32) -> HashedIndex {
        HashedIndex::new(AnyCache::lru(sets, ways).into_box(), sets)
    }

    #[test]
    fn lines_a_power_of_two_apart_use_all_sets() {
        let (mut hashed, mut plain) = (cache(16, 1), AnyCache::lru(16, 1).into_box());
        let lines = || (0..16_u32).map(|line| line * 16);
        let misses = |cache: &mut dyn Cache| {
            lines().for_each(|line| _ = cache.access(line));
            lines().filter(|&line| !cache.access(line)).count()
        };
        assert_eq!((misses(&mut hashed), misses(&mut *plain)), (0, 16));
    }

    proptest! {
        #[test]
        fn hashing_twice_gives_the_line_and_evictions_are_lines(
            log_sets in 0_u32..8, lines in prop::collection::vec(0_u32..0xf000_0000, 1..200),
        ) {
            let mut cache = cache(1 << log_sets, 2);
            let mut held = std::collections::HashSet::new();
            for line in lines {
                prop_assert_eq!(cache.hashed(cache.hashed(line)), line);
                if !cache.lookup(line) {
                    let evicted = cache.fill(line);
                    prop_assert!(held.insert(line));
                    prop_assert_eq!(evicted != EMPTY, held.remove(&evicted));
                }
            }
            prop_assert!(held.iter().all(|&line| cache.contains(line)));
        }
    }
}
