use super::estimate::{Stratum, chi_square, estimate, figure, student};
use super::of::Of;
use super::sample::{Aim, Promise, Sample, Step, Within};
use super::stages::{fewest, pilot};
use super::strata::Planned;
use super::trial::trial;
use super::values::{FrameCounts, Series};
use formats::random::Random;
use sim::figure::Because;

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
