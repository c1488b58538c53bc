//! Estimates of external traffic from some sets or some tiles, and how often their intervals hold
//! the truth.

use super::clusters::{Counts, counts};
use crate::config::{Order, RunConfig};
use crate::engine::ReplayError;
use crate::stream::TileSource;
use std::time::Instant;

/// Samples that are drawn of each kind, to see how often their intervals hold the truth.
const DRAWS: u64 = 400;

/// What is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampled {
    /// Cache sets: exact for what they hold.
    Sets,
    /// Tiles of the order: what lies between them is not replayed, so caches are colder.
    Tiles,
}

/// How a kind of sample does.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// What is sampled.
    pub of: Sampled,
    /// One of so many is replayed.
    pub one_in: u64,
    /// Root mean square error of external bytes, percent.
    pub error_pct: f64,
    /// Mean error: what no larger sample takes away, percent.
    pub bias_pct: f64,
    /// Mean half width of the 95 % interval, percent.
    pub interval_pct: f64,
    /// Intervals that hold the truth, percent; 95 are promised.
    pub holds_pct: f64,
    /// Time of a sample over that of the whole; none where a sample is taken from what was counted.
    pub time_ratio: Option<f64>,
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// So many of the first `of` numbers, each set as likely.
    fn some(&mut self, count: usize, of: usize) -> Vec<usize> {
        let mut all: Vec<usize> = (0..of).collect();
        for at in 0..count.min(of) {
            let with = at + (self.next() % (of - at) as u64) as usize;
            all.swap(at, with);
        }
        all.truncate(count);
        all
    }
}

/// Mean of a sample and half the width of its 95 % interval, as textbooks have them: normal, with
/// the correction for a finite whole.
fn interval(sample: &[f64], whole: usize) -> (f64, f64) {
    let count = sample.len() as f64;
    let mean = sample.iter().sum::<f64>() / count;
    let squares = sample.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    let variance = squares / (count - 1.0).max(1.0);
    let left = 1.0 - count / whole as f64;
    (mean, 1.96 * (variance / count * left).sqrt())
}

/// Sums up draws of (estimate, half width) against the truth.
fn judged(of: Sampled, one_in: u64, truth: f64, draws: &[(f64, f64)]) -> Estimate {
    let count = draws.len().max(1) as f64;
    let percent = |value: f64| 100.0 * value / truth.max(1.0);
    let errors = draws.iter().map(|(mean, _)| mean - truth);
    let squares = errors.clone().map(|e| e * e).sum::<f64>();
    let holds = draws
        .iter()
        .filter(|(mean, half)| (mean - truth).abs() <= *half);
    Estimate {
        of,
        one_in,
        error_pct: percent((squares / count).sqrt()),
        bias_pct: percent(errors.sum::<f64>() / count),
        interval_pct: percent(draws.iter().map(|(_, half)| half).sum::<f64>() / count),
        holds_pct: 100.0 * holds.count() as f64 / count,
        time_ratio: None,
    }
}

/// Samples of sets are drawn from one replay that counts by set, which gives what a replay of
/// these sets alone would.
fn of_sets(by_cluster: &[u64], one_in: u64) -> Estimate {
    let count = (by_cluster.len() / one_in as usize).max(2);
    let whole = by_cluster.len();
    let truth = by_cluster.iter().sum::<u64>() as f64;
    let draw = |seed: u64| {
        let chosen = Random(seed).some(count, whole);
        let sample: Vec<f64> = chosen.iter().map(|&at| by_cluster[at] as f64).collect();
        let (mean, half) = interval(&sample, whole);
        (mean * whole as f64, half * whole as f64)
    };
    let draws: Vec<(f64, f64)> = (0..DRAWS).map(draw).collect();
    judged(Sampled::Sets, one_in, truth, &draws)
}

