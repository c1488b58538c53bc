//! Plain addresses, of any program, through the caches of one core and the memory below them: no tiles, no texture unit.
//!
//! Addresses become cache lines in blocks ([`for_lines`]); repeats of the line before are dropped, since they find it in
//! every cache and change nothing; what is left goes through all configurations, those that are LRU in one pass.

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

/// Why addresses cannot be replayed.
#[derive(Debug, Error)]
pub enum AddressError {
    /// A configuration is impossible.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The input cannot be read or is not of its form.
    #[error(transparent)]
    Input(#[from] FormatError),
    /// The lines do not fit numbers of 32 bits.
    #[error(
        "{file}: expected accesses to at most {most} ranges of {range_bytes} bytes, found more: larger lines \
         or smaller caches need fewer"
    )]
    TooManyRanges {
        /// The input.
        file: String,
        /// Ranges that can be told apart.
        most: u64,
        /// Size of a range.
        range_bytes: u64,
    },
    /// Nothing is left to replay.
    #[error("{file}: expected at least one access of the kinds that --kinds names, found none")]
    NoneOfKinds {
        /// The input.
        file: String,
    },
}

/// Replays the accesses of `kinds` under every configuration, of which there is at least one and all
/// have the same line size. Of a configuration, line size, levels, prefetcher, DRAM and seed count.
///
/// # Errors
/// An impossible configuration; input that cannot be read, is damaged or has nothing to replay.
pub fn replay(
    file: AddressFile<'_>,
    configs: &[RunConfig],
    kinds: KindSet,
) -> Result<Outcome, AddressError> {
    let line_bytes = configs.iter().map(|c| c.line_bytes).max().unwrap_or(16);
    let mut caches = LineReplay::new(configs)?;
    let (mut repeats, mut touched) = (Repeats::new(caches.skips_repeats()), Touched::default());
    let least_lines = names_keep(configs)?;
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

/// Neighbouring lines that must stay neighbours when lines get numbers of 32 bits.
fn names_keep(configs: &[RunConfig]) -> Result<u32, ConfigError> {
    /// Where the order of misses matters to what is below the L2, prefetchers and DRAM rows see neighbours as they are
    /// within so many lines, as an operating system with pages of that size would place them.
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
