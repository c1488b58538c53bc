//! Replays a trace: order, footprints, caches, texture unit, counters.

mod feed;
mod footprint;
mod functional;
mod source;
pub mod synthetic;
mod tally;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod timed;

pub use feed::{Feed, Quad};
pub use source::{MemoryTrace, TileSource};

use crate::cache::{self, Cache, Lru, WaysOf};
use crate::config::{CacheConfig, ConfigError, Mode, Replacement, RunConfig};
use crate::order;
use crate::result::RunResult;
use footprint::Footprints;
use functional::Functional;
use tally::Tally;
use thiserror::Error;
use timed::Timed;

/// Why a replay cannot run.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The configuration is impossible.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The trace file is damaged.
    #[error(transparent)]
    Format(#[from] formats::FormatError),
    /// A tile cannot be replayed.
    #[error("pass {pass} tile {tile}: {message}")]
    Trace {
        /// Pass index.
        pass: u32,
        /// Tile index.
        tile: u32,
        /// What is wrong there.
        message: String,
    },
    /// The trace's tables contradict each other.
    #[error("trace tables: {0}")]
    Tables(String),
}

/// Replays `trace` under `config`.
///
/// # Errors
/// An impossible configuration, or a trace that cannot be read.
pub fn replay<S: TileSource + ?Sized>(
    trace: &S,
    config: &RunConfig,
) -> Result<RunResult, ReplayError> {
    config.validate()?;
    let is_common = |cache: &CacheConfig| cache.ways == 4 && cache.replacement == Replacement::Lru;
    if is_common(&config.l1) && is_common(&config.l2) {
        // The paper's geometry, compiled for it.
        let lru = |cache: &CacheConfig, level| {
            Ok(Lru::new(cache.sets(level, config.line_bytes)?, WaysOf::<4>))
        };
        let l1 = (0..config.cores).map(|_| lru(&config.l1, "L1"));
        return run(
            trace,
            config,
            l1.collect::<Result<_, ConfigError>>()?,
            lru(&config.l2, "L2")?,
        );
    }
    let build = |cache: &CacheConfig, level, seed| {
        cache::build(
            cache,
            level,
            config.line_bytes,
            config.seed.wrapping_add(seed),
        )
    };
    let l1 = (0..config.cores).map(|core| build(&config.l1, "L1", u64::from(core) + 1));
    run(
        trace,
        config,
        l1.collect::<Result<_, _>>()?,
        build(&config.l2, "L2", 0)?,
    )
}

fn run<S: TileSource + ?Sized, A: Cache, B: Cache>(
    trace: &S,
    config: &RunConfig,
    l1: Vec<A>,
    l2: B,
) -> Result<RunResult, ReplayError> {
    let tables = trace.tables();
    let footprints = Footprints::new(tables, config)?;
    let order = config.order.build(config.seed);
    let phases = order::plan(&*order, &tables.passes);
    let tally = Tally::new(tables, footprints.lines(), config.tile_maps);
    match config.mode {
        Mode::Functional => {
            let machine = Functional::new(trace, &footprints, l1, l2, tally);
            let tally = machine.run(&phases, config.assign)?;
            Ok(tally.finish(tables, config.line_bytes))
        }
        Mode::Timed => {
            let outcome = Timed::new(trace, &footprints, config, l1, l2, tally).run(&phases)?;
            let mut result = outcome.tally.finish(tables, config.line_bytes);
            result.tmu = Some(outcome.tmu);
            result.cycles = Some(outcome.cycles);
            Ok(result)
        }
    }
}
