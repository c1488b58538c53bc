//! What every cache can do, and caches of any policy and organisation.
//!
//! Lines are line numbers (address over line size). A cache is asked in two steps, because a missing line arrives only
//! after the miss penalty: [`Cache::lookup`] when it is wanted, [`Cache::fill`] when it is there.

use super::policy::{FourWayLru, Geometry, lru};
use super::sectored::Sectored;
use super::victim::WithVictimCache;
use super::watched::Watched;
use crate::config::{ConfigError, LevelConfig};

/// A cache that holds whole lines. What look-ups leave behind depends only on the order of the last
/// one of each line that is there: earlier ones need no simulation.
pub trait Cache: Send {
    /// True if the line is there; marks it used.
    fn lookup(&mut self, line: u32) -> bool;

    /// True if the line is there. Changes nothing.
    fn contains(&self, line: u32) -> bool;

    /// Looks up lines one after another until one is not there: its index.
    fn lookup_all(&mut self, lines: &[u32]) -> Option<usize> {
        lines.iter().position(|&line| !self.lookup(line))
    }

    /// Puts in a line that is not there: the line that it evicts, or [`EMPTY`].
    fn fill(&mut self, line: u32) -> u32;

    /// Takes a line out. True if it was there.
    fn remove(&mut self, line: u32) -> bool;

    /// Appends the lines that were evicted since the last call, where a cache keeps a list of them.
    fn take_evicted(&mut self, _lines: &mut Vec<u32>) {}

    /// Takes all lines out.
    fn clear(&mut self);

    /// Looks up, and on a miss fills at once. True for a hit.
    fn access(&mut self, line: u32) -> bool {
        let hit = self.lookup(line);
        if !hit {
            self.fill(line);
        }
        hit
    }

    /// Up to this many distinct lines accessed one after another are all still there right after,
    /// and accessing the same sequence again changes nothing: such repeats need no simulation.
    fn repeat_safe_lines(&self) -> u32 {
        1
    }
}

impl Cache for Box<dyn Cache> {
    fn lookup(&mut self, line: u32) -> bool {
        (**self).lookup(line)
    }

    fn contains(&self, line: u32) -> bool {
        (**self).contains(line)
    }

    fn lookup_all(&mut self, lines: &[u32]) -> Option<usize> {
        (**self).lookup_all(lines)
    }

    fn fill(&mut self, line: u32) -> u32 {
        (**self).fill(line)
    }

    fn remove(&mut self, line: u32) -> bool {
        (**self).remove(line)
    }

    fn take_evicted(&mut self, lines: &mut Vec<u32>) {
        (**self).take_evicted(lines);
    }

    fn clear(&mut self) {
        (**self).clear();
    }

    fn access(&mut self, line: u32) -> bool {
        (**self).access(line)
    }

    fn repeat_safe_lines(&self) -> u32 {
        (**self).repeat_safe_lines()
    }
}

/// A cache of any policy. The most common kind keeps its type, so that a replay can be compiled
/// for it.
pub enum AnyCache {
    /// Least recently used, four ways.
    FourWayLru(FourWayLru),
    /// Any other.
    Other(Box<dyn Cache>),
}

pub(super) fn boxed(cache: impl Cache + 'static) -> AnyCache {
    AnyCache::Other(Box::new(cache))
}

impl AnyCache {
    /// An empty LRU cache; `sets` is a power of two.
    #[must_use]
    pub fn lru(sets: u32, ways: u32) -> Self {
        lru(sets, ways)
    }

    /// Builds a cache.
    ///
    /// # Errors
    /// A geometry that cannot be built; `level` names it.
    pub fn build(
        config: &LevelConfig,
        level: &'static str,
        line_bytes: u32,
        seed: u64,
    ) -> Result<Self, ConfigError> {
        let geometry = Geometry {
            sets: config.sets(level, line_bytes)?,
            ways: config.ways,
            seed,
        };
        let mut cache = config.replacement.build(geometry);
        if config.victim_lines > 0 {
            cache = boxed(WithVictimCache::new(cache.into_box(), config.victim_lines));
        }
        if config.sectors > 1 {
            cache = boxed(Sectored::new(cache.into_box(), config.sectors));
        }
        Ok(cache)
    }

    /// The cache with a list of the lines that it evicts.
    #[must_use]
    pub(super) fn watched(self) -> Self {
        boxed(Watched::new(self.into_box()))
    }

    /// The cache behind a pointer, whatever its kind.
    #[must_use]
    pub fn into_box(self) -> Box<dyn Cache> {
        match self {
            Self::FourWayLru(cache) => Box::new(cache),
            Self::Other(cache) => cache,
        }
    }
}
