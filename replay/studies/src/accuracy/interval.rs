//! Means of samples, their confidence intervals, and how often these contain the true value.

use formats::random::Random;
use sim::figure::{Because, Figure};

/// `count` of the first `of` numbers, every subset with equal probability.
pub fn some(random: &mut Random, count: usize, of: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..of).collect();
    for at in 0..count.min(of) {
        let with = at + (random.bits() % (of - at) as u64) as usize;
        all.swap(at, with);
    }
    all.truncate(count);
    all
}

/// Student's t for 95 %, two-sided, from 1 degree of freedom.
const STUDENT: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160,
    2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056,
    2.052, 2.048, 2.045, 2.042,
];

/// Values beyond the table are within 0.003.
fn student(degrees: usize) -> f64 {
    match degrees.checked_sub(1) {
        None => f64::INFINITY,
        Some(index) => (STUDENT.get(index).copied()).unwrap_or_else(|| 1.96 + 2.4 / degrees as f64),
    }
}

/// Mean of a sample with its 95 % confidence interval, from Student's t with the finite population correction.
pub fn mean(sample: &[f64], of: usize) -> Figure {
    let n = sample.len();
    let count = n as f64;
    let mean = sample.iter().sum::<f64>() / count;
    let squares = sample.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    let left = 1.0 - count / of as f64;
    if left <= 0.0 {
        return Figure::exact(mean);
    }
    let variance = squares / (count - 1.0).max(1.0);
    let half = student(n - 1) * (variance / count * left).sqrt();
    let because = Because::Sampling {
        method: "Student's t",
        n,
        of,
        degrees_of_freedom: count - 1.0,
    };
    Figure::sampled(mean, half, 0.95, because)
}

/// Quality of a kind of sample, percent.
#[derive(Clone, Debug)]
pub(super) struct Judged {
    /// Root mean square error.
    pub error_pct: f64,
    /// Mean error, which does not shrink with larger samples.
    pub bias_pct: f64,
    /// Mean half width of the 95 % interval.
    pub interval_pct: f64,
    /// Share of intervals that contain the true value; nominally 95.
    pub holds_pct: f64,
    /// The first draw, percent of the true value.
    pub estimate_pct: Option<Figure>,
}

/// Evaluates draws against the true value.
pub fn judged(truth: f64, draws: &[Figure]) -> Judged {
    let count = draws.len().max(1) as f64;
    let percent = |value: f64| 100.0 * value / truth.max(1.0);
    let errors = draws.iter().map(|draw| draw.value - truth);
    let squares = errors.clone().map(|e| e * e).sum::<f64>();
    // Allow for rounding, because an estimate from all values equals the true value.
    let holds = |draw: &&Figure| (draw.value - truth).abs() <= draw.half() + 1e-9 * truth;
    Judged {
        error_pct: percent((squares / count).sqrt()),
        bias_pct: percent(errors.sum::<f64>() / count),
        interval_pct: percent(draws.iter().map(Figure::half).sum::<f64>() / count),
        holds_pct: 100.0 * draws.iter().filter(holds).count() as f64 / count,
        estimate_pct: draws.first().map(|first| first.clone().times(percent(1.0))),
    }
}

/// Draws random samples of every `one_in`-th value and estimates the sum of all values.
pub fn drawn(values: &[f64], one_in: u64, truth: f64) -> Judged {
    /// Enough draws to distinguish 95 % from 92 %.
    const DRAWS: u64 = 400;
    let whole = values.len();
    let count = (whole / one_in as usize).max(2);
    let draw = |seed: u64| {
        let chosen = some(&mut Random(seed), count, whole);
        let sample: Vec<f64> = chosen.iter().map(|&at| values[at]).collect();
        mean(&sample, whole).times(whole as f64)
    };
    let draws: Vec<Figure> = (0..DRAWS).map(draw).collect();
    judged(truth, &draws)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: &[f64], one_in: u64) -> Judged {
        drawn(values, one_in, values.iter().sum())
    }

    /// For values that differ only by noise, intervals contain the true value about as often as their level
    /// says.
    #[test]
    fn intervals_contain_the_mean_of_similar_values_and_miss_that_of_skewed_ones() {
        let mut random = Random(5);
        let mut value = || 1000.0 + (random.bits() % 200) as f64;
        let alike: Vec<f64> = (0..128).map(|_| value()).collect();
        for one_in in [8, 32] {
            let good = of(&alike, one_in);
            assert!(good.holds_pct > 91.0 && good.holds_pct < 99.0, "{good:?}");
            assert!(
                good.error_pct < 4.0 && good.bias_pct.abs() < 1.0,
                "{good:?}"
            );
        }
        let mut few = vec![10.0; 128];
        few[7] = 100_000.0;
        let bad = of(&few, 8);
        assert!(bad.holds_pct < 50.0, "{bad:?}");
    }

    #[test]
    fn a_sample_of_all_values_has_no_error() {
        let all = of(&[5.0, 9.0, 1.0, 40.0], 1);
        assert_eq!((all.interval_pct, all.holds_pct), (0.0, 100.0));
        assert!(all.error_pct < 1e-9);
        assert_eq!(all.estimate_pct.unwrap().because, Because::Exact);
    }

    #[test]
    fn draws_are_without_repetition() {
        for seed in 0..50 {
            let mut chosen = some(&mut Random(seed), 20, 32);
            chosen.sort_unstable();
            chosen.dedup();
            assert_eq!(chosen.len(), 20);
        }
    }
}
