//! What a replay of plain addresses yields.

use super::Totals;
use crate::config::RunConfig;
use crate::engine::LineOutcome;
use crate::result::MemoryResult;

/// Counters of one level, by kind: reads, writes, fetches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LevelCounts {
    /// Lines asked for.
    pub lookups: [u64; 3],
    /// Lines that had to be fetched from below.
    pub misses: [u64; 3],
}

impl LevelCounts {
    /// Lines asked for, all kinds together.
    #[must_use]
    pub fn line_lookups(&self) -> u64 {
        self.lookups.iter().sum()
    }

    /// Lines that had to be fetched, all kinds together.
    #[must_use]
    pub fn line_misses(&self) -> u64 {
        self.misses.iter().sum()
    }

    /// Missing line look-ups over line look-ups; none over none is none.
    #[must_use]
    pub fn miss_rate(&self) -> f64 {
        match self.line_lookups() {
            0 => 0.0,
            lookups => self.line_misses() as f64 / lookups as f64,
        }
    }
}

/// One configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Its caches and line size are what counts here.
    pub config: RunConfig,
    /// First level.
    pub l1: LevelCounts,
    /// Second level: what misses the first comes here.
    pub l2: LevelCounts,
    /// What was counted beside and below the L2.
    pub memory: MemoryResult,
}

impl Point {
    /// A point with the misses of all levels.
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
    #[must_use]
    pub fn external_bytes(&self) -> u64 {
        let l2_misses = self.l2.line_misses();
        self.memory
            .external_bytes(l2_misses, self.config.line_bytes)
    }
}

/// All configurations of one replay.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What was accessed.
    pub totals: Totals,
    /// Distinct lines: the misses of an infinite cache.
    pub unique_lines: u64,
    /// In the order in which they were asked for.
    pub points: Vec<Point>,
}
