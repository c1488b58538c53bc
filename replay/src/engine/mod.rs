//! Wires order, stream, caches and texture unit: replays a trace under a configuration.

mod counts;
mod functional;
mod summary;
#[cfg(test)]
mod tests;
mod timed;

use crate::cache::{Cache, Levels};
use crate::config::{ConfigError, Mode, RunConfig};
use crate::order;
use crate::result::RunResult;
use crate::stream::{Stream, StreamError, TileSource, interleave};
use counts::CacheCounts;
use functional::Functional;
use summary::summary;
use thiserror::Error;
use timed::Timed;

/// Why a replay cannot run.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The configuration is impossible.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The trace cannot be read.
    #[error(transparent)]
    Trace(#[from] StreamError),
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
    let mut stream = Stream::new(trace, config)?;
    let phases = order::plan(&*config.order.build(config.seed), &tables.passes);
    let counts = CacheCounts::new(&stream.bins, stream.lines());
    let (misses, tmu, cycles) = match config.mode {
        Mode::Functional => {
            let mut caches = Functional::new(levels, counts);
            interleave(&mut stream, &phases, config.assign, &mut caches)?;
            (caches.counts, None, None)
        }
        Mode::Timed => {
            let machine = Timed::new(levels, config.tmu, counts);
            let outcome = machine.run(&mut stream, &phases, config.assign)?;
            (outcome.counts, Some(outcome.tmu), Some(outcome.cycles))
        }
    };
    let (bins, accesses) = (&stream.bins, &stream.counts);
    Ok(RunResult {
        tmu,
        cycles,
        ..summary(tables, bins, accesses, &misses, config.line_bytes)
    })
}
