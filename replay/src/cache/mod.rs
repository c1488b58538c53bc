//! Set-associative caches, one replacement policy a file.
//!
//! Lines are line numbers (address over line size). A cache is asked in two steps, because a
//! missing line arrives only after the miss penalty: [`Cache::lookup`] when it is wanted,
//! [`Cache::fill`] when it is there.

mod below;
mod delayed;
mod fifo;
mod forest;
mod in_flight;
mod inclusion;
mod levels;
mod limited_mshrs;
mod lru;
mod mshr;
mod prefetch;
mod random;
mod reserved;
mod rrip;
mod sectored;
mod set_order;
mod shared;
mod ship;
mod tree_plru;
mod victim;
mod watched;

pub use delayed::{Delay, DelayedFill, NOT_IN_FLIGHT};
pub use forest::Forest;
pub use levels::Levels;
pub use lru::{AnyWays, FourWayLru, Lru, WaysOf};
pub use prefetch::Prefetching;
pub use reserved::AllocateOnMiss;
pub use shared::{Answer, MissPath, MissPathResult, SharedLevel};

use crate::config::{CacheConfig, ConfigError};
use crate::registry::{Named, registry};
use fifo::Fifo;
use random::RandomReplacement;
use rrip::{Insertion, Rrip};
use sectored::Sectored;
use ship::Ship;
use tree_plru::TreePlru;
use victim::WithVictimCache;
use watched::Watched;

registry! { PolicyRow:
    // constant   name          help                    ways that it can have                          built by
    LRU =       row("lru",       "Least recently used", ANY_WAYS,                                      |g| lru::build(g.sets, g.ways));
    FIFO =      row("fifo",      "First in, first out", ANY_WAYS,                                      |g| boxed(Fifo::new(g.sets, g.ways)));
    TREE_PLRU = row("tree-plru", "Tree pseudo-LRU",     ("1, 2, 4 ... 64", tree_plru::accepts_ways),   |g| boxed(TreePlru::new(g.sets, g.ways)));
    RANDOM =    row("random",    "Seeded random",       ANY_WAYS,                                      |g| boxed(RandomReplacement::new(g.sets, g.ways, g.seed)));
    SRRIP =     row("srrip",     "Static re-reference interval prediction",  ANY_WAYS,                 |g| boxed(Rrip::new(g.sets, g.ways, Insertion::Static)));
    BRRIP =     row("brrip",     "Bimodal re-reference interval prediction", ANY_WAYS,                 |g| boxed(Rrip::new(g.sets, g.ways, Insertion::Bimodal)));
    DRRIP =     row("drrip",     "SRRIP or BRRIP, by set dueling",           ANY_WAYS,                 |g| boxed(Rrip::new(g.sets, g.ways, Insertion::Dueling)));
    SHIP =      row("ship",      "Signature-based hit prediction by memory region", ANY_WAYS,          |g| boxed(Ship::new(g.sets, g.ways)));
}

/// A replacement policy by name.
pub type Replacement = Named<PolicyRow>;

impl Default for Replacement {
    fn default() -> Self {
        Self::LRU
    }
}

/// A row of the table of replacement policies.
#[derive(Debug)]
pub struct PolicyRow {
    name: &'static str,
    help: &'static str,
    ways: WaysRule,
    build: fn(Geometry) -> AnyCache,
}

/// Which associativities a policy can have: in words, and as a test.
pub(crate) type WaysRule = (&'static str, fn(u32) -> bool);

/// Ways are counted in a byte.
const ANY_WAYS: WaysRule = ("1 to 255", |ways| (1..=255).contains(&ways));

const fn row(
    name: &'static str,
    help: &'static str,
    ways: WaysRule,
    build: fn(Geometry) -> AnyCache,
) -> PolicyRow {
    PolicyRow {
        name,
        help,
        ways,
        build,
    }
}

impl Replacement {
    /// The associativities that the policy can have.
    pub(crate) fn ways_rule(self) -> WaysRule {
        self.row().ways
    }
}

/// What a policy is built from.
#[derive(Clone, Copy, Debug)]
struct Geometry {
    /// A power of two.
    sets: u32,
    ways: u32,
    seed: u64,
}

/// Tag of a way that holds nothing; no line has this number.
const EMPTY: u32 = u32::MAX;

/// Empties the way of a set that holds a line: its number.
fn empty_way(tags: &mut [u32], line: u32) -> Option<usize> {
    let way = tags.iter().position(|&tag| tag == line)?;
    tags[way] = EMPTY;
    Some(way)
}

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

fn boxed(cache: impl Cache + 'static) -> AnyCache {
    AnyCache::Other(Box::new(cache))
}

impl AnyCache {
    /// Builds a cache.
    ///
    /// # Errors
    /// A geometry that cannot be built; `level` names it.
    pub fn build(
        config: &CacheConfig,
        level: &'static str,
        line_bytes: u32,
        seed: u64,
    ) -> Result<Self, ConfigError> {
        let geometry = Geometry {
            sets: config.sets(level, line_bytes)?,
            ways: config.ways,
            seed,
        };
        let mut cache = (config.replacement.row().build)(geometry);
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
    fn watched(self) -> Self {
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

#[cfg(test)]
mod tests;