/// Every so many tiles of the order, from each first one: a ratio of misses to footprints, scaled up
/// by all footprints.
fn of_tiles(
    trace: &dyn TileSource,
    config: &RunConfig,
    order: Order,
    whole: &Counts,
    one_in: u64,
) -> Result<Estimate, ReplayError> {
    /// First tiles that are tried at most: each is a replay.
    const STARTS: u64 = 8;
    let (truth, footprints) =
        (whole.by_tile.iter()).fold((0, 0), |(m, f), tile| (m + tile.0, f + tile.1));
    let busy = whole.by_tile.iter().filter(|tile| tile.1 > 0).count();
    let mut draws = Vec::new();
    for start in 0..one_in.min(STARTS) {
        let chosen = |item: usize| item as u64 % one_in == start;
        let found = counts(trace, config, order, &chosen)?;
        let tiles: Vec<(f64, f64)> = (found.by_tile.iter())
            .filter(|tile| tile.1 > 0)
            .map(|tile| (tile.0 as f64, tile.1 as f64))
            .collect();
        let sums = tiles.iter().fold((0.0, 0.0), |s, t| (s.0 + t.0, s.1 + t.1));
        let ratio = sums.0 / f64::max(sums.1, 1.0);
        // The ratio estimator's residuals.
        let residuals: Vec<f64> = tiles.iter().map(|t| t.0 - ratio * t.1).collect();
        if residuals.len() < 2 {
            continue;
        }
        let (_, half) = interval(&residuals, busy);
        let per_tile = sums.1 / tiles.len() as f64;
        draws.push((
            ratio * footprints as f64,
            half / per_tile * footprints as f64,
        ));
    }
    Ok(judged(Sampled::Tiles, one_in, truth as f64, &draws))
}

/// Samples one in four, eight and sixteen of the sets and of the tiles of a trace's first frame.
///
/// # Errors
/// An impossible configuration, a trace that cannot be read.
pub fn sampled(
    trace: &dyn TileSource,
    config: &RunConfig,
    order: Order,
) -> Result<Vec<Estimate>, ReplayError> {
    let start = Instant::now();
    let whole = counts(trace, config, order, &|_| true)?;
    let whole_time = start.elapsed();
    let mut estimates = Vec::new();
    for one_in in [4, 8, 16] {
        estimates.push(of_sets(&whole.by_cluster, one_in));
    }
    for one_in in [4, 8, 16] {
        let start = Instant::now();
        let mut estimate = of_tiles(trace, config, order, &whole, one_in)?;
        let replays = one_in.min(8) as f64;
        let ratio = start.elapsed().as_secs_f64() / replays / whole_time.as_secs_f64().max(1e-9);
        estimate.time_ratio = Some(ratio);
        estimates.push(estimate);
    }
    Ok(estimates)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sets that miss alike but for noise: intervals hold the truth about as often as they promise.
    #[test]
    fn intervals_hold_where_sets_are_alike_and_lie_where_few_sets_have_it_all() {
        let mut random = Random(5);
        let alike: Vec<u64> = (0..128).map(|_| 1000 + random.next() % 200).collect();
        let good = of_sets(&alike, 8);
        assert!(good.holds_pct > 88.0 && good.holds_pct < 99.0, "{good:?}");
        assert!(
            good.error_pct < 3.0 && good.bias_pct.abs() < 1.0,
            "{good:?}"
        );
        let mut few = vec![10; 128];
        few[7] = 100_000;
        let bad = of_sets(&few, 8);
        assert!(bad.holds_pct < 50.0, "{bad:?}");
    }

    #[test]
    fn a_sample_of_everything_is_the_truth() {
        let counts = [5, 9, 1, 40];
        let all = of_sets(&counts, 1);
        assert_eq!(
            (all.error_pct, all.interval_pct, all.holds_pct),
            (0.0, 0.0, 100.0)
        );
    }

    #[test]
    fn draws_are_without_repetition() {
        for seed in 0..50 {
            let mut chosen = Random(seed).some(20, 32);
            chosen.sort_unstable();
            chosen.dedup();
            assert_eq!(chosen.len(), 20);
        }
    }
}
