use super::cold::{Cold, cold};
use super::estimate::{Stratum, chi_square, estimate, figure, student};
use super::of::Of;
use super::run::Run;
use super::sample::{Aim, Promise, Sample, Step, Within};
use super::stages::{fewest, pilot};
use super::strata::Planned;
use super::trial::trial;
use super::values::{FrameCounts, Series, by_frame};
use formats::random::Random;
use sim::config::{BetweenFrames, LevelConfig, Levels, Mode, Order, RunConfig};
use sim::engine::replay;
use sim::figure::Because;
use sim::stream::MemoryTrace;
use sim::stream::testing::different_frames;

/// Quantiles from printed tables.
#[test]
fn quantiles_are_those_of_the_tables() {
    for (confidence, degrees, expected) in [
        (0.95, 1.0, 12.706),
        (0.95, 5.0, 2.571),
        (0.99, 10.0, 3.169),
        (0.95, 1e5, 1.960),
    ] {
        let found = student(confidence, degrees);
        assert!(
            (found - expected).abs() < 2e-3,
            "{confidence} {degrees}: {found}"
        );
    }
    for (probability, degrees, expected) in [(0.2, 5.0, 2.343), (0.95, 3.0, 7.815)] {
        let found = chi_square(probability, degrees);
        assert!(
            (found - expected).abs() < 2e-3,
            "{probability} {degrees}: {found}"
        );
    }
}

/// One stratum of equal denominators is the mean of a simple random sample.
#[test]
fn a_single_stratum_is_the_textbook_case() {
    let sample = [3.0, 5.0, 4.0, 8.0].map(|a| [a, 1.0]).to_vec();
    let found = estimate(&[Stratum { of: 20, sample }]);
    let variance: f64 = 14.0 / 3.0;
    assert_eq!((found.ratio, found.degrees), (5.0, 3.0));
    assert!((found.variances[0] - variance).abs() < 1e-12);
    assert!((found.error - (variance / 4.0 * 0.8).sqrt()).abs() < 1e-12);
}

/// All samples of a small population: the mean of the estimated variances is the variance of the estimates.
#[test]
fn the_variance_is_unbiased_over_all_samples_of_a_small_population() {
    let frames = [1.0, 4.0, 9.0, 2.0, 20.0];
    let (mut means, mut variances) = (Vec::new(), Vec::new());
    for a in 0..5 {
        for b in a + 1..5 {
            let sample = [frames[a], frames[b]].map(|value| [value, 1.0]).to_vec();
            let found = estimate(&[Stratum { of: 5, sample }]);
            means.push(found.ratio);
            variances.push(found.error * found.error);
        }
    }
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let center = mean(&means);
    let spread: Vec<f64> = means.iter().map(|m| (m - center).powi(2)).collect();
    assert!((center - 7.2).abs() < 1e-9, "{center}");
    assert!((mean(&spread) - mean(&variances)).abs() < 1e-9);
}

/// A stratum of equal frames takes part of the variance of the others.
#[test]
fn variances_are_drawn_towards_their_common_one() {
    let stratum = |values: [f64; 3]| Stratum {
        of: 10,
        sample: values.map(|a| [a, 1.0]).to_vec(),
    };
    let found = estimate(&[stratum([5.0; 3]), stratum([1.0, 5.0, 9.0])]);
    // The common one is 8: two degrees of freedom each, variances 0 and 16.
    let expected = [8.0 / 3.0, (2.0 * 16.0 + 8.0) / 3.0];
    for (found, expected) in found.variances.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
}

#[test]
fn a_sample_of_all_frames_is_exact() {
    let sample = vec![[1.0, 2.0], [3.0, 4.0]];
    let found = figure(&[Stratum { of: 2, sample }], 0.95);
    assert_eq!((found.value, found.because), (4.0 / 6.0, Because::Exact));
}

/// Frames whose bytes follow a count of the plan, with noise, and the same frames in a baseline order.
struct Path {
    plan: Vec<Planned>,
    own: Series,
    base: Series,
}

