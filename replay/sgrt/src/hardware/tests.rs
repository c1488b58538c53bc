use super::*;
use crate::detect::{PixelClass, decide};
use crate::reproject::reproject;
use crate::rows::RowNeeds;
use crate::rules::Rule;
use crate::testing::{Placed, View, frame, rows_in_dram, wall};
use crate::ways::compare;
use formats::raytrace::TraversalKind;

fn decisions(frame: &Frame, rule: &str) -> Vec<Decision> {
    let rule: Rule = rule.parse().expect("a rule");
    decide(frame, &reproject(frame), &rule)
}

fn compared(frame: &Frame, rule: &str, reuse: Reuse, config: &SgrtConfig) -> Comparison {
    compared_as(frame, rule, &decisions(frame, rule), reuse, config)
}

fn compared_as(
    frame: &Frame,
    rule: &str,
    decisions: &[Decision],
    reuse: Reuse,
    config: &SgrtConfig,
) -> Comparison {
    let reads = rule.parse::<Rule>().expect("a rule").reads();
    let rows = RowNeeds::new(frame, &reproject(frame));
    let work = tile_work(frame, decisions, reuse);
    let misses = misses_by_rates(&work, frame, config);
    let plan = usual_plan(&frame.tables);
    compare(frame, [&plan; 2], &work, &misses, reads, &rows, config)
}

/// A wall seen by two eyes at the same position: the whole right image is reused.
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
fn with_full_reuse_the_units_trace_only_the_left_eye() {
    let frame = all_reused();
    let config = SgrtConfig::default();
    let e = compared(&frame, "none", Reuse::Shadow, &config);
    assert!((e.reprojected.tni_cycles / e.reference.tni_cycles - 0.5).abs() < 1e-9);
    assert_eq!(e.right_tni_cycles, 0.0);
    // With primary reuse the shadow rays remain: 12 of 32 steps.
    let e = compared(&frame, "none", Reuse::Primary, &config);
    let steps = |run: &Run| run.work.steps() as f64;
    assert!((steps(&e.reprojected) / steps(&e.reference) - (32.0 + 12.0) / 64.0).abs() < 1e-9);
}

#[test]
fn without_added_kernels_half_the_rays_double_the_performance() {
    let frame = all_reused();
    let mut config = SgrtConfig::default();
    config.srp.reproject_cycles = 0.0;
    config.srp.detect_cycles = 0.0;
    config.srp.reuse_cycles = 0.0;
    config.srp.cores = 4096;
    config.memory.bandwidth_gb_s = 1e15;
    let e = compared(&frame, "none", Reuse::Color, &config);
    assert!((e.relative_performance() - 2.0).abs() < 1e-9);
}

#[test]
fn a_core_bound_frame_gains_nothing_from_fewer_rays_in_the_units() {
    let frame = all_reused();
    let mut config = SgrtConfig::default();
    config.srp.cores = 1;
    config.srp.lanes_per_core = 1;
    config.srp.ray_generation_cycles = 0.0;
    let e = compared(&frame, "none", Reuse::Shadow, &config);
    // The same amount of shading, and three more kernels.
    assert!(e.relative_performance() < 1.0);
    let added = e.reprojected.srp.added_lane_cycles() / e.reference.srp.lane_cycles();
    assert!((1.0 / e.relative_performance() - (1.0 + added)).abs() < 1e-9);
}

#[test]
fn without_reuse_the_cost_is_the_reference_plus_the_added_kernels() {
    let frame = frame(&room(), View::default());
    let config = SgrtConfig::default();
    let mut decisions = decisions(&frame, "none");
    for d in &mut decisions {
        d.class = PixelClass::Bad;
        d.tests = 0;
    }
    let e = compared_as(&frame, "none", &decisions, Reuse::Color, &config);
    assert_eq!(e.reprojected.work.steps(), e.reference.work.steps());
    assert_eq!(e.reprojected.tni_cycles, e.reference.tni_cycles);
    assert!(e.relative_performance() <= 1.0);
}

