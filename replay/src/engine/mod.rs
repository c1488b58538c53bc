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

use crate::cache::{Cache, Levels};
use crate::config::{ConfigError, Mode, RunConfig};
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
    // The most common caches have a machine that is compiled for them.
    match Levels::build(config)?.all_four_way() {
        Ok(levels) => run(trace, config, levels),
        Err(levels) => run(trace, config, levels),
    }
}

fn run<S: TileSource + ?Sized, C: Cache>(
    trace: &S,
    config: &RunConfig,
    levels: Levels<C>,
) -> Result<RunResult, ReplayError> {
    let tables = trace.tables();
    let footprints = Footprints::new(tables, config)?;
    let order = config.order.build(config.seed);
    let phases = order::plan(&*order, &tables.passes);
    let tally = Tally::new(tables, footprints.lines(), config.tile_maps);
    match config.mode {
        Mode::Functional => {
            let machine = Functional::new(trace, &footprints, levels.l1, levels.l2, tally);
            let tally = machine.run(&phases, config.assign)?;
            Ok(tally.finish(tables, config.line_bytes))
        }
        Mode::Timed => {
            let outcome =
                Timed::new(trace, &footprints, config, levels.l1, levels.l2, tally).run(&phases)?;
            let mut result = outcome.tally.finish(tables, config.line_bytes);
            result.tmu = Some(outcome.tmu);
            result.cycles = Some(outcome.cycles);
            Ok(result)
        }
    }
}
