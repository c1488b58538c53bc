use super::*;
use crate::config::SgrtConfig;
use crate::loaded::LoadedTrace;
use crate::result::Outcome;
use crate::rules::Rule;
use crate::testing::{MIRROR, Synthetic, View, globe, trace, wall};
use crate::tile_orders::TileSequence;
use crate::timing::Timing;

fn room() -> Synthetic {
    let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
    scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
    scene.iter_mut().skip(200).for_each(|s| s.material = MIRROR);
    trace(&scene, View::default())
}

fn outcome(source: &Synthetic, rule: &str, config: &SgrtConfig) -> Outcome {
    let loaded = LoadedTrace::load(source).expect("loads");
    let rule = rule.parse().expect("a rule");
    let runs = loaded.run_with_plain(
        &rule,
        Reuse::Primary,
        config,
        Timing::Cycle,
        &mut TileSequence::default(),
    );
    let [ours, _] = runs.expect("runs");
    ours.outcome
}

#[test]
fn the_simulation_traces_exactly_the_rays_of_the_closed_form() {
    let source = room().with_visits();
    for rule in ["none", "triangles", crate::DEFAULT_RULE] {
        let config = SgrtConfig::default();
        let o = outcome(&source, rule, &config);
        let cycles = o.cycles.as_ref().expect("simulated");
        for (timing, work) in [
            (&cycles.reprojected, &o.work),
            (&cycles.reference, &o.reference_work),
        ] {
            assert_eq!(timing.requests, work.steps + work.triangle_tests, "{rule}");
            assert_eq!(
                (timing.answers, timing.rays_left),
                (timing.requests, timing.rays_entered)
            );
        }
        // A pixel's re-tests are one ray.
        let entered = cycles.reprojected.rays_entered;
        assert!((o.work.rays..=o.work.rays + o.work.retests).contains(&entered));
        assert_eq!(cycles.reference.rays_left, o.reference_work.rays);
        let both = [&cycles.left, &cycles.right].map(|eye| eye.requests);
        assert_eq!(both[0] + both[1], cycles.reference.requests);
        // Images do not depend on time.
        let loaded = LoadedTrace::load(&source).expect("loads");
        let rule = rule.parse().expect("a rule");
        let closed = loaded
            .run(&rule, Reuse::Primary, &config)
            .expect("runs")
            .outcome;
        assert_eq!(
            (o.flip_mean, o.reuse_pct),
            (closed.flip_mean, closed.reuse_pct)
        );
        assert_eq!(
            cycles.closed_form_relative_performance,
            closed.relative_performance
        );
        assert_eq!(cycles.closed_form_relative_energy, closed.relative_energy);
        assert_eq!(cycles.reprojected.closed_form_cycles, closed.tni_cycles);
        assert!(closed.cycles.is_none());
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let source = room().with_visits();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("threads");
        pool.install(|| outcome(&source, "none", &SgrtConfig::default()))
    };
    let one = on(1);
    assert!(
        one.cycles
            .as_ref()
            .is_some_and(|cycles| cycles.reference.cycles > 0)
    );
    for threads in [2, 8] {
        assert_eq!(on(threads), one, "{threads} threads");
    }
}

#[test]
fn slower_memory_and_fewer_rays_in_flight_cost_cycles() {
    let source = room().with_visits();
    let cycles = |text: &str| {
        let config = SgrtConfig::from_overrides(text).expect("valid");
        outcome(&source, "none", &config)
            .cycles
            .expect("simulated")
            .reference
            .cycles
    };
    let base = cycles("");
    assert!(cycles("[memory]\nlatency_ns = 2000") > base);
    assert!(cycles("[memory]\nbandwidth_gb_s = 0.5") > base);
    assert!(cycles("[tni]\nrays_in_flight = 1") > 4 * base);
    assert!(cycles("[cycles]\nl1_mshrs = 1") > base);
    assert!(cycles("[cycles]\nin_order_return = true\n[tni]\nrays_in_flight = 8") > base);
}

/// Rays of a warp share requests, and every ray still enters and leaves once.
#[test]
fn a_warp_requests_the_union_of_its_rays_requests() {
    let source = room().with_visits();
    let timing = |warp_rays: u32| {
        let config = SgrtConfig::from_overrides(&format!("[cycles]\nwarp_rays = {warp_rays}"));
        let config = config.expect("valid");
        outcome(&source, "none", &config)
            .cycles
            .expect("simulated")
            .reference
    };
    let (single, warps) = (timing(1), timing(16));
    assert_eq!(single.rays_left, warps.rays_left);
    assert!(warps.requests < single.requests);
    assert!(16 * warps.requests >= single.requests);
}

#[test]
fn a_prefetcher_needs_the_stacks_of_rays() {
    let source = room().with_visits();
    let loaded = LoadedTrace::load(&source).expect("loads");
    let text = "[cycles.prefetch]\nprefetcher = 'ttp'";
    let config = SgrtConfig::from_overrides(text).expect("valid");
    let (rule, mut tiles) = (Rule::default(), TileSequence::default());
    let runs = loaded.run_with_plain(&rule, Reuse::Primary, &config, Timing::Cycle, &mut tiles);
    let text = runs.map(drop).unwrap_err().to_string();
    assert!(
        text.starts_with("cycles.prefetch (ttp): expected"),
        "{text}"
    );
    assert!(text.contains("tracegen rays --all-columns"), "{text}");
}

#[test]
fn a_trace_without_visits_is_refused_with_the_option_that_adds_them() {
    let source = room();
    let loaded = LoadedTrace::load(&source).expect("loads");
    let (rule, config) = (Rule::default(), SgrtConfig::default());
    let mut tiles = TileSequence::default();
    let runs = loaded.run_with_plain(&rule, Reuse::Primary, &config, Timing::Cycle, &mut tiles);
    let error = runs.map(drop);
    let text = error.unwrap_err().to_string();
    assert!(text.contains("tracegen rays --visits"), "{text}");
}
