//! The result of replaying plain addresses.

use super::Totals;
use crate::config::RunConfig;
use crate::engine::LineOutcome;
use crate::result::MemoryResult;

/// Counters of one level, by kind: reads, writes, fetches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LevelCounts {
    /// Line look-ups.
    pub lookups: [u64; 3],
    /// Lines fetched from below.
    pub misses: [u64; 3],
}

impl LevelCounts {
    /// Line look-ups of all kinds.
    pub fn line_lookups(&self) -> u64 {
        self.lookups.iter().sum()
    }

    /// Line misses of all kinds.
    pub fn line_misses(&self) -> u64 {
        self.misses.iter().sum()
    }

    /// Line misses over line look-ups; 0 without look-ups.
    pub fn line_miss_rate(&self) -> f64 {
        match self.line_lookups() {
            0 => 0.0,
            lookups => self.line_misses() as f64 / lookups as f64,
        }
    }
}

/// The result for one configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The configuration, of which only caches and line size matter here.
    pub config: RunConfig,
    /// First level.
    pub l1: LevelCounts,
    /// Second level, which receives the misses of the first.
    pub l2: LevelCounts,
    /// Counts beside and below the L2.
    pub memory: MemoryResult,
}

impl Point {
    /// Combines totals with the misses of all levels.
    pub(super) fn new(config: &RunConfig, totals: &Totals, outcome: LineOutcome) -> Self {
        let [l1, l2] = [0, 1].map(|level: usize| {
            let mut misses = [0; 3];
            for (sum, cell) in misses.iter_mut().zip(&outcome.misses) {
                *sum = cell[level].lines;
            }
            misses
        });
        Self {
            config: *config,
            memory: outcome.memory,
            l1: LevelCounts {
                lookups: totals.lookups,
                misses: l1,
            },
            l2: LevelCounts {
                lookups: l1,
                misses: l2,
            },
        }
    }

    /// Bytes fetched from memory.
    pub fn external_bytes(&self) -> u64 {
        let l2_misses = self.l2.line_misses();
        self.memory
            .external_bytes(l2_misses, self.config.line_bytes)
    }
}

/// The results for all configurations.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Totals of the input.
    pub totals: Totals,
    /// Distinct lines: the misses of an infinite cache.
    pub unique_lines: u64,
    /// In the order of the configurations.
    pub points: Vec<Point>,
}
