//! Distance of a machine from the Z2 paper's Table 2 on a scene: levels, savings and slopes.

use super::z2::{self, PublishedRow};
use crate::config::Order;
use serde::Serialize;
use std::sync::LazyLock;

/// A row of Table 2 measured on a machine, with rates counted as in the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// L1 and L2 size in KiB.
    pub caches_kib: (u32, u32),
    /// Order.
    pub order: Order,
    /// L1 miss rate, percent.
    pub l1_footprint_miss_pct: f64,
    /// L2 miss rate, percent.
    pub l2_line_miss_pct: f64,
    /// TMU utilisation, percent; none without a texture unit.
    pub tmu_util_pct: Option<f64>,
}

/// Root mean square distances from the paper's rows of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Score {
    /// L1 miss rates, in points.
    pub l1_points: f64,
    /// L2 miss rates, in points.
    pub l2_points: f64,
    /// Utilisations, in points; none without a texture unit.
    pub tmu_points: Option<f64>,
    /// Savings relative to Morton order that follow from both rates, in points.
    pub saved_points: f64,
    /// Slopes of the L1 miss rate over the product of both rates, by L1 size.
    pub slope: f64,
    /// Combination of all parts, each divided by its standard deviation in the paper's table: at 1, the
    /// distance equals the spread of the table's rows.
    pub total: f64,
}

/// The compared quantities, by row and by L1 size.
struct ScoreParts {
    /// L1, L2 and TMU of each row, and its saving relative to Morton order, which has none itself.
    rows: Vec<[Option<f64>; 4]>,
    slopes: Vec<f64>,
}

impl ScoreParts {
    fn of(rows: &[Measured]) -> Self {
        let product = |row: &Measured| row.l1_footprint_miss_pct * row.l2_line_miss_pct;
        let saved = |row: &Measured| {
            let of_caches = |other: &&Measured| {
                other.caches_kib == row.caches_kib && other.order == Order::MORTON
            };
            let morton = rows
                .iter()
                .find(of_caches)
                .filter(|m| m.order != row.order)?;
            (product(morton) > 0.0).then(|| 100.0 * (1.0 - product(row) / product(morton)))
        };
        let mut l1_sizes: Vec<u32> = rows.iter().map(|row| row.caches_kib.0).collect();
        l1_sizes.sort_unstable();
        l1_sizes.dedup();
        let slope = |&l1_kib: &u32| {
            let of_size = rows.iter().filter(|row| row.caches_kib.0 == l1_kib);
            let points: Vec<(f64, f64)> = of_size
                .map(|row| (product(row) / 100.0, row.l1_footprint_miss_pct))
                .collect();
            slope(&points)
        };
        Self {
            rows: rows
                .iter()
                .map(|row| {
                    let rates = [row.l1_footprint_miss_pct, row.l2_line_miss_pct].map(Some);
                    [rates[0], rates[1], row.tmu_util_pct, saved(row)]
                })
                .collect(),
            slopes: l1_sizes.iter().map(slope).collect(),
        }
    }

    /// Lists of L1, L2, TMU, saving and slope.
    fn lists(&self) -> [Vec<f64>; 5] {
        let part = |i: usize| self.rows.iter().filter_map(|row| row[i]).collect();
        [part(0), part(1), part(2), part(3), self.slopes.clone()]
    }
}

/// Least-squares slope through points; 0 if all x are equal.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len().max(1) as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (mut xx, mut xy) = (0.0, 0.0);
    for point in points {
        xx += (point.0 - x).powi(2);
        xy += (point.0 - x) * (point.1 - y);
    }
    if xx > 0.0 { xy / xx } else { 0.0 }
}

fn published(row: &PublishedRow) -> Measured {
    Measured {
        caches_kib: (row.l1_kib, row.l2_kib),
        order: row.order,
        l1_footprint_miss_pct: row.l1_footprint_miss_pct,
        l2_line_miss_pct: row.l2_line_miss_pct,
        tmu_util_pct: Some(row.tmu_util_pct),
    }
}

fn scene_rows(scene: &str) -> Vec<Measured> {
    let rows = z2::table().iter().filter(|row| row.scene == scene);
    rows.map(published).collect()
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, n), v| (sum + v * v, n + 1));
    (sum / count.max(1) as f64).sqrt()
}

