//! How many frames of each stratum are captured: a pilot, and one last stage.
//!
//! The pilot estimates deviations; the last stage has the frames that the promise needs if the deviations are as large
//! as the pilot's upper 80 % limit (Stein 1945, Cox 1952). Nothing is decided between the two.

use super::estimate::{Estimate, chi_square, width};
use super::strata::Block;
use formats::random::Random;

/// Least frames of a pilot.
const PILOT: usize = 10;
/// Probability with which true deviations are below the limit that the last stage assumes.
const LIMIT: f64 = 0.8;

/// The frames of each stratum in the sequence in which they are captured, from a seed.
pub fn draw(strata: &[Block], seed: u64) -> Vec<Vec<usize>> {
    let mut random = Random(seed);
    let shuffled = |block: &Block| {
        let mut frames = block.frames.clone();
        for at in 0..frames.len() {
            let with = at + (random.bits() % (frames.len() - at) as u64) as usize;
            frames.swap(at, with);
        }
        frames
    };
    strata.iter().map(shuffled).collect()
}

/// Frames of each stratum in the pilot: all of a stratum that is captured as a whole, otherwise at least two.
pub fn pilot(strata: &[Block]) -> Vec<usize> {
    let sampled: usize = (strata.iter())
        .filter(|s| !s.all)
        .map(|s| s.frames.len())
        .sum();
    let least = |block: &Block| match block.all {
        true => block.frames.len(),
        false => {
            let share = PILOT as f64 * block.frames.len() as f64 / sampled as f64;
            (share.ceil() as usize).clamp(2, block.frames.len())
        }
    };
    strata.iter().map(least).collect()
}

/// What a promise demands of a figure.
#[derive(Clone, Debug)]
pub struct Demand {
    /// The pilot's estimate.
    pub estimate: Estimate,
    /// Largest half width of the interval, in the unit of the ratio.
    pub half: f64,
    /// Confidence of the interval.
    pub confidence: f64,
}

/// Frames of each stratum after the last stage, so that every demand is met.
pub fn last(strata: &[Block], pilot: &[usize], demands: &[Demand]) -> Vec<usize> {
    let mut sizes = pilot.to_vec();
    for demand in demands {
        let needed = needed(strata, pilot, demand);
        for (size, needed) in sizes.iter_mut().zip(needed) {
            *size = (*size).max(needed);
        }
    }
    sizes
}

/// Standard error of the total of residuals with these variances in a sample of these sizes.
pub fn error_of(strata: &[Block], variances: &[f64], sizes: &[usize]) -> f64 {
    let part = |(h, block): (usize, &Block)| {
        let (of, n) = (block.frames.len() as f64, sizes[h].max(1) as f64);
        of * (of - n) / n * variances[h]
    };
    strata
        .iter()
        .enumerate()
        .map(part)
        .sum::<f64>()
        .max(0.0)
        .sqrt()
}

/// Fewest frames with a standard error of at most `error`, if the variances are known: two of each stratum, all of
/// those that are captured as a whole, and the rest by Neyman's allocation.
pub fn fewest(strata: &[Block], variances: &[f64], error: f64) -> usize {
    let least = |block: &Block| match block.all {
        true => block.frames.len(),
        false => block.frames.len().min(2),
    };
    let least: Vec<usize> = strata.iter().map(least).collect();
    let whole: usize = strata.iter().map(|block| block.frames.len()).sum();
    let enough =
        |&n: &usize| error_of(strata, variances, &neyman(strata, &least, variances, n)) <= error;
    (least.iter().sum()..whole).find(enough).unwrap_or(whole)
}

fn needed(strata: &[Block], pilot: &[usize], demand: &Demand) -> Vec<usize> {
    let of: Vec<f64> = strata
        .iter()
        .map(|block| block.frames.len() as f64)
        .collect();
    let Estimate {
        denominator,
        degrees,
        variances,
        ..
    } = &demand.estimate;
    if degrees.is_infinite() {
        return pilot.to_vec();
    }
    let inflated = degrees.max(1.0) / chi_square(1.0 - LIMIT, *degrees);
    let whole: usize = strata.iter().map(|block| block.frames.len()).sum();
    let mut sizes = pilot.to_vec();
    for n in pilot.iter().sum::<usize>()..=whole {
        sizes = neyman(strata, pilot, variances, n);
        let part =
            |h: usize| of[h] * (of[h] - sizes[h] as f64) / sizes[h].max(1) as f64 * variances[h];
        let parts: Vec<f64> = (0..of.len()).map(part).collect();
        let variance: f64 = parts.iter().sum();
        let square = |(part, &n): (&f64, &usize)| part * part / (n.max(2) - 1) as f64;
        let squares: f64 = parts.iter().zip(&sizes).map(square).sum();
        if squares == 0.0 {
            break;
        }
        let t = width(demand.confidence, variance * variance / squares);
        if t * (inflated * variance).sqrt() / denominator.abs() <= demand.half {
            break;
        }
    }
    sizes
}

/// `n` frames in proportion to size and deviation of each stratum, at least those of the pilot, at most all.
fn neyman(strata: &[Block], pilot: &[usize], variances: &[f64], n: usize) -> Vec<usize> {
    let weight = |h: usize| strata[h].frames.len() as f64 * variances[h].sqrt();
    let mut sizes = pilot.to_vec();
    while sizes.iter().sum::<usize>() < n {
        // The stratum that is farthest below its share gets the next frame.
        let open = (0..sizes.len()).filter(|&h| sizes[h] < strata[h].frames.len());
        let lack = |h: &usize| weight(*h) / sizes[*h] as f64;
        let Some(next) = open.max_by(|a, b| lack(a).total_cmp(&lack(b)).then(b.cmp(a))) else {
            break;
        };
        sizes[next] += 1;
    }
    sizes
}
