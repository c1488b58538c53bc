//! The interface of all caches, and caches of any policy and organisation.
//!
//! Lines are identified by number (address over line size). An access takes two steps, because a
//! missing line is filled only after the miss penalty: [`Cache::lookup`] when it is requested,
//! [`Cache::fill`] when it arrives.

use super::policy::{FourWayLru, Geometry, lru};
use super::sectored::Sectored;
use super::victim::WithVictimCache;
use super::watched::Watched;
use crate::config::{ConfigError, LevelConfig};

/// A cache of whole lines. Its state after a series of look-ups depends only on the order of the
/// last look-up of each resident line, so earlier look-ups need no simulation.
pub trait Cache: Send {
    /// Returns true for a hit and marks the line as used.
    fn lookup(&mut self, line: u32) -> bool;

    /// Returns true if the line is resident. Changes nothing.
    fn contains(&self, line: u32) -> bool;

    /// Looks up lines until one misses, and returns the index of that line.
    fn lookup_all(&mut self, lines: &[u32]) -> Option<usize> {
        lines.iter().position(|&line| !self.lookup(line))
    }

    /// Inserts a line that is not resident. Returns the evicted line, or [`EMPTY`].
    fn fill(&mut self, line: u32) -> u32;

    /// Removes a line. Returns true if it was resident.
    fn remove(&mut self, line: u32) -> bool;

    /// Appends the lines evicted since the last call, if the cache records them.
    fn take_evicted(&mut self, _lines: &mut Vec<u32>) {}

    /// Removes all lines.
    fn clear(&mut self);

    /// Looks up a line and fills it immediately on a miss. Returns true for a hit.
    fn access(&mut self, line: u32) -> bool {
        let hit = self.lookup(line);
        if !hit {
            self.fill(line);
        }
        hit
    }

    /// Up to this many distinct lines accessed in sequence are all resident afterwards, and
    /// repeating the sequence changes nothing. Such repeats need no simulation.
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

/// A cache of any policy. The most common kind keeps its concrete type, so that replays can be compiled for it.
pub enum AnyCache {
    /// Four-way LRU.
    FourWayLru(FourWayLru),
    /// Any other cache.
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
    /// An impossible geometry, reported with `level`.
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

    /// Wraps the cache so that it records the lines it evicts.
    #[must_use]
    pub(super) fn watched(self) -> Self {
        boxed(Watched::new(self.into_box()))
    }

    /// Boxes the cache, whatever its kind.
    #[must_use]
    pub fn into_box(self) -> Box<dyn Cache> {
        match self {
            Self::FourWayLru(cache) => Box::new(cache),
            Self::Other(cache) => cache,
        }
    }
}
