//! Counts by frame.

use super::run::Run;
use sim::config::RunConfig;
use sim::engine::{Job, ReplayError, replay_jobs};
use sim::result::RunResult;
use sim::stream::LineMemory;

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Counts of a frame, or of all frames so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
pub struct FrameCounts {
    /// DRAM traffic in bytes.
    pub external_bytes: u64,
    /// Bilinear footprints.
    pub footprints: u64,
    /// Footprints with at least one line missing in the L1.
    pub l1_footprint_misses: u64,
    /// Line look-ups of the L2.
    pub l2_line_lookups: u64,
    /// Line misses of the L2.
    pub l2_line_misses: u64,
    /// Cycles; 0 in functional mode.
    pub cycles: u64,
}

impl FrameCounts {
    fn so_far(result: &RunResult) -> Self {
        Self {
            external_bytes: result.external_bytes,
            footprints: result.footprints,
            l1_footprint_misses: result.l1.counters.footprint_misses,
            l2_line_lookups: result.l2.counters.line_lookups,
            l2_line_misses: result.l2.counters.line_misses,
            cycles: result.cycles.unwrap_or(0),
        }
    }

    fn since(&self, before: &Self) -> Self {
        Self {
            external_bytes: self.external_bytes - before.external_bytes,
            footprints: self.footprints - before.footprints,
            l1_footprint_misses: self.l1_footprint_misses - before.l1_footprint_misses,
            l2_line_lookups: self.l2_line_lookups - before.l2_line_lookups,
            l2_line_misses: self.l2_line_misses - before.l2_line_misses,
            cycles: self.cycles - before.cycles,
        }
    }
}

/// Counts of each frame, by its number.
pub type Series = BTreeMap<u32, FrameCounts>;

/// Replays runs of frames with each configuration and counts by frame, in the order of `configs`. Each run starts with empty
/// caches, because what they held is unknown.
///
/// # Errors
/// An impossible configuration, or an unreadable trace.
pub fn by_frame(runs: &[Run<'_>], configs: &[RunConfig]) -> Result<Vec<Series>, ReplayError> {
    let sums = Mutex::new(vec![vec![Series::new(); configs.len()]; runs.len()]);
    let receive = |run: usize| {
        let sums = &sums;
        move |index: usize, frame, result: RunResult| {
            let mut sums = sums.lock().unwrap_or_else(PoisonError::into_inner);
            sums[run][index].insert(frame, FrameCounts::so_far(&result));
        }
    };
    let receivers: Vec<_> = (0..runs.len()).map(receive).collect();
    let mut jobs = Vec::new();
    for (run, receiver) in runs.iter().zip(&receivers) {
        jobs.push(Job {
            trace: run,
            configs,
            finished: &|_, _| (),
            after_frame: Some(receiver),
        });
    }
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    for answer in replay_jobs(&jobs, &memory) {
        answer.map_err(|(_, error)| error)?;
    }
    drop(jobs);
    let mut found = vec![Series::new(); configs.len()];
    for of_run in sums.into_inner().unwrap_or_else(PoisonError::into_inner) {
        for (series, so_far) in found.iter_mut().zip(of_run) {
            let mut before = FrameCounts::default();
            for (frame, counts) in so_far {
                series.insert(frame, counts.since(&before));
                before = counts;
            }
        }
    }
    Ok(found)
}
