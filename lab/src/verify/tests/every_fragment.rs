//! Captures without the depth test: all covered fragments, and the same picture.

use super::*;
use std::collections::BTreeSet;

/// A stereo frame as planned, all fragments recorded, after a plain picture of it.
fn capture_all(planner: &Planner, scene: &Scene, cascades: u32, budget: u64) -> Captured {
    let (skips, all) = (Skips::default(), Fragments::All);
    let captured = capture_skipping(planner, scene, cascades, budget, true, skips, all);
    captured.unwrap_or_else(|e| panic!("{e}")).0
}

/// Opaque, masked and blended draws that intersect, not sorted by depth.
fn thicket() -> Scene {
    let meshes = (0..6)
        .map(|m| triangles(80, 111 + m as u32, m % 3))
        .collect();
    let modes = [AlphaMode::Opaque, AlphaMode::Mask(0.5), AlphaMode::Blend];
    let materials = modes.map(|mode| textured(mode, true)).into();
    scene(meshes, materials, vec![checker()])
}

#[test]
fn every_covered_fragment_is_recorded_and_the_picture_stays() {
    let scene = thicket();
    let tested = capture(&scene, SIZE_PX, 0, BUDGET);
    let all = capture_all(&baseline(SIZE_PX, BOTH), &scene, 0, BUDGET);
    assert!(all.pictures_match);
    assert!(all.pictures == tested.pictures);
    assert_eq!(all.counts.masked_lanes_killed, 0);
    for pass in 0..2 {
        let a = agreement(&scene, &all, pass, &checker_passes);
        println!("pass {pass}: {a:?}, IoU {:.6}", a.coverage_iou());
        assert!(a.coverage_iou() >= 0.999, "{a:?}");
        let (all, tested) = (recorded(&all, pass), recorded(&tested, pass));
        assert!(all.is_superset(&tested));
        assert!(all.len() > 2 * tested.len(), "the scene must hide much");
    }
}

#[test]
fn a_small_record_budget_gives_the_same_trace_of_every_fragment() {
    let (scene, planner) = (thicket(), baseline(SIZE_PX, BOTH));
    let whole = capture_all(&planner, &scene, 2, BUDGET);
    let parts = capture_all(&planner, &scene, 2, 256 << 10);
    assert!(parts.work.regions > whole.work.regions);
    assert!(parts.trace == whole.trace);
    assert!(parts.pictures_match && parts.pictures == whole.pictures);
}

#[test]
fn nothing_is_recorded_where_a_mask_lets_nothing_be_drawn() {
    let settings = Settings {
        hidden_area_mask: true,
        ..Settings::default()
    };
    let (scene, planner) = (thicket(), planner(&settings, SIZE_PX, BOTH));
    let masked = capture_all(&planner, &scene, 0, BUDGET);
    let whole = capture_all(&baseline(SIZE_PX, BOTH), &scene, 0, BUDGET);
    assert!(masked.pictures_match);
    for pass in 0..2 {
        let plan = planner
            .plan(&views(&scene, SIZE_PX), false, Vec::new)
            .unwrap();
        let mask = plan.layers[pass].mask.as_ref().expect("a mask");
        let open = |&([x, y], _): &([u32; 2], u32)| mask.flags()[(y * SIZE_PX[0] + x) as usize];
        let (masked, whole) = (recorded(&masked, pass), recorded(&whole, pass));
        let inside: BTreeSet<_> = whole.iter().copied().filter(open).collect();
        assert!(inside.len() < whole.len());
        assert_eq!(masked, inside);
    }
}
