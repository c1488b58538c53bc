//! Energy of a frame by component. Only ratios between two runs of this model mean anything.

use super::cache::Misses;
use super::config::SgrtConfig;
use super::gbuffer::Traffic;
use super::srp::SrpCycles;
use super::work::BatchWork;
use formats::raytrace::BvhSummary;
use serde::{Deserialize, Serialize};

/// Energy by component in picojoules.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergyPj {
    /// Steps, tests and hand-over of the fixed-function units.
    pub tni_pj: f64,
    /// Kernels.
    pub srp_pj: f64,
    /// Node and triangle caches.
    pub caches_pj: f64,
    /// Tile buffers.
    pub sram_pj: f64,
    /// External memory.
    pub dram_pj: f64,
    /// Leakage and clocks over the frame's time.
    pub static_pj: f64,
}

impl EnergyPj {
    /// All components.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.tni_pj + self.srp_pj + self.caches_pj + self.sram_pj + self.dram_pj + self.static_pj
    }
}

/// What a frame did.
#[derive(Clone, Copy, Debug)]
pub struct Activity<'a> {
    /// Work of all batches.
    pub work: &'a BatchWork,
    /// Misses of all batches.
    pub misses: &'a Misses,
    /// Kernel cycles.
    pub srp: &'a SrpCycles,
    /// G-buffer traffic.
    pub gbuffer: Traffic,
    /// Pixels written to the frame buffer, both eyes.
    pub frame_buffer_px: u64,
    /// Time of the frame.
    pub time_ns: f64,
}

/// Energy of a frame.
#[must_use]
pub fn energy(activity: &Activity, bvh: &BvhSummary, config: &SgrtConfig) -> EnergyPj {
    let e = &config.energy;
    let work = activity.work;
    let (steps, tests) = (work.steps() as f64, work.triangle_tests() as f64);
    let rays = (work.rays() + work.retest_rays) as f64;
    let read_bytes =
        steps * f64::from(bvh.bytes_per_node) + tests * f64::from(bvh.bytes_per_triangle);
    let dram_bytes = activity.misses.dram_bytes
        + activity.gbuffer.dram_bytes as f64
        + work.shaded as f64 * e.shading_dram_bytes
        + activity.frame_buffer_px as f64 * e.frame_buffer_bytes;
    EnergyPj {
        tni_pj: steps * e.step_pj + tests * e.triangle_test_pj + rays * e.ray_pj,
        srp_pj: activity.srp.lane_cycles() * e.srp_lane_cycle_pj,
        caches_pj: read_bytes * e.l1_pj_per_byte
            + activity.misses.l1 * config.cache.line_bytes as f64 * e.l2_pj_per_byte,
        sram_pj: activity.gbuffer.on_chip_bytes as f64 * e.sram_pj_per_byte,
        dram_pj: dram_bytes * e.dram_pj_per_byte,
        // A milliwatt is a picojoule a nanosecond.
        static_pj: activity.time_ns * e.static_mw,
    }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::bvh;
    use super::*;

    #[test]
    fn each_component_is_its_count_times_its_cost() {
        let config = SgrtConfig::default();
        let mut work = BatchWork {
            shaded: 3,
            ..BatchWork::default()
        };
        work.by_class[0].steps = 10;
        work.by_class[1].triangle_tests = 4;
        work.by_class[2].rays = 2;
        let activity = Activity {
            work: &work,
            misses: &Misses::default(),
            srp: &SrpCycles::default(),
            gbuffer: Traffic {
                on_chip_bytes: 100,
                dram_bytes: 7,
            },
            frame_buffer_px: 5,
            time_ns: 11.0,
        };
        let got = energy(&activity, &bvh(), &config);
        let e = &config.energy;
        assert_eq!(
            got.tni_pj,
            10.0 * e.step_pj + 4.0 * e.triangle_test_pj + 2.0 * e.ray_pj
        );
        assert_eq!(got.sram_pj, 100.0 * e.sram_pj_per_byte);
        let bytes = 7.0 + 3.0 * e.shading_dram_bytes + 5.0 * e.frame_buffer_bytes;
        assert_eq!(got.dram_pj, bytes * e.dram_pj_per_byte);
        assert_eq!(got.static_pj, 11.0 * e.static_mw);
        assert_eq!(got.srp_pj, 0.0);
    }
}
