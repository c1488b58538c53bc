//! The distribution of a difference: mean, 99th percentile, maximum.

use serde::{Serialize, Serializer};
use std::collections::BTreeMap;

/// Differences in whole steps. Mean and maximum are exact; percentiles beyond [`EXACT_STEPS`] are rounded
/// up by less than 1/64.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Differences {
    steps_per_unit: u32,
    count: u64,
    sum: u128,
    largest: u64,
    /// Number of non-zero differences, by the upper bound of their bin in steps.
    bins: BTreeMap<u64, u64>,
}

/// Differences up to this one have their own bins.
const EXACT_STEPS: u64 = 1 << 13;

/// Significant bits of larger bins.
const BITS: u32 = 7;

/// The bin of a difference: the largest value in it.
fn bin(steps: u64) -> u64 {
    if steps <= EXACT_STEPS {
        return steps;
    }
    let dropped = (u64::BITS - steps.leading_zeros()) - BITS;
    steps | ((1 << dropped) - 1)
}

impl Differences {
    /// An empty distribution with this many steps per unit.
    pub fn new(steps_per_unit: u32) -> Self {
        Self {
            steps_per_unit,
            count: 0,
            sum: 0,
            largest: 0,
            bins: BTreeMap::new(),
        }
    }

    /// Adds a difference `times` times.
    #[inline]
    pub fn record(&mut self, steps: u64, times: u64) {
        self.count += times;
        if steps > 0 {
            self.sum += u128::from(steps) * u128::from(times);
            self.largest = self.largest.max(steps);
            *self.bins.entry(bin(steps)).or_insert(0) += times;
        }
    }

    /// Adds another distribution.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, count, sum);
        self.largest = self.largest.max(other.largest);
        for (bin, count) in &other.bins {
            *self.bins.entry(*bin).or_insert(0) += count;
        }
    }

    /// Number of differences.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mean, in units.
    pub fn mean(&self) -> f64 {
        self.units(self.sum as f64 / self.count.max(1) as f64)
    }

    /// Maximum, in units.
    pub fn largest(&self) -> f64 {
        self.units(self.largest as f64)
    }

    /// The smallest value that this percentage of differences does not exceed, in units.
    pub fn percentile(&self, percent: f64) -> f64 {
        let wanted = (self.count as f64 * percent / 100.0).ceil() as u64;
        let not_zero: u64 = self.bins.values().sum();
        let mut below = self.count - not_zero;
        if below >= wanted {
            return 0.0;
        }
        for (bin, count) in &self.bins {
            below += count;
            if below >= wanted {
                return self.units((*bin).min(self.largest) as f64);
            }
        }
        self.largest()
    }

    fn units(&self, steps: f64) -> f64 {
        steps / f64::from(self.steps_per_unit)
    }
}

/// What JSON has of the differences.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub(crate) struct Summary {
    /// Number of values compared.
    compared: u64,
    /// Mean difference.
    mean: f64,
    /// 99th percentile of the differences.
    percentile_99: f64,
    /// Largest difference.
    largest: f64,
}

impl Serialize for Differences {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Summary {
            compared: self.count,
            mean: self.mean(),
            percentile_99: self.percentile(99.0),
            largest: self.largest(),
        }
        .serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn an_empty_distribution_has_no_difference() {
        let spread = Differences::new(4);
        assert_eq!(
            (spread.mean(), spread.percentile(99.0), spread.largest()),
            (0.0, 0.0, 0.0)
        );
    }

    proptest! {
        #[test]
        fn a_spread_equals_that_of_the_sorted_list(
            values in prop::collection::vec(prop_oneof![Just(0_u64), 1_u64..9000, 1_u64..1 << 40], 1..300),
        ) {
            let (mut spread, mut other) = (Differences::new(8), Differences::new(8));
            for (index, &value) in values.iter().enumerate() {
                [&mut spread, &mut other][index % 2].record(value, 1);
            }
            spread.add(&other);
            let mut sorted = values.clone();
            sorted.sort_unstable();
            let mean = values.iter().map(|&v| v as f64).sum::<f64>() / values.len() as f64;
            prop_assert!((spread.mean() * 8.0 - mean).abs() <= 1e-9 * mean);
            prop_assert_eq!(spread.largest() * 8.0, *sorted.last().unwrap() as f64);
            for percent in [1.0, 50.0, 99.0, 100.0] {
                let rank = (values.len() as f64 * percent / 100.0).ceil() as usize;
                let exact = sorted[rank.max(1) - 1] as f64;
                let found = spread.percentile(percent) * 8.0;
                prop_assert!(found >= exact && found <= exact * (1.0 + 1.0 / 64.0), "{} {}", found, exact);
            }
        }
    }
}
