//! Records do not depend on how draws are grouped into calls, regions and views.

use super::*;

#[test]
fn a_small_record_budget_gives_the_same_trace() {
    let masked = AlphaMode::Mask(0.5);
    let scene = crowd(&[(150, 21, AlphaMode::Opaque), (150, 22, masked)]);
    let whole = capture(&scene, SIZE_PX, 2, BUDGET);
    for budget in [300 << 10, 64 << 10] {
        let parts = capture(&scene, SIZE_PX, 2, budget);
        assert!(
            parts.trace == whole.trace,
            "budget {budget} changed the trace"
        );
        assert!(parts.pictures_match);
    }
}

#[test]
fn instances_in_one_draw_call_are_recorded_as_if_they_were_drawn_one_by_one() {
    for alpha in [AlphaMode::Opaque, AlphaMode::Blend] {
        let scene = many_instances(alpha);
        let captured = capture(&scene, SIZE_PX, 0, BUDGET);
        assert_eq!([captured.work.draws, captured.work.calls], [2 * 96, 2 * 12]);
        for pass in 0..2 {
            let a = agreement(&scene, &captured, pass, &passes);
            assert!(a.both > 500, "{a:?}");
            assert!(a.coverage_iou() >= 0.999, "{a:?}");
        }
        assert!(captured.pictures_match);
    }
}

#[test]
fn a_region_after_an_overflow_draws_only_what_may_touch_it() {
    let scene = many_instances(AlphaMode::Opaque);
    let whole = capture(&scene, SIZE_PX, 0, BUDGET);
    let parts = capture(&scene, SIZE_PX, 0, 8 << 10);
    assert!(parts.trace == whole.trace);
    let (draws, regions) = (parts.work.draws, parts.work.regions);
    println!(
        "{draws} draws in {regions} regions, {} in one a view",
        whole.work.draws
    );
    assert_eq!(whole.work.regions, 2);
    assert!(regions >= 6, "{regions}");
    // Drawing one view's draws in each region would take 96.
    assert!(
        draws < 96 * regions * 3 / 4,
        "{draws} draws in {regions} regions"
    );
}

#[test]
fn a_lone_view_has_the_records_that_it_has_in_a_stereo_pair() {
    let masked = AlphaMode::Mask(0.5);
    let scene = crowd(&[(60, 81, AlphaMode::Opaque), (60, 82, masked)]);
    let both = capture(&scene, SIZE_PX, 2, BUDGET);
    for (pass, eye) in [Eye::Left, Eye::Right].into_iter().enumerate() {
        let alone = try_capture(&scene, SIZE_PX, 2, BUDGET, &[eye], true).unwrap();
        assert_eq!(alone.tables.passes.len(), 1);
        assert_eq!(alone.tiles[0], both.tiles[pass]);
    }
}

#[test]
fn work_that_a_frame_does_not_need_is_not_done() {
    let masked = AlphaMode::Mask(0.5);
    let scene = crowd(&[(60, 81, AlphaMode::Opaque), (60, 82, masked)]);
    let capture = |plain| try_capture(&scene, SIZE_PX, 2, BUDGET, BOTH, plain).unwrap();
    let (with, without) = (capture(true).work, capture(false).work);
    // Rendered once for the plain and the captured pictures: one per cascade that is looked up; no visible
    // surface looks up the farther one.
    assert_eq!(with.shadow_maps, 1);
    // State of the textures, and of the slots without a texture.
    assert_eq!(with.samplers, 2);
    // Two casters, the opaque draw, the masked draw's records and its colour; the plain opaque draw has its
    // own pipeline.
    assert_eq!([without.pipelines, with.pipelines], [5, 6]);
    let captured = capture(false);
    assert!(captured.trace == capture(true).trace);
}

#[test]
fn a_budget_below_one_tile_is_refused() {
    let scene = crowd(&[(400, 31, AlphaMode::Blend)]);
    let captured = try_capture(&scene, SIZE_PX, 0, 4096, BOTH, true);
    let message = captured.err().unwrap().to_string();
    assert!(
        message.contains("alone needs") && message.contains("record budget"),
        "{message}"
    );
}

#[test]
fn the_records_of_each_pixel_are_as_many_as_an_additive_counter_sees() {
    let scene = crowd(&[(200, 61, AlphaMode::Opaque), (100, 62, AlphaMode::Blend)]);
    let captured = capture(&scene, SIZE_PX, 0, BUDGET);
    let draws = DrawList::new(&scene, 0).unwrap();
    let mut backend = driver(&scene, &draws, SIZE_PX);
    let lighting = Lighting::new(&scene);
    for (pass, eye) in BOTH.iter().enumerate() {
        let view = View {
            target: pass,
            layer: &Layer::whole(*eye, views(&scene, SIZE_PX).eyes[pass], SIZE_PX),
            lighting: &lighting,
            visible: &[],
        };
        let counted = backend.count_fragments(&draws, &view).unwrap();
        let mut recorded = vec![0; counted.len()];
        for (pixel, _) in self::recorded(&captured, pass) {
            recorded[(pixel[1] * SIZE_PX[0] + pixel[0]) as usize] += 1;
        }
        assert!(counted.iter().sum::<u32>() > 20_000);
        assert_eq!(counted, recorded);
    }
}

#[test]
fn untextured_draws_record_their_quads_without_a_group() {
    let scene = scene(
        vec![triangles(200, 41, 0)],
        vec![Material::default()],
        Vec::new(),
    );
    let captured = capture(&scene, SIZE_PX, 0, BUDGET);
    let records = || captured.tiles.iter().flatten().flat_map(|t| &t.records);
    assert!(records().count() > 1000);
    assert!(records().all(|r| r.group == formats::textrace::NO_GROUP));
    assert!(agreement(&scene, &captured, 0, &passes).coverage_iou() >= 0.999);
}

#[test]
fn a_device_that_cannot_capture_renders_the_same_pictures_and_refuses_to_capture() {
    let scene = crowd(&[
        (60, 71, AlphaMode::Opaque),
        (60, 72, AlphaMode::Mask(0.5)),
        (60, 73, AlphaMode::Blend),
    ]);
    let captured = capture(&scene, SIZE_PX, 1, BUDGET);
    let draws = DrawList::new(&scene, 1).unwrap();
    let set = TextureSet::compress(&scene).unwrap();
    let mut gpu = device::open(None).unwrap_or_else(|e| panic!("{e}"));
    gpu.no_capture = Some("what the test took away".into());
    let mut backend = Lavapipe::new(gpu, &scene, &draws, &set, SIZE_PX, BUDGET).unwrap();
    let planner = baseline(SIZE_PX, BOTH);
    let job = job(&scene, &draws, &planner);
    let frame = job.frame(&views(&scene, SIZE_PX)).unwrap();
    job.light(&mut backend, &frame).unwrap();
    let (pictures, _) = job.plain_frame(&mut backend, &frame).unwrap();
    assert!(pictures == captured.pictures);
    let work = backend.work();
    assert!(work.state_changes > 0 && work.triangles >= 2 * 180 && work.vertices >= 2 * 180);
    let refused = job.warm_up(&mut backend, &frame).unwrap_err().to_string();
    assert!(refused.contains("what the test took away"), "{refused}");
}
