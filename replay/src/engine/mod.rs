//! Wires order, stream, caches and texture unit: replays a trace under configurations.

mod batch;
mod counts;
mod first_miss;
mod functional;
mod items;
mod one_pass;
mod prefetch_fifo;
mod scheduler;
mod summary;
#[cfg(test)]
mod tests;
mod timed;
mod wave;

pub use batch::{Job, Work, replay_all, replay_jobs, sharing};

use crate::config::{Assign, ConfigError, RunConfig};
use crate::order::Phase;
use crate::result::{FirstLookups, RunResult};
use crate::stream::{Cores, LineMemory, StreamError, TileSource};
use std::ops::Range;
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

/// Work between two frames that is not the trace's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OtherWork {
    /// Percent of the L2's lines that it takes.
    percent: u8,
    /// Its first line.
    first: u32,
}

impl OtherWork {
    /// Lines from here on are no texture's.
    const FIRST: u32 = 0xe000_0000;

    /// Refuses address spaces that reach its lines.
    pub(crate) fn check(lines: u64) -> Result<(), StreamError> {
        if lines <= u64::from(Self::FIRST) {
            return Ok(());
        }
        Err(StreamError::Tables(format!(
            "expected at most {} lines of textures where part of the L2 is lost between frames, found {lines}",
            Self::FIRST
        )))
    }

    /// The work after a frame, with other lines than after the frames before.
    pub(crate) fn after(frame: usize, percent: u8) -> Self {
        // No cache has more than 2^24 lines.
        let first = Self::FIRST + ((frame as u32 % 16) << 24);
        Self { percent, first }
    }

    /// The lines that it puts into a cache of so many.
    pub(crate) fn lines(self, all: u64) -> Range<u32> {
        let count = all * u64::from(self.percent) / 100;
        self.first..self.first + (count as u32).min(1 << 24)
    }
}

/// What runs the work of the cores: caches, with or without clocks, for one or more
/// configurations.
trait Machine: Send {
    /// Runs a frame's phases, one after another.
    fn run(
        &mut self,
        cores: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
    ) -> Result<(), StreamError>;

    /// Empties the caches, between frames.
    fn flush(&mut self);

    /// Between frames, other work empties the L1 caches and takes part of the L2, which has so many lines.
    fn lose(&mut self, other: OtherWork, l2_lines: u64);

    /// What was counted for one of its configurations.
    fn outcome(&self, config: &RunConfig) -> batch::Outcome;

    /// What it counts besides where threads stop at their first miss.
    fn first_lookups(&self) -> Option<FirstLookups> {
        None
    }
}
