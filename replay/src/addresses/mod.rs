//! Plain addresses, of any program, through a first- and a second-level cache: no tiles, no texture
//! unit, one core.
//!
//! Addresses become cache lines in blocks ([`for_lines`]); repeats of the line before are dropped,
//! since they find it in every cache and change nothing; what is left goes through all
//! configurations, those that are LRU in one pass.

mod hierarchy;
mod lines;
mod names;
mod one_pass;
mod repeats;
mod result;
#[cfg(test)]
mod tests;
mod touched;

pub use lines::{KindSet, LineBlock, Totals, for_line_blocks, for_lines};
pub use result::{LevelCounts, Outcome, Point};

use crate::cache::Levels;
use crate::config::{ConfigError, RunConfig};
use formats::FormatError;
use formats::interop::plain::AddressFile;
use hierarchy::Hierarchy;
use one_pass::OnePass;
use repeats::{Distinct, Repeats};
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

/// Caches that see all lines.
trait Caches {
    /// Accesses lines; gives those that were in none of the caches, or at least those that were never
    /// there before.
    fn access(&mut self, block: &Distinct<'_>) -> &[u32];

    /// Misses of both levels under a configuration, by kind of access.
    fn misses(&self, config: &RunConfig) -> Option<[[u64; 3]; 2]>;
}

/// Replays the accesses of `kinds` under every configuration, of which there is at least one and all
/// have the same line size. Of a configuration, line size, caches and seed count.
///
/// # Errors
/// An impossible configuration; input that cannot be read, is damaged or has nothing to replay.
pub fn replay(
    file: AddressFile<'_>,
    configs: &[RunConfig],
    kinds: KindSet,
) -> Result<Outcome, AddressError> {
    let line_bytes = configs.iter().map(|c| c.line_bytes).max().unwrap_or(16);
    let mut most_sets = 1;
    for config in configs {
        for (cache, level) in [(&config.l1, "L1"), (&config.l2, "L2")] {
            most_sets = most_sets.max(cache.sets(level, line_bytes)?);
        }
    }
    let mut caches = build(configs)?;
    let (mut repeats, mut touched) = (Repeats::default(), Touched::default());
    let totals = for_line_blocks(file, line_bytes, most_sets, kinds, |block| {
        let distinct = repeats.drop_from(&block);
        for (index, each) in caches.iter_mut().enumerate() {
            let missed = each.access(&distinct);
            if index == 0 {
                touched.insert_all(missed);
            }
        }
    })?;
    let points = configs.iter().map(|config| {
        let misses = caches.iter().find_map(|each| each.misses(config));
        Point::new(config, &totals, misses.unwrap_or_default())
    });
    Ok(Outcome {
        points: points.collect(),
        unique_lines: touched.count(),
        totals,
    })
}

/// True if one stack answers for both levels.
fn is_lru(config: &RunConfig) -> bool {
    config.l1.is_plain_lru() && config.l2.is_plain_lru()
}

/// One pass for all configurations that are LRU, if there are several; a hierarchy for each of the
/// others.
fn build(configs: &[RunConfig]) -> Result<Vec<Box<dyn Caches>>, ConfigError> {
    let (mut shared, mut alone): (Vec<RunConfig>, Vec<RunConfig>) =
        configs.iter().partition(|config| is_lru(config));
    if shared.len() == 1 {
        alone.append(&mut shared);
    }
    let mut caches: Vec<Box<dyn Caches>> = Vec::new();
    if !shared.is_empty() {
        caches.push(Box::new(OnePass::new(&shared)?));
    }
    for config in alone {
        let one_core = RunConfig { cores: 1, ..config };
        caches.push(match Levels::build(&one_core)?.all_four_way() {
            Ok(levels) => Box::new(Hierarchy::new(config, levels)),
            Err(levels) => Box::new(Hierarchy::new(config, levels)),
        });
    }
    Ok(caches)
}
