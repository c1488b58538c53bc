//! Signed means of errors, which reveal small systematic errors.
//!
//! Each error has its own bound, from the arithmetic. For any weights, the weighted mean of the errors is
//! within the weighted mean of the bounds; with weights 1/bound², precise lanes count most.

use formats::textrace::Tables;
use serde::Serialize;
use std::collections::BTreeMap;

/// A weighted mean of errors and the bound of its magnitude.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// Number of errors.
    pub count: u64,
    weights: f64,
    errors: f64,
    bounds: f64,
}

impl Mean {
    /// Adds an error with the given bound; an error without a bound is ignored.
    pub fn add(&mut self, error: f64, bound: f64) {
        let weight = bound.powi(-2);
        if error.is_finite() && weight.is_finite() && weight > 0.0 {
            self.count += 1;
            self.weights += weight;
            self.errors += weight * error;
            self.bounds += weight * bound;
        }
    }

    /// Adds another mean whose errors and bounds are `scale` times as large in these units.
    fn merge(&mut self, other: &Self, scale: f64) {
        self.count += other.count;
        self.weights += other.weights / (scale * scale);
        self.errors += other.errors / scale;
        self.bounds += other.bounds / scale;
    }

    fn mean(&self) -> f64 {
        self.errors / self.weights
    }

    fn bound(&self) -> f64 {
        self.bounds / self.weights
    }
}

/// The quantities that means are computed of.
pub const COLUMNS: [&str; 8] = [
    "u",
    "v",
    "dx of u",
    "dx of v",
    "dy of u",
    "dy of v",
    "cross of u",
    "cross of v",
];

/// Means by draw and group, texels of the group.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Means(BTreeMap<(u32, u8), [Mean; COLUMNS.len()]>);

/// A mean that exceeds its bound, or the one closest to its bound.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Bias {
    /// The draw or the texture.
    pub of: String,
    /// The quantity.
    pub column: &'static str,
    /// Number of errors.
    pub count: u64,
    /// Weighted mean of captured minus true values.
    pub mean_texels: f64,
    /// Bound from the arithmetic.
    pub bound_texels: f64,
}

impl Bias {
    fn new(of: String, column: usize, mean: &Mean) -> Option<Self> {
        (mean.count > 0).then(|| Self {
            of,
            column: COLUMNS[column],
            count: mean.count,
            mean_texels: mean.mean(),
            bound_texels: mean.bound(),
        })
    }

    /// Mean divided by its bound.
    pub fn share(&self) -> f64 {
        self.mean_texels.abs() / self.bound_texels
    }

    /// Whether the mean exceeds its bound.
    pub fn is_systematic(&self) -> bool {
        self.share() > 1.0
    }
}

impl Means {
    /// The means of a draw's group.
    pub(super) fn of(&mut self, draw: u32, group: u8) -> &mut [Mean; COLUMNS.len()] {
        self.0.entry((draw, group)).or_default()
    }

    /// Adds the means of another tile or pass.
    pub fn merge(&mut self, other: &Self) {
        for (&(draw, group), means) in &other.0 {
            for (sum, mean) in self.of(draw, group).iter_mut().zip(means) {
                sum.merge(mean, 1.0);
            }
        }
    }

    /// Every mean by draw and group, then by texture.
    pub fn biases(&self, tables: &Tables) -> Vec<Bias> {
        let mut found = Vec::new();
        let mut of_texture = BTreeMap::<u32, [Mean; COLUMNS.len()]>::new();
        for (&(draw, group), means) in &self.0 {
            let entry = &tables.draws[draw as usize];
            let of = format!("draw {draw} ({}) group {group}", entry.material);
            let biases = means.iter().enumerate();
            found.extend(biases.filter_map(|(column, mean)| Bias::new(of.clone(), column, mean)));
            let Some(group) = entry.groups.get(usize::from(group)) else {
                continue;
            };
            for sample in &group.samples {
                let size = tables.textures[sample.texture as usize].size;
                let sums = of_texture.entry(sample.texture).or_default();
                for (column, (sum, mean)) in sums.iter_mut().zip(means).enumerate() {
                    let axis = column % 2;
                    sum.merge(mean, f64::from(size[axis]) / f64::from(group.extent[axis]));
                }
            }
        }
        for (texture, means) in &of_texture {
            let of = format!(
                "texture {texture} ({})",
                tables.textures[*texture as usize].name
            );
            let biases = means.iter().enumerate();
            found.extend(biases.filter_map(|(column, mean)| Bias::new(of.clone(), column, mean)));
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn well_known_errors_count_most_and_the_bound_holds_for_any() {
        let mut mean = Mean::default();
        mean.add(0.001, 0.002);
        mean.add(-5.0, 10.0);
        mean.add(f64::NAN, 1.0);
        mean.add(1.0, f64::INFINITY);
        assert_eq!(mean.count, 2);
        assert!((mean.mean() - 0.001).abs() < 1e-6, "{}", mean.mean());
        assert!((mean.bound() - 0.002).abs() < 1e-5, "{}", mean.bound());
        let mut doubled = Mean::default();
        doubled.merge(&mean, 2.0);
        assert!((doubled.mean() - 2.0 * mean.mean()).abs() < 1e-12);
        assert!((doubled.bound() - 2.0 * mean.bound()).abs() < 1e-12);
    }
}
