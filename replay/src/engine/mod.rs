//! Wires order, stream, caches and texture unit: replays a trace under configurations.

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

/// What runs the work of the cores: caches, with or without clocks, for one or more
/// configurations.
trait Machine: Send {
    /// Runs a frame's phases, one after another. The other clients of memory, if they are simulated, follow the cores' items.
    fn run(
        &mut self,
        cores: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
        clients: Option<&mut FrameClients<'_>>,
    ) -> Result<(), StreamError>;

    /// The other clients access memory before the first item of a frame, or after the last one.
    fn client_accesses(&mut self, _clients: &mut FrameClients<'_>) {}

    /// Empties the caches, between frames.
    fn flush(&mut self);

    /// What was counted for one of its configurations.
    fn outcome(&self, config: &RunConfig) -> batch::Outcome;
}

/// A machine without clocks, which can be fed with lines from anywhere.
trait AtOnce: Machine {
    /// The first core accesses lines, each a footprint of its own. `missed` gets those that some L1 does not hold.
    fn lines(&mut self, lines: &[u32], tags: &[Tag], missed: &mut Vec<u32>);

    /// Counts what is still pending.
    fn finish(&mut self) {}
}