fn path(frames: u32, level: impl Fn(u32) -> f64, noise: f64, seed: u64) -> Path {
    let mut random = Random(seed);
    let mut found = Path {
        plan: Vec::new(),
        own: Series::new(),
        base: Series::new(),
    };
    let counts = |bytes: f64| FrameCounts {
        external_bytes: bytes as u64,
        ..FrameCounts::default()
    };
    for number in 0..frames {
        let mut uniform = || (random.bits() % 10_001) as f64 / 5000.0 - 1.0;
        let normal = (0..6).map(|_| uniform()).sum::<f64>() / 2f64.sqrt();
        let base = 1e6 * (1.0 + 0.1 * uniform());
        found.plan.push(Planned {
            number,
            counts: vec![1000.0 * level(number)],
            cut: number == 0,
        });
        found.base.insert(number, counts(base));
        found.own.insert(
            number,
            counts(base * (0.5 + 0.1 * level(number) + noise * normal)),
        );
    }
    found
}

fn aim(of: &Path) -> Aim<'_> {
    Aim {
        of: Of::Saving,
        values: &of.own,
        baseline: &of.base,
    }
}

const POINT: Promise = Promise {
    within: Within::Points(1.0),
    confidence: 0.95,
};

#[test]
fn intervals_of_stopped_samples_hold_on_smooth_paths_and_across_a_step_that_the_plan_sees() {
    let smooth = path(120, |_| 1.0, 0.03, 7);
    let step = path(120, |frame| if frame < 50 { 1.0 } else { 3.0 }, 0.02, 9);
    for of in [smooth, step] {
        let found = trial(&of.plan, &aim(&of), &POINT, 400);
        assert!(found.holds_pct >= 90.0, "{found:?}");
        assert!(found.mean_half <= 1.5 * found.known_half, "{found:?}");
        assert!(found.of_everything < 40, "{found:?}");
        assert!(found.mean_frames < 0.6 * found.frames as f64, "{found:?}");
    }
}

#[test]
fn a_path_of_equal_frames_needs_the_pilot_alone() {
    let equal = path(100, |_| 1.0, 0.0, 3);
    let sample = Sample::new(&equal.plan, 1);
    let Step::Done(figures, sizes) = sample.step(&[aim(&equal)], &POINT) else {
        panic!("frames are missing");
    };
    assert_eq!(sizes, pilot(&sample.strata));
    assert!(figures[0].half() < 1e-3, "{figures:?}");
}

#[test]
fn missing_frames_are_named_stage_by_stage_and_a_sample_is_reproducible() {
    let whole = path(90, |_| 1.0, 0.05, 5);
    let sample = Sample::new(&whole.plan, 2);
    let mut known = Path {
        plan: whole.plan.clone(),
        own: Series::new(),
        base: Series::new(),
    };
    let mut stages = Vec::new();
    let figures = loop {
        match sample.step(&[aim(&known)], &POINT) {
            Step::Capture(frames) => {
                for frame in &frames {
                    known.own.insert(*frame, whole.own[frame]);
                    known.base.insert(*frame, whole.base[frame]);
                }
                stages.push(frames);
            }
            Step::Done(figures, _) => break figures,
        }
    };
    assert_eq!(stages.len(), 2, "{stages:?}");
    let Step::Done(again, _) = Sample::new(&whole.plan, 2).step(&[aim(&whole)], &POINT) else {
        panic!("frames are missing");
    };
    assert_eq!(figures, again);
}

#[test]
fn the_oracle_needs_no_more_frames_where_frames_are_alike() {
    let of = path(100, |_| 1.0, 0.03, 1);
    let sample = Sample::new(&of.plan, 1);
    let few = fewest(&sample.strata, &vec![0.0; sample.strata.len()], 1.0);
    let many = fewest(&sample.strata, &vec![1e12; sample.strata.len()], 1.0);
    assert!(few < 25 && many == 100, "{few} {many}");
}

/// The frames of a trace with these numbers.
fn only(trace: &MemoryTrace, frames: &[u32]) -> MemoryTrace {
    let mut kept = trace.clone();
    kept.tables.passes.clear();
    kept.tiles.clear();
    for (pass, tiles) in trace.tables.passes.iter().zip(&trace.tiles) {
        if frames.contains(&pass.frame) {
            kept.tables.passes.push(*pass);
            kept.tiles.push(tiles.clone());
        }
    }
    kept
}

