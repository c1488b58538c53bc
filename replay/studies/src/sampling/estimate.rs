//! Ratios of totals over the frames of a path, estimated from a stratified random sample.
//!
//! The ratio of totals is `R = sum N_h mean_h(a) / sum N_h mean_h(b)`; its variance comes from the residuals `a - R b`
//! (Cochran, Sampling Techniques, 3rd edition, section 6.11). The degrees of freedom are Satterthwaite's.

use sim::figure::{Because, Figure};

/// Numerator and denominator of a figure in one frame.
pub type Pair = [f64; 2];

/// Factor on the half width. Values of frames are skewed, so Student's intervals hold too rarely. With this factor they
/// hold on 95 % of the populations of results/sampling.csv, on which it was chosen.
const WIDER: f64 = 1.25;
/// Coefficient of variation of the denominator's total from which on the interval is Fieller's.
const VARYING: f64 = 0.1;

/// The frames of a stratum that were replayed.
#[derive(Clone, Debug, Default)]
pub struct Stratum {
    /// Frames in the stratum.
    pub of: usize,
    /// The values of the sample.
    pub sample: Vec<Pair>,
}

impl Stratum {
    fn mean(&self, part: usize) -> f64 {
        self.sample.iter().map(|pair| pair[part]).sum::<f64>() / self.sample.len().max(1) as f64
    }

    /// Sample covariance of two linear forms of the pair.
    fn covariance(&self, a: impl Fn(&Pair) -> f64, b: impl Fn(&Pair) -> f64) -> f64 {
        let n = self.sample.len() as f64;
        if n < 2.0 {
            return 0.0;
        }
        let mean = |form: &dyn Fn(&Pair) -> f64| self.sample.iter().map(form).sum::<f64>() / n;
        let (mean_a, mean_b) = (mean(&a), mean(&b));
        let products = (self.sample.iter()).map(|pair| (a(pair) - mean_a) * (b(pair) - mean_b));
        products.sum::<f64>() / (n - 1.0)
    }

    /// `N^2 (1 - n / N) / n`, the factor from a variance between frames to that of the total.
    fn factor(&self) -> f64 {
        let (n, of) = (self.sample.len() as f64, self.of as f64);
        of * (of - n) / n.max(1.0)
    }
}

/// An estimated ratio and what its variance is from.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The ratio of the totals.
    pub ratio: f64,
    /// The denominator's total.
    pub denominator: f64,
    /// Variance of the residuals between the frames of each stratum, drawn towards the common one.
    pub variances: Vec<f64>,
    /// Standard error of the ratio.
    pub error: f64,
    /// Satterthwaite's degrees of freedom; infinite if no frame is left out.
    pub degrees: f64,
    n: usize,
    of: usize,
}

/// Estimates a ratio. Strata without a sample count as empty.
pub fn estimate(strata: &[Stratum]) -> Estimate {
    let total = |part: usize| {
        strata
            .iter()
            .map(|s| s.of as f64 * s.mean(part))
            .sum::<f64>()
    };
    let denominator = total(1);
    let ratio = if denominator == 0.0 {
        0.0
    } else {
        total(0) / denominator
    };
    let residual = |pair: &Pair| pair[0] - ratio * pair[1];
    let of_each = strata.iter().map(|s| s.covariance(residual, residual));
    let variances = shrunk(strata, &of_each.collect::<Vec<f64>>());
    let parts = || {
        strata
            .iter()
            .zip(&variances)
            .map(|(s, variance)| (s, s.factor() * variance))
    };
    let variance: f64 = parts().map(|(_, part)| part).sum();
    let squares: f64 = parts()
        .map(|(s, part)| part * part / (s.sample.len().max(2) - 1) as f64)
        .sum();
    Estimate {
        ratio,
        denominator,
        error: variance.max(0.0).sqrt() / denominator.abs().max(f64::MIN_POSITIVE),
        degrees: if squares > 0.0 {
            variance * variance / squares
        } else {
            f64::INFINITY
        },
        variances,
        n: strata.iter().map(|s| s.sample.len()).sum(),
        of: strata.iter().map(|s| s.of).sum(),
    }
}

