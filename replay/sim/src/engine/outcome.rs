//! The counts of a machine.

use super::counts::CacheCounts;
use crate::result::{FirstLookups, MemoryResult, Timeline, TmuResult};
use crate::tmu::PipelineStats;

/// The counts of a machine for one configuration.
#[derive(Default)]
pub struct MachineOutcome {
    /// Cache misses.
    pub counts: CacheCounts,
    /// Sum over texture units; none in functional mode.
    pub tmu: Option<TmuResult>,
    /// Cycles until the last core finished; none in functional mode.
    pub cycles: Option<u64>,
    /// First look-ups, for the model in which threads stop at their first miss.
    pub first_lookups: Option<FirstLookups>,
    /// Counts beside and below the L2.
    pub memory: MemoryResult,
    /// The replay over time, if recorded.
    pub timeline: Option<Timeline>,
}

impl MachineOutcome {
    /// Combines the counts of texture units and caches.
    pub(super) fn timed(
        counts: CacheCounts,
        units: impl Iterator<Item = PipelineStats>,
        cycles: u64,
    ) -> Self {
        let mut sum = PipelineStats::default();
        units.for_each(|unit| sum.add(&unit));
        Self {
            counts,
            tmu: Some(TmuResult {
                utilization: sum.utilization(),
                wasted_issues: sum.wasted,
                threads: sum.threads,
                loops: sum.loops,
            }),
            cycles: Some(cycles),
            ..Self::default()
        }
    }
}

impl From<CacheCounts> for MachineOutcome {
    fn from(counts: CacheCounts) -> Self {
        Self {
            counts,
            ..Self::default()
        }
    }
}
