use super::super::testing::{Placed, Synthetic, View, globe, trace, wall};
use super::*;

fn room() -> Vec<Placed> {
    let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
    scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
    scene
}

/// A frame seen from a place that is moved to the right.
fn frame(right_m: f64) -> Synthetic {
    let view = View {
        center: [right_m as f32, 0.0, 0.0],
        ..View::default()
    };
    trace(&room(), view)
}

fn figures(previous: &Synthetic, current: &Synthetic, rule: &str) -> Vec<SchemeFigures> {
    let rule = rule.parse().expect("a rule");
    let config = SgrtConfig::default();
    let [previous, current] = [previous, current].map(|f| SequenceFrame::load(f).expect("loads"));
    schemes(&previous, &current, &rule, Reuse::Primary, &config).expect("runs")
}

#[test]
fn a_head_at_rest_reuses_every_pixel_without_error() {
    let still = frame(0.0);
    let found = figures(&still, &still, "none");
    let [full, _, temporal, both] = found.as_slice() else {
        panic!("{found:?}");
    };
    assert_eq!(full.reused_pct, [0.0; 2]);
    assert_eq!(full.relative_performance, 1.0);
    assert_eq!(temporal.reused_pct, [100.0; 2]);
    assert_eq!(temporal.flip_mean, [0.0; 2]);
    assert_eq!(both.reused_pct[0], 100.0);
    assert!(temporal.rays < full.rays);
}

#[test]
fn stereo_alone_is_that_of_replay_reproject() {
    let (previous, current) = (frame(0.0), frame(0.01));
    for rule in ["none", super::super::DEFAULT_RULE] {
        let found = figures(&previous, &current, rule)[1];
        let loaded = LoadedTrace::load(&current).expect("loads");
        let rule = rule.parse().expect("a rule");
        let run = loaded.run(&rule, Reuse::Primary, &SgrtConfig::default());
        let outcome = run.expect("runs").outcome;
        assert_eq!(found.relative_performance, outcome.relative_performance);
        assert_eq!(found.relative_energy, outcome.relative_energy);
        assert_eq!(found.flip_mean, [0.0, outcome.flip_mean]);
        assert_eq!(found.reused_pct, [0.0, outcome.reuse_pct]);
        assert_eq!(found.dram_bytes, outcome.dram.total());
    }
}

#[test]
fn a_small_step_of_the_head_reuses_more_than_the_distance_of_the_eyes() {
    let found = figures(&frame(0.0), &frame(0.003), super::super::DEFAULT_RULE);
    let (stereo, temporal) = (&found[1], &found[2]);
    assert!(temporal.reused_pct[1] > stereo.reused_pct[1], "{found:?}");
    assert!(
        temporal.gbuffer_dram_bytes > stereo.gbuffer_dram_bytes,
        "{found:?}"
    );
    assert!(found[3].rays < stereo.rays.min(found[0].rays), "{found:?}");
}

#[test]
fn arrivals_from_the_previous_frame_are_those_of_a_search_over_all_pixels() {
    let (previous, current) = (frame(0.0), frame(0.02));
    for eye in [Eye::Left, Eye::Right] {
        let frames = [&previous, &current].map(|f| Frame::load(f).expect("loads"));
        let frame = over_time(&frames[0], &frames[1], eye).expect("one scene");
        let loaded = LoadedTrace::of(&current, frame);
        let [from, to] = &loaded.frame.eyes;
        let camera = current.tables().camera(eye);
        let [width, height] = loaded.frame.size_px;
        for at in (0..width * height).step_by(7) {
            let nearest = (0u32..)
                .zip(&from.samples)
                .filter(|(_, sample)| !sample.is_sky())
                .filter_map(|(source, sample)| {
                    let ([x, y], depth) = camera.project(sample.position)?;
                    let inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
                    (inside && y as u32 * width + x as u32 == at).then_some((depth, source))
                })
                .min_by(|a, b| a.partial_cmp(b).expect("numbers"));
            let found = loaded.arrived.candidates[at as usize];
            let expected = nearest.map_or(super::super::reproject::NONE, |(_, source)| source);
            assert_eq!(found.source, expected, "{eye}, {at}");
        }
        assert_eq!(to.samples.len(), (width * height) as usize);
    }
}

#[test]
fn frames_of_other_scenes_are_refused() {
    let (still, rule) = (frame(0.0), Rule::default());
    let refused = |other: &Synthetic| {
        let config = SgrtConfig::default();
        let [still, other] = [&still, other].map(|f| SequenceFrame::load(f).expect("loads"));
        let found = schemes(&still, &other, &rule, Reuse::Primary, &config);
        found.map(drop).unwrap_err().to_string()
    };
    let mut moved = room();
    moved.extend(globe([0.4, 0.0, -1.5], 0.3, 3));
    moved.remove(0);
    let text = refused(&trace(&moved, View::default()));
    assert!(text.contains("previous frame"), "{text}");
    let smaller = View {
        size_px: [16, 16],
        ..View::default()
    };
    let text = refused(&trace(&room(), smaller));
    assert!(text.starts_with("images' sizes"), "{text}");
}