/// Variances of the strata, drawn towards their common one by one degree of freedom: a few equal frames do not prove that
/// all of a stratum are equal. Strata without a frame left out count as they are.
fn shrunk(strata: &[Stratum], variances: &[f64]) -> Vec<f64> {
    let freedom = |s: &Stratum| match s.sample.len() {
        n if n < s.of => n.saturating_sub(1) as f64,
        _ => 0.0,
    };
    let sum: f64 = strata.iter().map(freedom).sum();
    let weighted: f64 = strata
        .iter()
        .zip(variances)
        .map(|(s, v)| freedom(s) * v)
        .sum();
    let common = weighted / sum.max(1.0);
    let one = |(s, &variance): (&Stratum, &f64)| match s.sample.len() < s.of {
        true => (freedom(s) * variance + common) / (freedom(s) + 1.0),
        false => variance,
    };
    strata.iter().zip(variances).map(one).collect()
}

/// The factor from a standard error to the half width of an interval.
pub fn width(confidence: f64, degrees: f64) -> f64 {
    WIDER * student(confidence, degrees)
}

/// Student's t that a value exceeds in either direction with probability `1 - confidence`.
pub fn student(confidence: f64, degrees: f64) -> f64 {
    let degrees = degrees.clamp(1.0, 1e5);
    let x = puruspe::invbetai(1.0 - confidence, degrees / 2.0, 0.5);
    (degrees * (1.0 - x) / x).sqrt()
}

/// The value below which a chi-square variable is with this probability.
pub fn chi_square(probability: f64, degrees: f64) -> f64 {
    2.0 * puruspe::invgammp(probability, degrees.clamp(1.0, 1e5) / 2.0)
}

/// The estimated ratio with its interval: on its logarithm, so that both ends are positive, or Fieller's where the
/// denominator varies.
pub fn figure(strata: &[Stratum], confidence: f64) -> Figure {
    let found = estimate(strata);
    if found.n >= found.of {
        return Figure::exact(found.ratio);
    }
    let t = width(confidence, found.degrees);
    let (method, low, high) = match fieller(strata, &found, t) {
        Some([low, high]) => ("stratified ratio, Fieller's interval", low, high),
        None if found.ratio > 0.0 => {
            let factor = (t * found.error / found.ratio).exp();
            (
                "stratified ratio, logarithmic interval",
                found.ratio / factor,
                found.ratio * factor,
            )
        }
        None => {
            let half = t * found.error;
            ("stratified ratio", found.ratio - half, found.ratio + half)
        }
    };
    Figure {
        value: found.ratio,
        low,
        high,
        confidence: Some(confidence),
        because: Because::Sampling {
            method,
            n: found.n,
            of: found.of,
            degrees_of_freedom: (found.degrees.min(1e6) * 10.0).round() / 10.0,
        },
    }
}

/// Fieller's interval, if the denominator's total varies enough and differs from zero.
fn fieller(strata: &[Stratum], found: &Estimate, t: f64) -> Option<[f64; 2]> {
    let sum = |part_a: usize, part_b: usize| {
        let of = |s: &Stratum| s.factor() * s.covariance(|pair| pair[part_a], |pair| pair[part_b]);
        strata.iter().map(of).sum::<f64>()
    };
    let b = found.denominator;
    let v_b = sum(1, 1);
    if v_b.sqrt() <= VARYING * b {
        return None;
    }
    let a = found.ratio * b;
    let square = b * b - t * t * v_b;
    let middle = a * b - t * t * sum(0, 1);
    let root = (middle * middle - square * (a * a - t * t * sum(0, 0)))
        .max(0.0)
        .sqrt();
    (square > 0.0).then(|| [(middle - root) / square, (middle + root) / square])
}
