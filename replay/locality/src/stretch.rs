//! Misses at a picture size that was not captured, from the reuses at two smaller sizes.
//!
//! Both sizes have the reuses of a stream by class (same tile, another tile, the other eye, an earlier frame) and
//! distance. The ratio between the sizes at a quantile of a class leads on to the wanted size, as a power of the size.
//! Reuses in the same tile keep their distances. Ways follow Hill and Smith (1989): the lines between two uses fall into
//! the sets evenly, so a set receives a Poisson number of them.

use crate::figures::Figures;
use crate::place::Origin;
use std::collections::BTreeMap;

/// Width of a bin of distances: a factor of 2^(1/16).
const BINS_PER_DOUBLING: f64 = 16.0;

/// Reuses at a distance, in lines.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reuse {
    distance: f64,
    count: f64,
}

/// First uses and reuses of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Reuses {
    first_uses: f64,
    /// By class, ascending by distance.
    of: [Vec<Reuse>; Origin::ALL.len()],
}

/// Number of a distance's bin: 0 for distance 0.
fn bin(distance: u64) -> u32 {
    match distance {
        0 => 0,
        _ => 1 + (BINS_PER_DOUBLING * (distance as f64).log2()).floor() as u32,
    }
}

/// The distance in the middle of a bin, on a logarithmic scale.
fn middle(bin: u32) -> f64 {
    match bin {
        0 => 0.0,
        _ => ((f64::from(bin) - 0.5) / BINS_PER_DOUBLING).exp2(),
    }
}

fn total(reuses: &[Reuse]) -> f64 {
    reuses.iter().map(|reuse| reuse.count).sum()
}

/// Each reuse with the quantile in its middle.
fn quantiles(reuses: &[Reuse]) -> impl Iterator<Item = (f64, Reuse)> {
    let all = total(reuses);
    reuses.iter().scan(0.0, move |below, reuse| {
        let quantile = (*below + reuse.count / 2.0) / all;
        *below += reuse.count;
        Some((quantile, *reuse))
    })
}

/// Lines that a cache needs for the reuses at a quantile, on a logarithmic scale between two distances.
fn lines_at(reuses: &[Reuse], quantile: f64) -> f64 {
    let mut below: Option<(f64, f64)> = None;
    for (at, reuse) in quantiles(reuses) {
        let above = (at, reuse.distance + 1.0);
        let before = below.unwrap_or(above);
        if quantile <= above.0 {
            let part = match above.0 > before.0 {
                true => (quantile - before.0) / (above.0 - before.0),
                false => 0.0,
            };
            return before.1.powf(1.0 - part) * above.1.powf(part);
        }
        below = Some(above);
    }
    below.map_or(1.0, |(_, lines)| lines)
}

/// Probability that fewer than `ways` lines fall into a set that receives `mean` of them.
fn hit(mean: f64, ways: u32) -> f64 {
    // Beyond the ways by so much, no set has room, and the first term would be too small to be represented.
    if mean > 2.0 * f64::from(ways) + 40.0 {
        return 0.0;
    }
    let first = (-mean).exp();
    let terms = (1..ways).scan(first, |term, number| {
        *term *= mean / f64::from(number);
        Some(*term)
    });
    (first + terms.sum::<f64>()).min(1.0)
}

impl Reuses {
    /// The reuses of a stream.
    pub fn new(figures: &Figures) -> Self {
        let mut bins = [const { BTreeMap::<u32, u64>::new() }; Origin::ALL.len()];
        for (distance, counts) in figures.distances.iter() {
            for (of, count) in bins.iter_mut().zip(counts).filter(|(_, count)| **count > 0) {
                *of.entry(bin(distance)).or_default() += count;
            }
        }
        let reuses = |of: BTreeMap<u32, u64>| {
            let reuse = |(place, count)| Reuse {
                distance: middle(place),
                count: count as f64,
            };
            of.into_iter().map(reuse).collect()
        };
        Self {
            first_uses: figures.unique_lines as f64,
            of: bins.map(reuses),
        }
    }

    /// Distinct lines.
    pub fn lines(&self) -> f64 {
        self.first_uses
    }

