//! Energy of a frame by component. Only ratios between two runs of this model are meaningful.

use super::config::SgrtConfig;
use super::run::{EnergyPj, Run};
use formats::raytrace::BvhSummary;

/// Energy of a run.
pub fn energy(run: &Run, bvh: &BvhSummary, config: &SgrtConfig) -> EnergyPj {
    let e = &config.energy;
    let work = &run.work;
    let (steps, tests) = (work.steps() as f64, work.triangle_tests() as f64);
    let rays = (work.rays() + work.retest_rays) as f64;
    let (_, step_pj) = config.step(bvh.traversal);
    let read_bytes =
        steps * f64::from(bvh.bytes_per_node) + tests * f64::from(bvh.bytes_per_triangle);
    EnergyPj {
        tni_pj: steps * step_pj + tests * e.triangle_test_pj + rays * e.ray_pj,
        srp_pj: run.srp.lane_cycles() * e.srp_lane_cycle_pj,
        caches_pj: read_bytes * e.l1_pj_per_byte
            + run.misses.l1_lines * config.cache.line_bytes as f64 * e.l2_pj_per_byte,
        sram_pj: run.on_chip_bytes as f64 * e.sram_pj_per_byte,
        dram_pj: run.dram.total() as f64 * e.dram_pj_per_byte,
        // 1 mW is 1 pJ/ns.
        static_pj: run.time_ns * e.static_mw,
    }
}

#[cfg(test)]
mod tests {
    use super::super::dram::DramBytes;
    use super::super::testing::bvh;
    use super::*;
    use formats::raytrace::TraversalKind;

    #[test]
    fn each_component_is_its_count_times_its_cost() {
        let config = SgrtConfig::default();
        let mut run = Run {
            on_chip_bytes: 100,
            dram: DramBytes {
                hierarchy_bytes: 1,
                gbuffer_bytes: 7,
                shading_bytes: 20,
                frame_buffer_bytes: 300,
            },
            time_ns: 11.0,
            ..Run::default()
        };
        run.work.by_class[0].steps = 10;
        run.work.by_class[1].triangle_tests = 4;
        run.work.by_class[2].rays = 2;
        let got = energy(&run, &bvh(), &config);
        let e = &config.energy;
        let tests_and_rays = 4.0 * e.triangle_test_pj + 2.0 * e.ray_pj;
        assert_eq!(got.tni_pj, 10.0 * e.step_pj + tests_and_rays);
        assert_eq!(got.sram_pj, 100.0 * e.sram_pj_per_byte);
        assert_eq!(got.dram_pj, 328.0 * e.dram_pj_per_byte);
        assert_eq!(got.static_pj, 11.0 * e.static_mw);
        assert_eq!(got.srp_pj, 0.0);

        let wide = BvhSummary {
            traversal: TraversalKind::Bvh8,
            ..bvh()
        };
        let got = energy(&run, &wide, &config);
        assert_eq!(got.tni_pj, 10.0 * e.wide_step_pj + tests_and_rays);
    }
}
