//! Counts by frame.

use sim::config::RunConfig;
use sim::engine::{Job, ReplayError, replay_jobs};
use sim::result::RunResult;
use sim::stream::{LineMemory, TileSource};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Counts of a frame, or of all frames so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
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

/// Replays a trace with each configuration and counts by frame, in the order of `configs`.
///
/// # Errors
/// An impossible configuration, or an unreadable trace.
pub fn by_frame(trace: &dyn TileSource, configs: &[RunConfig]) -> Result<Vec<Series>, ReplayError> {
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let sums = Mutex::new(vec![Series::new(); configs.len()]);
    let after = |index: usize, frame, result: RunResult| {
        let mut sums = sums.lock().unwrap_or_else(PoisonError::into_inner);
        sums[index].insert(frame, FrameCounts::so_far(&result));
    };
    let job = Job {
        trace,
        configs,
        finished: &|_, _| (),
        after_frame: Some(&after),
    };
    for answer in replay_jobs(&[job], &memory) {
        answer.map_err(|(_, error)| error)?;
    }
    let mut sums = sums.into_inner().unwrap_or_else(PoisonError::into_inner);
    for series in &mut sums {
        let mut before = FrameCounts::default();
        for counts in series.values_mut() {
            let so_far = *counts;
            *counts = so_far.since(&before);
            before = so_far;
        }
    }
    Ok(sums)
}
