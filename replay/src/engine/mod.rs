//! Replays a trace: connects order, stream, caches and texture units.

mod batch;
mod counts;
mod fast;
mod functional;
mod lines;
mod scheduler;
mod summary;
#[cfg(test)]
mod tests;
mod threads;
mod wave;

pub use batch::{Job, Work, replay_all, replay_jobs, sharing};
pub use counts::Misses;
pub use lines::{LineOutcome, LineReplay};

use crate::access::FrameClients;
use crate::config::{Assign, ConfigError, RunConfig};
use crate::order::Phase;
use crate::result::RunResult;
use crate::stream::{Cores, LineMemory, StreamError, Tag, TileSource};
use std::sync::Mutex;
use thiserror::Error;

/// Reasons why a replay fails.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// An impossible configuration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// An unreadable trace.
    #[error(transparent)]
    Trace(#[from] StreamError),
}

/// Replays `trace` with `config`.
///
/// # Errors
/// An impossible configuration, or an unreadable trace.
pub fn replay(trace: &dyn TileSource, config: &RunConfig) -> Result<RunResult, ReplayError> {
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let answer = Mutex::new(RunResult::default());
    let keep = |_, result| {
        if let Ok(mut answer) = answer.lock() {
            *answer = result;
        }
    };
    replay_all(trace, &[*config], &memory, &keep).map_err(|(_, error)| error)?;
    Ok(answer.into_inner().unwrap_or_default())
}

/// A machine that processes the cores' work: caches, with or without clocks, for one or more configurations.
trait Machine: Send {
    /// Runs the phases of a frame. Other clients of memory, if simulated, follow the cores' items.
    fn run(
        &mut self,
        cores: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
        clients: Option<&mut FrameClients<'_>>,
    ) -> Result<(), StreamError>;

    /// Performs the accesses of other clients before the first item of a frame or after the last one.
    fn client_accesses(&mut self, _clients: &mut FrameClients<'_>) {}

    /// Empties the caches between frames.
    fn flush(&mut self);

    /// The counts for one of its configurations.
    fn outcome(&self, config: &RunConfig) -> batch::Outcome;
}

/// A machine without clocks, which accepts lines from any source.
trait AtOnce: Machine {
    /// Accesses lines on the first core, each as a footprint of its own. `missed` receives the lines that
    /// missed in some L1.
    fn lines(&mut self, lines: &[u32], tags: &[Tag], missed: &mut Vec<u32>);

    /// Counts all pending accesses.
    fn finish(&mut self) {}
}
