//! How often the intervals of samples hold, and what the samples cost, on paths whose every frame is known.

use super::estimate::{Stratum, estimate};
use super::sample::{Aim, Promise, Sample, Step};
use super::stages::{error_of, fewest};
use super::strata::Planned;

/// Results of many samples of one figure of a path.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Trial {
    /// The figure of all frames.
    pub truth: f64,
    /// Samples drawn.
    pub draws: usize,
    /// Those that ended with all frames, which say nothing about intervals.
    pub of_everything: usize,
    /// Share of the other samples' intervals that contain the figure, percent.
    pub holds_pct: f64,
    /// Share of the other samples whose interval is no wider than promised, percent.
    pub kept_pct: f64,
    /// Mean number of frames of all samples.
    pub mean_frames: f64,
    /// Frames of the path.
    pub frames: usize,
    /// Least frames that keep the promise if all deviations are known (Neyman allocation).
    pub oracle_frames: usize,
    /// Mean half width of the intervals of samples that stopped.
    pub mean_half: f64,
    /// Mean half width at the same frames if deviations are known.
    pub known_half: f64,
}

/// Normal quantile of a two-sided interval.
fn normal(confidence: f64) -> f64 {
    super::estimate::student(confidence, 1e5)
}

/// Draws samples of one figure with seeds 1 to `draws`.
pub fn trial(plan: &[Planned], aim: &Aim<'_>, promise: &Promise, draws: u64) -> Trial {
    let all = |sample: &Sample<'_>| -> Vec<usize> {
        sample
            .strata
            .iter()
            .map(|block| block.frames.len())
            .collect()
    };
    let first = Sample::new(plan, 1);
    let whole = first.estimate(aim, &all(&first));
    let truth = whole.ratio;
    // Deviations of all frames around the true ratio.
    let variances: Vec<f64> = (first.strata.iter())
        .map(|block| {
            let pairs = block
                .frames
                .iter()
                .filter_map(|&at| aim.pair(plan[at].number));
            let sample = pairs.map(|[a, b]| [a - truth * b, 1.0]).collect();
            let stratum = Stratum {
                of: block.frames.len(),
                sample,
            };
            estimate(&[stratum]).variances[0]
        })
        .collect();
    let z = normal(promise.confidence);
    let half = promise.half(truth);
    let oracle = fewest(&first.strata, &variances, half * whole.denominator / z);
    let (mut everything, mut held, mut kept, mut frames) = (0, 0, 0, 0);
    let (mut halves, mut known) = (0.0, 0.0);
    for seed in 1..=draws {
        let sample = Sample::new(plan, seed);
        let Step::Done(figures, sizes) = sample.step(&[*aim], promise) else {
            continue;
        };
        let n: usize = sizes.iter().sum();
        frames += n;
        if n == plan.len() {
            everything += 1;
            continue;
        }
        let figure = &figures[0];
        let slack = 1e-9 * truth.abs();
        held += usize::from(figure.low <= truth + slack && truth <= figure.high + slack);
        kept += usize::from(figure.half() <= promise.half(figure.value) * (1.0 + 1e-9));
        halves += figure.half();
        known += z * error_of(&sample.strata, &variances, &sizes) / whole.denominator;
    }
    let stopped = (draws as usize - everything).max(1) as f64;
    Trial {
        truth,
        draws: draws as usize,
        of_everything: everything,
        holds_pct: 100.0 * held as f64 / stopped,
        kept_pct: 100.0 * kept as f64 / stopped,
        mean_frames: frames as f64 / draws as f64,
        frames: plan.len(),
        oracle_frames: oracle,
        mean_half: halves / stopped,
        known_half: known / stopped,
    }
}