/// Standard deviations of the parts over the whole table.
static SPREADS: LazyLock<[f64; 5]> = LazyLock::new(|| {
    let mut all: [Vec<f64>; 5] = Default::default();
    for scene in z2::SCENES {
        let lists = ScoreParts::of(&scene_rows(scene)).lists();
        for (all, mut list) in all.iter_mut().zip(lists) {
            all.append(&mut list);
        }
    }
    all.map(|values| {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        root_mean_square(values.iter().map(|v| v - mean))
    })
});

/// Compares a machine's rows of a scene with the paper's. None unless the rows have all of the paper's
/// caches and orders, each once.
pub fn score(scene: &str, rows: &[Measured]) -> Option<Score> {
    let expected = scene_rows(scene);
    let ours: Option<Vec<Measured>> = expected
        .iter()
        .map(|row| {
            let same = |r: &&Measured| (r.caches_kib, r.order) == (row.caches_kib, row.order);
            rows.iter().find(same).copied()
        })
        .collect();
    let ours = ours.filter(|ours| !ours.is_empty())?;
    let (ours, theirs) = (
        ScoreParts::of(&ours).lists(),
        ScoreParts::of(&expected).lists(),
    );
    // Parts that the rows lack are left out.
    let distance = |part: usize| {
        let (ours, theirs) = (&ours[part], &theirs[part]);
        let known = ours.len() == theirs.len();
        known.then(|| root_mean_square(ours.iter().zip(theirs).map(|(a, b)| a - b)))
    };
    let parts = [0, 1, 2, 3, 4].map(distance);
    let shares = parts
        .iter()
        .zip(SPREADS.iter())
        .filter_map(|(part, spread)| Some((*part)? / spread));
    let [l1_points, l2_points, tmu_points, saved_points, slope] = parts;
    Some(Score {
        l1_points: l1_points?,
        l2_points: l2_points?,
        tmu_points,
        saved_points: saved_points?,
        slope: slope?,
        total: root_mean_square(shares),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_own_rows_have_no_distance() {
        for scene in z2::SCENES {
            let none = Score {
                tmu_points: Some(0.0),
                ..Score::default()
            };
            assert_eq!(score(scene, &scene_rows(scene)), Some(none));
        }
    }

    #[test]
    fn every_part_measures_what_it_names() {
        let scene = "crytek-sponza";
        let changed = |change: fn(&mut Measured)| {
            let mut rows = scene_rows(scene);
            rows.iter_mut().for_each(change);
            score(scene, &rows).unwrap()
        };
        let tmu = changed(|row| row.tmu_util_pct = row.tmu_util_pct.map(|pct| pct + 2.0));
        assert!((tmu.tmu_points.unwrap() - 2.0).abs() < 1e-9 && tmu.l1_points == 0.0);
        assert!((tmu.total - (2.0 / SPREADS[2]) / 5_f64.sqrt()).abs() < 1e-9);
        // Twice the L1 rate leaves savings and slopes, which are ratios, unchanged.
        let twice = changed(|row| row.l1_footprint_miss_pct *= 2.0);
        assert!(twice.l1_points > 8.0 && twice.saved_points < 1e-9 && twice.slope < 1e-9);
        // Without a texture unit, its part is left out of the total as well.
        let none = changed(|row| {
            (row.tmu_util_pct, row.l1_footprint_miss_pct) = (None, row.l1_footprint_miss_pct + 1.0)
        });
        assert_eq!(none.tmu_points, None);
        assert!((none.l1_points - 1.0).abs() < 1e-9 && none.total > 0.0);
        // A constant L1 rate has slope zero.
        let flat = changed(|row| row.l1_footprint_miss_pct = 10.0);
        assert!(flat.slope > 0.4, "{flat:?}");
    }

    /// The table's slopes: T-Rex .58 to .63, Crytek 16 KB .62 to .70 and 8 KB .10 to .13.
    #[test]
    fn slopes_equal_those_of_the_table() {
        let slopes = |scene| ScoreParts::of(&scene_rows(scene)).slopes;
        let [small, large] = slopes("crytek-sponza")[..] else {
            panic!("two sizes")
        };
        assert!(
            (0.05..0.2).contains(&small) && (0.5..0.8).contains(&large),
            "{small} {large}"
        );
    }

    #[test]
    fn rows_that_lack_one_of_the_papers_have_no_score() {
        let mut rows = scene_rows("crytek-sponza");
        rows.pop();
        assert_eq!(score("crytek-sponza", &rows), None);
        assert_eq!(score("unknown", &rows), None);
    }
}