    /// The reuses at a larger size. `smaller` is the same stream at a smaller size, where a side is `step` times shorter.
    /// Lines and counts grow by the `power`-th power of their growth from there to here.
    #[must_use]
    pub fn stretched(&self, smaller: &Self, step: f64, power: f64) -> Self {
        // A picture has at most as many more lines as it has more pixels, and no fewer.
        let most = step * step;
        let of = Origin::ALL.map(|origin| {
            let (own, other) = (&self.of[origin.index()], &smaller.of[origin.index()]);
            let other = if other.is_empty() { own } else { other };
            let growth_of_count = (total(own) / total(other)).powf(power);
            let reuse = |(quantile, reuse): (f64, Reuse)| {
                let lines = reuse.distance + 1.0;
                let ratio = match origin {
                    Origin::SameTile => 1.0,
                    _ => (lines / lines_at(other, quantile)).clamp(1.0, most),
                };
                Reuse {
                    distance: lines * ratio.powf(power) - 1.0,
                    count: reuse.count * growth_of_count,
                }
            };
            quantiles(own).map(reuse).collect()
        });
        let ratio = self.first_uses / smaller.first_uses.max(1.0);
        Self {
            first_uses: self.first_uses * ratio.powf(power),
            of,
        }
    }

    /// Misses of an LRU cache of this geometry.
    pub fn misses(&self, sets: f64, ways: u32) -> f64 {
        let reuses = self.of.iter().flatten();
        let missing = reuses.map(|reuse| reuse.count * (1.0 - hit(reuse.distance / sets, ways)));
        self.first_uses + missing.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distances::Distances;

    /// A stream whose reuses of each class have one distance.
    fn stream(first_uses: u64, of: [(u32, u64); 4]) -> Reuses {
        let mut distances = Distances::default();
        for (origin, (distance, times)) in of.into_iter().enumerate() {
            distances.count(distance, origin, times);
        }
        Reuses::new(&Figures {
            unique_lines: first_uses,
            distances,
            ..Figures::default()
        })
    }

    #[test]
    fn lines_and_counts_go_on_as_a_power_of_the_size() {
        let small = stream(100, [(10, 1000), (64, 500), (256, 300), (0, 0)]);
        let larger = stream(300, [(10, 4000), (128, 2000), (1024, 900), (0, 0)]);
        let other_tile = Origin::OtherTile.index();
        let same_tile = Origin::SameTile.index();
        for doublings in [0.0, 1.0, 2.0] {
            let at = larger.stretched(&small, 2.0, doublings);
            assert!((at.first_uses / (300.0 * 3_f64.powf(doublings)) - 1.0).abs() < 1e-9);
            let [own] = at.of[other_tile][..] else {
                panic!("one distance");
            };
            let lines = |distance| middle(bin(distance)) + 1.0;
            let expected = lines(128) * (lines(128) / lines(64)).powf(doublings);
            assert!((own.distance + 1.0 - expected).abs() < 1e-6, "{doublings}");
            assert!((own.count / (2000.0 * 4_f64.powf(doublings)) - 1.0).abs() < 1e-9);
            let kept = at.of[same_tile][0].distance;
            assert!((kept - larger.of[same_tile][0].distance).abs() < 1e-9);
        }
    }

    #[test]
    fn sets_receive_a_poisson_number_of_lines() {
        // Lines that fall into sets one by one at random: the binomial distribution, which Poisson's is the limit of.
        let (lines, sets) = (4000_u32, 1000_f64);
        for ways in [1, 4, 8, 16] {
            let mut term = (f64::from(lines) * (1.0 - 1.0 / sets).ln()).exp();
            let mut binomial = term;
            for number in 1..ways {
                term *= f64::from(lines - number + 1) / f64::from(number) / (sets - 1.0);
                binomial += term;
            }
            let poisson = hit(f64::from(lines) / sets, ways);
            assert!(
                (poisson - binomial).abs() < 1e-3,
                "{ways}: {poisson} {binomial}"
            );
        }
        assert!(hit(1e6, 16) == 0.0 && hit(0.0, 1) == 1.0);
    }

    #[test]
    fn one_set_of_many_ways_is_fully_associative() {
        let reuses = stream(7, [(0, 1), (20, 5), (40, 11), (4000, 13)]);
        // A distance of 20 lines leaves room in 60 ways nearly always, one of 4000 never.
        let misses = reuses.misses(1.0, 100);
        assert!((misses - (7.0 + 13.0)).abs() < 1e-3, "{misses}");
    }
}