#[test]
fn each_level_of_reuse_reduces_the_work() {
    let frame = frame(&room(), View::default());
    let config = SgrtConfig::default();
    let runs = Reuse::ALL.map(|reuse| compared(&frame, "none", reuse, &config).reprojected);
    assert!(runs[0].work.steps() > runs[1].work.steps());
    assert_eq!(runs[1].work.steps(), runs[2].work.steps());
    assert!(runs[1].work.shaded > runs[2].work.shaded);
    assert!(runs[0].energy.total() > runs[2].energy.total());
}

#[test]
fn the_tile_buffer_saves_dram_traffic_and_energy() {
    let frame = frame(&room(), View::default());
    let e = compared(&frame, "none", Reuse::Primary, &SgrtConfig::default());
    assert!(e.reprojected.dram.total() < e.whole_screen.dram.total());
    assert!(e.reprojected.energy.total() < e.whole_screen.energy.total());
}

#[test]
fn detection_traffic_equals_the_bytes_that_its_rule_reads() {
    let frame = frame(&room(), View::default());
    let of = |rule| {
        let e = compared(&frame, rule, Reuse::Primary, &rows_in_dram());
        e.reprojected.dram.gbuffer_bytes
    };
    // 40 rows form bands of 16, 16 and 8; each also fetches the adjacent rows.
    let pixels = 72 * 40;
    let with_neighbours = 72 * (17 + 18 + 9);
    assert_eq!(of("none"), 12 * 2 * pixels);
    assert_eq!(of("triangle"), 16 * 2 * pixels);
    assert_eq!(of("depth"), 12 * (pixels + with_neighbours));
    assert_eq!(of(crate::DEFAULT_RULE), 21 * (pixels + with_neighbours));
}

#[test]
fn a_bandwidth_bound_frame_takes_the_time_of_its_dram_bytes() {
    let frame = frame(&room(), View::default());
    let mut config = rows_in_dram();
    config.memory.bandwidth_gb_s = 0.001;
    let e = compared(&frame, "none", Reuse::Primary, &config);
    for run in [&e.reference, &e.reprojected, &e.whole_screen] {
        let charged = run.energy.dram_pj / config.energy.dram_pj_per_byte;
        let ns = charged / config.memory.bandwidth_gb_s;
        assert!((run.time_ns / ns - 1.0).abs() < 1e-9);
        assert_eq!(run.memory_bound_ns, run.time_ns);
    }
    // Tracing both eyes moves fewer bytes, because it needs no G-buffer.
    assert!(e.relative_performance() < 1.0);
    assert!(e.whole_screen.time_ns > e.reprojected.time_ns);
}

#[test]
fn a_wide_node_is_not_charged_as_a_step_of_two_boxes() {
    let of = |tree| {
        let view = View {
            tree,
            ..View::default()
        };
        let frame = frame(&room(), view);
        compared(&frame, "none", Reuse::Primary, &SgrtConfig::default()).reference
    };
    let (narrow, wide) = (of(TraversalKind::Bvh2), of(TraversalKind::Bvh8));
    assert_eq!(narrow.work, wide.work);
    assert!(wide.tni.traversal > 3.0 * narrow.tni.traversal);
    assert!(wide.energy.tni_pj > narrow.energy.tni_pj);
}

#[test]
fn eyes_that_need_more_rows_have_more_traffic() {
    let of = |cant_deg| {
        let view = View {
            cant_deg,
            ..View::default()
        };
        let frame = frame(&room(), view);
        let e = compared(&frame, "none", Reuse::Primary, &rows_in_dram());
        e.reprojected.dram.gbuffer_bytes
    };
    assert!(of(10.0) > of(0.0), "{} {}", of(10.0), of(0.0));
}

#[test]
fn reuse_of_colours_saves_diffuse_rays_only_where_they_look_the_same() {
    let decision = |looks_alike| Decision {
        class: PixelClass::Reused,
        source: 0,
        primitive: 0,
        exact: None,
        tests: 0,
        retraces_shadows: false,
        looks_alike,
    };
    for (reuse, alike, other) in [
        (Reuse::Primary, true, true),
        (Reuse::Shadow, true, true),
        (Reuse::Color, false, true),
        (Reuse::Pixel, false, false),
    ] {
        let traced = |looks_alike| is_traced(&decision(looks_alike), RayClass::Secondary, reuse);
        assert_eq!([traced(true), traced(false)], [alike, other], "{reuse:?}");
    }
}
