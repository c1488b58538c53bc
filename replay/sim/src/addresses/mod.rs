//! Replays plain addresses of any program through the caches of one core and the memory below them, without
//! tiles and texture unit.
//!
//! Addresses are converted to cache lines in blocks ([`for_lines`]). Repeated accesses to the previous line
//! are dropped, because they hit in every cache and change nothing. The rest goes through all
//! configurations; LRU configurations share one pass.

mod lines;
mod names;
mod repeats;
mod result;
#[cfg(test)]
mod tests;
mod touched;

pub use lines::{KindSet, LineBlock, Totals, for_line_blocks, for_lines};
pub use result::{LevelCounts, Outcome, Point};

use crate::config::{ConfigError, RunConfig};
use crate::engine::LineReplay;
use formats::FormatError;
use formats::interop::plain::AddressFile;
use repeats::Repeats;
use thiserror::Error;
use touched::Touched;

/// Reasons why addresses cannot be replayed.
#[derive(Debug, Error)]
pub enum AddressError {
    /// An impossible configuration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Unreadable or malformed input.
    #[error(transparent)]
    Input(#[from] FormatError),
    /// The lines cannot be numbered with 32 bits.
    #[error(
        "{file}: expected accesses to at most {most} ranges of {range_bytes} bytes, found more: larger lines \
         or smaller caches need fewer"
    )]
    TooManyRanges {
        /// The input.
        file: String,
        /// Maximum number of ranges.
        most: u64,
        /// Size of a range in bytes.
        range_bytes: u64,
    },
    /// No access of the selected kinds.
    #[error("{file}: expected at least one access of the kinds that --kinds names, found none")]
    NoneOfKinds {
        /// The input.
        file: String,
    },
}

/// Replays the accesses of `kinds` with every configuration. There is at least one configuration, and all
/// have the same line size. Only line size, levels, prefetcher, DRAM and seed are used.
///
/// # Errors
/// An impossible configuration; input that is unreadable, damaged or has nothing to replay.
pub fn replay(
    file: AddressFile<'_>,
    configs: &[RunConfig],
    kinds: KindSet,
) -> Result<Outcome, AddressError> {
    let line_bytes = configs.iter().map(|c| c.line_bytes).max().unwrap_or(16);
    let mut caches = LineReplay::new(configs)?;
    let (mut repeats, mut touched) = (Repeats::new(caches.skips_repeats()), Touched::default());
    let least_lines = consecutive_lines(configs)?;
    let totals = for_line_blocks(file, line_bytes, least_lines, kinds, |block| {
        let (lines, tags) = repeats.drop_from(&block);
        touched.insert_all(caches.access(lines, tags));
    })?;
    let points = configs.iter().zip(caches.outcomes());
    Ok(Outcome {
        points: (points.map(|(config, outcome)| Point::new(config, &totals, outcome))).collect(),
        unique_lines: touched.count(),
        totals,
    })
}

/// Number of consecutive lines that stay consecutive when lines are renumbered with 32 bits.
fn consecutive_lines(configs: &[RunConfig]) -> Result<u32, ConfigError> {
    /// If the order of misses matters below the L2, prefetchers and DRAM rows see true neighbours within
    /// this many lines, as if an operating system placed pages of this size.
    const PAGE_LINES: u32 = 1 << 20;
    let mut most = 1;
    for config in configs {
        let mut below_l1 = config.line_bytes;
        for (name, level, line_bytes) in config.level.named(config.line_bytes) {
            let longer = line_bytes / std::mem::replace(&mut below_l1, line_bytes);
            let sets = level.sets(name, line_bytes)?.saturating_mul(longer);
            most = most.max(sets.saturating_mul(level.sectors));
        }
        if config.follows_l2_misses() {
            most = most.max(PAGE_LINES);
        }
    }
    Ok(most.min(1 << 24))
}
