//! The programmable cores: cycles of a batch's kernels.

use super::config::SgrtConfig;
use super::work::BatchWork;

/// Cycles by kernel, summed over all lanes; [`SrpCycles::total`] divides by the number of lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SrpCycles {
    /// Ray generation.
    pub generation: f64,
    /// Shading, including alpha look-ups.
    pub shading: f64,
    /// Projection of left pixels.
    pub reproject: f64,
    /// Error detection.
    pub detect: f64,
    /// Reuse.
    pub reuse: f64,
    /// Number of lanes.
    lanes: f64,
}

impl SrpCycles {
    /// Lane cycles of all kernels.
    pub(super) fn lane_cycles(&self) -> f64 {
        self.generation + self.shading + self.added_lane_cycles()
    }

    /// Lane cycles of the three kernels that reprojection adds.
    pub(super) fn added_lane_cycles(&self) -> f64 {
        self.reproject + self.detect + self.reuse
    }

    /// Cycles of the cores with all lanes busy.
    pub(super) fn total(&self) -> f64 {
        if self.lanes > 0.0 {
            self.lane_cycles() / self.lanes
        } else {
            0.0
        }
    }

    /// Adds another batch's cycles.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, generation, shading, reproject, detect, reuse);
        self.lanes = other.lanes;
    }
}

/// Kernel cycles of a batch.
pub fn cycles(work: &BatchWork, config: &SgrtConfig) -> SrpCycles {
    let srp = &config.srp;
    let idle = |lanes: u64| if srp.compaction { 0 } else { lanes };
    SrpCycles {
        generation: (work.rays() + work.retest_rays + idle(work.idle_traced_lanes)) as f64
            * srp.ray_generation_cycles,
        shading: work.shaded as f64 * srp.shading_cycles
            + work.alpha_tests() as f64 * srp.alpha_test_cycles,
        reproject: work.reprojected as f64 * srp.reproject_cycles,
        detect: work.detected as f64 * srp.detect_cycles
            + work.row_tests as f64 * srp.row_test_cycles,
        reuse: (work.reused + idle(work.idle_reused_lanes)) as f64 * srp.reuse_cycles,
        lanes: f64::from(srp.cores) * f64::from(srp.lanes_per_core),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernel_time_is_items_times_cycles_over_lanes() {
        let config = SgrtConfig::default();
        let work = BatchWork {
            shaded: 10,
            reprojected: 5,
            detected: 6,
            reused: 4,
            ..BatchWork::default()
        };
        let c = cycles(&work, &config);
        let s = &config.srp;
        let lanes = f64::from(s.cores * s.lanes_per_core);
        let expected = 10.0 * s.shading_cycles
            + 5.0 * s.reproject_cycles
            + 6.0 * s.detect_cycles
            + 4.0 * s.reuse_cycles;
        assert!((c.total() - expected / lanes).abs() < 1e-12);
        assert_eq!(c.added_lane_cycles() + 10.0 * s.shading_cycles, expected);
    }
}
