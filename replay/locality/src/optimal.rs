//! Belady's OPT for one cache over a recorded stream.

use crate::opt::{FullyAssociative, OptSets};
use sim::config::{ConfigError, LevelConfig};
use std::collections::HashMap;

/// Misses of a cache with OPT replacement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OptMisses {
    /// Fully associative with the same number of lines: the fewest misses of any cache of this size that fills
    /// on every miss.
    pub fully_associative: u64,
    /// With the cache's sets and ways.
    pub set_associative: u64,
}

/// The misses of a cache of this size for a stream with OPT replacement. Ignores the configured policy.
///
/// # Errors
/// An impossible geometry.
pub fn opt_misses(
    stream: &[u32],
    cache: &LevelConfig,
    line_bytes: u32,
) -> Result<OptMisses, ConfigError> {
    let sets = cache.sets("L2", line_bytes)?;
    let times = u32::try_from(stream.len()).unwrap_or(u32::MAX);
    let mut full = FullyAssociative::new(sets * cache.ways, times.saturating_add(1));
    let mut sets = OptSets::new(sets, cache.ways);
    let mut last: HashMap<u32, u32> = HashMap::new();
    let mut misses = OptMisses {
        fully_associative: 0,
        set_associative: 0,
    };
    for (now, &line) in (0..times).zip(stream) {
        let before = last.insert(line, now);
        let kept = before.is_some_and(|before| before + 1 == now || full.reuse(before, now));
        misses.fully_associative += u64::from(!kept);
        misses.set_associative += u64::from(!sets.access(line, before, now));
    }
    Ok(misses)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Belady's rule directly: evicts the line whose next use is latest.
    fn plain(stream: &[u32], sets: u32, ways: usize) -> u64 {
        let mut misses = 0;
        let mut held: Vec<Vec<u32>> = vec![Vec::new(); sets as usize];
        for (now, &line) in stream.iter().enumerate() {
            let set = &mut held[(line % sets) as usize];
            if set.contains(&line) {
                continue;
            }
            misses += 1;
            if set.len() == ways {
                let next = |line: &u32| {
                    let later = stream[now + 1..].iter().position(|other| other == line);
                    later.unwrap_or(usize::MAX)
                };
                let victim = (0..ways).max_by_key(|&way| next(&set[way])).unwrap();
                set.swap_remove(victim);
            }
            set.push(line);
        }
        misses
    }

    proptest! {
        #[test]
        fn misses_equal_those_of_beladys_rule(
            stream in prop::collection::vec(0_u32..40, 0..200), sets in 0_u32..3, ways in 1_u32..5,
        ) {
            let sets = 1 << sets;
            let cache = LevelConfig { ways, ..LevelConfig::lru(u64::from(sets * ways) * 16) };
            let found = opt_misses(&stream, &cache, 16).unwrap();
            prop_assert_eq!(found.set_associative, plain(&stream, sets, ways as usize));
            prop_assert_eq!(found.fully_associative, plain(&stream, 1, (sets * ways) as usize));
        }
    }
}
