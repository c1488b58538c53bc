//! Set-associative caches, one replacement policy a file.
//!
//! Lines are line numbers (address over line size). A cache is asked in two steps, because a
//! missing line arrives only after the miss penalty: [`Cache::lookup`] when it is wanted,
//! [`Cache::fill`] when it is there.

mod fifo;
mod in_flight;
mod lru;
mod random;
mod tree_plru;

pub use fifo::Fifo;
pub use in_flight::InFlight;
pub use lru::{AnyWays, Lru, Ways, WaysOf};
pub use random::RandomReplacement;
pub use tree_plru::TreePlru;

use crate::config::{CacheConfig, ConfigError, Replacement};

/// Tag of a way that holds nothing; no line has this number.
const EMPTY: u32 = u32::MAX;

/// A cache that holds whole lines.
pub trait Cache {
    /// True if the line is there; marks it used.
    fn lookup(&mut self, line: u32) -> bool;

    /// Puts in a line that is not there, in place of the set's victim.
    fn fill(&mut self, line: u32);

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

impl<C: Cache + ?Sized> Cache for Box<C> {
    fn lookup(&mut self, line: u32) -> bool {
        (**self).lookup(line)
    }

    fn fill(&mut self, line: u32) {
        (**self).fill(line);
    }

    fn access(&mut self, line: u32) -> bool {
        (**self).access(line)
    }

    fn repeat_safe_lines(&self) -> u32 {
        (**self).repeat_safe_lines()
    }
}

/// Builds a cache of any policy.
///
/// # Errors
/// A geometry that cannot be built; `level` names it.
pub fn build(
    config: &CacheConfig,
    level: &'static str,
    line_bytes: u32,
    seed: u64,
) -> Result<Box<dyn Cache + Send>, ConfigError> {
    let sets = config.sets(level, line_bytes)?;
    let ways = config.ways;
    Ok(match config.replacement {
        Replacement::Lru => match ways {
            1 => Box::new(Lru::new(sets, WaysOf::<1>)),
            2 => Box::new(Lru::new(sets, WaysOf::<2>)),
            8 => Box::new(Lru::new(sets, WaysOf::<8>)),
            4 => Box::new(Lru::new(sets, WaysOf::<4>)),
            _ => Box::new(Lru::new(sets, AnyWays(ways as usize))),
        },
        Replacement::Fifo => Box::new(Fifo::new(sets, ways)),
        Replacement::TreePlru => {
            if !ways.is_power_of_two() || ways > 64 {
                return Err(ConfigError::TreeWays { level, found: ways });
            }
            Box::new(TreePlru::new(sets, ways))
        }
        Replacement::Random => Box::new(RandomReplacement::new(sets, ways, seed)),
    })
}

#[cfg(test)]
mod tests;