fn machine(mode: Mode, l2_bytes: u64) -> RunConfig {
    RunConfig {
        mode,
        order: Order::Z2_STA,
        level: Levels::two(LevelConfig::lru(256), LevelConfig::lru(l2_bytes)),
        ..RunConfig::default()
    }
}

#[test]
fn counts_by_frame_add_up_to_a_replay_of_all_frames() {
    let trace = different_frames();
    for mode in [Mode::Functional, Mode::Timed] {
        let config = machine(mode, 4 << 10);
        let whole = replay(&trace, &config).unwrap();
        let series = by_frame(&Run::all(&trace), &[config]).unwrap().remove(0);
        let sum = |of: fn(&FrameCounts) -> u64| series.values().map(of).sum::<u64>();
        assert_eq!(series.keys().copied().collect::<Vec<_>>(), [0, 1, 2]);
        assert!(series.values().all(|frame| frame.external_bytes > 0));
        assert_eq!(sum(|f| f.external_bytes), whole.external_bytes);
        assert_eq!(sum(|f| f.footprints), whole.footprints);
        assert_eq!(sum(|f| f.l2_line_lookups), whole.l2.counters.line_lookups);
        assert_eq!(sum(|f| f.cycles), whole.cycles.unwrap_or(0));
    }
}

#[test]
fn a_gap_in_the_numbers_of_frames_empties_the_caches() {
    let trace = different_frames();
    let config = machine(Mode::Functional, 64 << 10);
    let apart = by_frame(&Run::all(&only(&trace, &[0, 2])), &[config])
        .unwrap()
        .remove(0);
    for frame in [0, 2] {
        let alone = replay(&only(&trace, &[frame]), &config).unwrap();
        assert_eq!(apart[&frame].external_bytes, alone.external_bytes);
    }
    let warmed = by_frame(&Run::all(&trace), &[config]).unwrap().remove(0);
    assert!(warmed[&2].external_bytes < apart[&2].external_bytes);
    // A frame of a trace of all frames comes after the frame before it.
    let around = by_frame(&Run::around(&trace, &[2]), &[config])
        .unwrap()
        .remove(0);
    let after = by_frame(&Run::all(&only(&trace, &[1, 2])), &[config])
        .unwrap()
        .remove(0);
    assert_eq!(around, after);
    assert_eq!(around.len(), 2);
}

/// The bytes of a frame after all frames before it lie between the bounds of a capture of some of them.
#[test]
fn bounds_of_a_cold_start_enclose_the_frame_of_the_whole_path() {
    let trace = different_frames();
    let (mut exact, mut open) = (0, 0);
    for l2_kib in [1, 2, 4, 8, 16, 64, 256] {
        let config = machine(Mode::Functional, l2_kib << 10);
        let whole = by_frame(&Run::all(&trace), &[config]).unwrap().remove(0);
        for captured in [&[2][..], &[1, 2]] {
            let part = only(&trace, captured);
            let most = by_frame(&Run::all(&part), &[config]).unwrap().remove(0)[&2].external_bytes;
            let cold = cold(&Run::all(&part), &config).unwrap()[&2];
            let truth = whole[&2].external_bytes;
            if cold.l1_misses == 0 {
                assert!(
                    most - cold.l2_bytes <= truth && truth <= most,
                    "{l2_kib} {cold:?}"
                );
                exact += u32::from(cold.l2_bytes == 0 && truth == most);
                open += u32::from(cold.l2_bytes > 0);
            }
        }
    }
    assert!(exact > 0 && open > 0, "{exact} {open}");
    let flush = RunConfig {
        between_frames: BetweenFrames::Flush,
        ..machine(Mode::Functional, 4 << 10)
    };
    let from_the_start = cold(&Run::all(&trace), &machine(Mode::Functional, 4 << 10)).unwrap();
    for cold in [
        cold(&Run::all(&only(&trace, &[1, 2])), &flush).unwrap(),
        from_the_start,
    ] {
        assert!(cold.values().all(|cold| *cold == Cold::default()));
    }
}
