use super::*;
use crate::sgrt::reject::{Decision, Rule, decide};
use crate::sgrt::reproject::reproject;
use crate::sgrt::synthetic::{Placed, View, frame, wall};

fn decisions(frame: &Frame, rule: &str) -> Vec<Decision> {
    let rule: Rule = rule.parse().expect("a rule");
    decide(frame, &reproject(frame), &rule)
}

fn evaluated(frame: &Frame, rule: &str, reuse: Reuse, config: &SgrtConfig) -> Evaluation {
    let work = tile_work(frame, &decisions(frame, rule), reuse);
    let misses = misses_by_rates(&work, frame, config);
    evaluate(frame, &work, &misses, config)
}

/// A wall seen by eyes in one place: all of the right image is reused.
fn all_reused() -> Frame {
    let view = View {
        ipd_m: 0.0,
        ..View::default()
    };
    frame(&wall(2.0, [50.0, 50.0], 0.0, 1), view)
}

fn room() -> Vec<Placed> {
    let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
    scene.extend(wall(1.0, [0.2, 0.3], -0.3, 2));
    scene
}

#[test]
fn with_all_reused_the_units_trace_the_left_eye_only() {
    let frame = all_reused();
    let config = SgrtConfig::default();
    let e = evaluated(&frame, "none", Reuse::Shadow, &config);
    assert!((e.reprojected.tni_cycles / e.reference.tni_cycles - 0.5).abs() < 1e-9);
    assert_eq!(e.right_tni_cycles, 0.0);
    // With primary reuse the shadow rays remain: 12 of 32 steps.
    let e = evaluated(&frame, "none", Reuse::Primary, &config);
    let steps = |run: &Run| run.work.steps() as f64;
    assert!((steps(&e.reprojected) / steps(&e.reference) - (32.0 + 12.0) / 64.0).abs() < 1e-9);
}

#[test]
fn without_added_kernels_half_the_rays_are_twice_the_performance() {
    let frame = all_reused();
    let mut config = SgrtConfig::default();
    config.srp.reproject_cycles = 0.0;
    config.srp.detect_cycles = 0.0;
    config.srp.reuse_cycles = 0.0;
    config.srp.cores = 4096;
    let e = evaluated(&frame, "none", Reuse::Color, &config);
    assert!((e.relative_performance() - 2.0).abs() < 1e-9);
}

#[test]
fn a_core_bound_frame_gains_nothing_from_fewer_rays_in_the_units() {
    let frame = all_reused();
    let mut config = SgrtConfig::default();
    config.srp.cores = 1;
    config.srp.lanes_per_core = 1;
    config.srp.ray_generation_cycles = 0.0;
    let e = evaluated(&frame, "none", Reuse::Shadow, &config);
    // Shading runs as often; the three kernels are added.
    assert!(e.relative_performance() < 1.0);
    let added = e.reprojected.srp.added_lane_cycles() / e.reference.srp.lane_cycles();
    assert!((1.0 / e.relative_performance() - (1.0 + added)).abs() < 1e-9);
}

#[test]
fn nothing_reused_costs_the_reference_and_the_added_kernels() {
    let frame = frame(&room(), View::default());
    let config = SgrtConfig::default();
    let mut decisions = decisions(&frame, "none");
    for d in &mut decisions {
        d.class = crate::sgrt::reject::PixelClass::Bad;
        d.tests = 0;
    }
    let work = tile_work(&frame, &decisions, Reuse::Color);
    let e = evaluate(
        &frame,
        &work,
        &misses_by_rates(&work, &frame, &config),
        &config,
    );
    assert_eq!(e.reprojected.work.steps(), e.reference.work.steps());
    assert_eq!(e.reprojected.tni_cycles, e.reference.tni_cycles);
    assert!(e.relative_performance() <= 1.0);
}

#[test]
fn each_level_of_reuse_leaves_less_to_do() {
    let frame = frame(&room(), View::default());
    let config = SgrtConfig::default();
    let runs = Reuse::ALL.map(|reuse| evaluated(&frame, "none", reuse, &config).reprojected);
    assert!(runs[0].work.steps() > runs[1].work.steps());
    assert_eq!(runs[1].work.steps(), runs[2].work.steps());
    assert!(runs[1].work.shaded > runs[2].work.shaded);
    assert!(runs[0].energy.total() > runs[2].energy.total());
}

#[test]
fn the_tile_buffer_saves_dram_traffic_and_energy() {
    let frame = frame(&room(), View::default());
    let e = evaluated(&frame, "none", Reuse::Primary, &SgrtConfig::default());
    assert!(e.reprojected.gbuffer.dram_bytes < e.whole_screen.dram_bytes);
    assert!(e.reprojected.energy.total() < e.whole_screen_energy_pj);
}
