//! Published figures, to be set beside measured ones.
//!
//! - Z2: Nah, Lim, Ki, Shin, "Z2 traversal order: An interleaving approach for VR stereo rendering
//!   on tile-based GPUs", Computational Visual Media 3(4), 2017. Table 2 is `data/z2-table2.csv`.
//! - SGRT: Lee, Hwang, Shin, Yoo, Ryu, "Fast Stereoscopic Rendering on Mobile Ray Tracing GPU for
//!   Virtual Reality Applications", 2017. Figures 1 and 3, section IV.

use crate::config::Order;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// One row of the Z2 paper's Table 2: a scene, a cache configuration, an order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Z2Row {
    /// Scene, as in [`Z2_SCENES`].
    pub scene: String,
    /// L1 size in KiB.
    pub l1_kib: u32,
    /// L2 size in KiB.
    pub l2_kib: u32,
    /// Order.
    pub order: Order,
    /// L1 miss rate, percent of footprints.
    pub l1_miss_pct: f64,
    /// L2 miss rate, percent of L2 look-ups.
    pub l2_miss_pct: f64,
    /// TMU utilisation, percent.
    pub tmu_util_pct: f64,
}

impl Z2Row {
    /// External traffic in lines per footprint (L1 times L2 miss rate): Fig. 5 but for the scale,
    /// which the paper's text does not give as numbers.
    #[must_use]
    pub fn external_lines_per_footprint(&self) -> f64 {
        self.l1_miss_pct * self.l2_miss_pct / 1e4
    }
}

/// The Z2 paper's scenes, as its tables order them.
pub const Z2_SCENES: [&str; 4] = [
    "gfxbench-t-rex",
    "crytek-sponza",
    "l-bench-sponza-no-shadows",
    "l-bench-sponza-shadows",
];

/// The Z2 paper's cache configurations: L1 and L2 size in KiB, in the order of its Table 2.
pub const Z2_CACHES_KIB: [(u32, u32); 4] = [(8, 128), (16, 128), (8, 256), (16, 256)];

/// The orders that the Z2 paper compares.
pub const Z2_ORDERS: [Order; 3] = [Order::MORTON, Order::Z2_LRTA, Order::Z2_STA];

static Z2_TABLE: LazyLock<Vec<Z2Row>> =
    LazyLock::new(|| parse_table(include_str!("../data/z2-table2.csv")));

/// The Z2 paper's Table 2.
#[must_use]
pub fn z2_table() -> &'static [Z2Row] {
    &Z2_TABLE
}

/// The row of Table 2 for a scene, a cache configuration and an order, if it has one.
#[must_use]
pub fn z2_row(scene: &str, l1_kib: u32, l2_kib: u32, order: Order) -> Option<&'static Z2Row> {
    z2_table()
        .iter()
        .find(|r| r.scene == scene && r.l1_kib == l1_kib && r.l2_kib == l2_kib && r.order == order)
}

/// Lines that do not parse are left out; a test holds that there are none.
fn parse_table(csv: &str) -> Vec<Z2Row> {
    csv.lines()
        .skip(1)
        .filter_map(|line| {
            let mut cells = line.split(',');
            let mut next = || cells.next();
            Some(Z2Row {
                scene: next()?.to_owned(),
                l1_kib: next()?.parse().ok()?,
                l2_kib: next()?.parse().ok()?,
                order: next().and_then(Order::find)?,
                l1_miss_pct: next()?.parse().ok()?,
                l2_miss_pct: next()?.parse().ok()?,
                tmu_util_pct: next()?.parse().ok()?,
            })
        })
        .collect()
}

/// The scene of the Z2 paper that a scene stands for, by name and by whether it samples shadow
/// maps: the built-in scenes were made for it, the real ones are the same models or alike.
#[must_use]
pub fn z2_twin(scene: &str, shadow_maps: bool) -> Option<&'static str> {
    let name = scene.to_ascii_lowercase();
    let [t_rex, crytek, plain, shadows] = Z2_SCENES;
    if name.contains("jungle") || name.contains("cocoa") {
        Some(t_rex)
    } else if name.contains("atrium-shadows") {
        Some(shadows)
    } else if name.contains("atrium-plain") || name.contains("dabrovic") {
        Some(if shadow_maps { shadows } else { plain })
    } else if (name.contains("atrium") || name.contains("crytek")) && !shadow_maps {
        Some(crytek)
    } else {
        None
    }
}

/// One scene of the SGRT paper: section IV and Figure 3.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SgrtRow {
    /// Scene as the paper names it.
    pub scene: &'static str,
    /// Built-in scene that stands for it.
    pub stand_in: &'static str,
    /// Triangles, thousands.
    pub triangles_thousands: u32,
    /// Performance with reprojection over without.
    pub relative_performance: f64,
    /// Energy with reprojection over without.
    pub relative_energy: f64,
    /// Frames per second with reprojection.
    pub frames_per_second: f64,
}

/// The SGRT paper's scenes at 2048x1024 with secondary rays.
pub const SGRT_SCENES: [SgrtRow; 6] = [
    sgrt("Teapot", "teapot", 15, 1.64, 0.96, 131.3),
    sgrt("Chess", "chess", 42, 1.13, 1.02, 14.4),
    sgrt("BMW", "car", 55, 1.42, 0.97, 18.2),
    sgrt("Chemical Lab.", "lab", 98, 1.11, 0.99, 8.6),
    sgrt("Music box", "music-box", 106, 1.28, 0.98, 28.9),
    sgrt("Provence", "meadow", 600, 1.51, 0.80, 44.5),
];

/// Right-image pixels that the SGRT paper reuses, percent, on average.
pub const SGRT_REUSE_PCT: f64 = 91.54;
/// T&I work that reprojection saves, percent (section III).
pub const SGRT_TNI_SAVED_PCT: f64 = 68.0;
/// Software that reprojection adds, percent (section III).
pub const SGRT_SRP_ADDED_PCT: f64 = 10.0;

const fn sgrt(
    scene: &'static str,
    stand_in: &'static str,
    triangles_thousands: u32,
    relative_performance: f64,
    relative_energy: f64,
    frames_per_second: f64,
) -> SgrtRow {
    SgrtRow {
        scene,
        stand_in,
        triangles_thousands,
        relative_performance,
        relative_energy,
        frames_per_second,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_2_is_complete() {
        assert_eq!(z2_table().len(), 48);
        for scene in Z2_SCENES {
            for (l1, l2) in Z2_CACHES_KIB {
                for order in Z2_ORDERS {
                    assert!(
                        z2_row(scene, l1, l2, order).is_some(),
                        "{scene} {l1} {l2} {order:?}"
                    );
                }
            }
        }
    }

    /// Section 4.2: "decrease memory traffic by 24.8% and 27.9% on average", "up to 47.8%".
    #[test]
    fn the_papers_average_reductions_follow_from_its_table() {
        let reductions = |order| -> Vec<f64> {
            Z2_SCENES
                .iter()
                .flat_map(|scene| {
                    Z2_CACHES_KIB.map(|(l1, l2)| {
                        let lines = |o| {
                            z2_row(scene, l1, l2, o)
                                .unwrap()
                                .external_lines_per_footprint()
                        };
                        100.0 * (1.0 - lines(order) / lines(Order::MORTON))
                    })
                })
                .collect()
        };
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let sta = reductions(Order::Z2_STA);
        // The table's rates are rounded and weigh L2 look-ups alike; the paper sums bytes.
        assert!((mean(&reductions(Order::Z2_LRTA)) - 24.8).abs() < 0.4);
        assert!((mean(&sta) - 27.9).abs() < 0.4);
        assert!((sta.iter().copied().fold(0.0, f64::max) - 47.8).abs() < 0.4);
    }

    #[test]
    fn scenes_find_their_twins() {
        assert_eq!(
            z2_twin("../scenes/crytek-sponza/sponza.gltf", false),
            Some("crytek-sponza")
        );
        assert_eq!(z2_twin("atrium", false), Some("crytek-sponza"));
        assert_eq!(
            z2_twin("atrium-plain", false),
            Some("l-bench-sponza-no-shadows")
        );
        assert_eq!(
            z2_twin("dabrovic-sponza/sponza.obj", true),
            Some("l-bench-sponza-shadows")
        );
        assert_eq!(z2_twin("jungle", true), Some("gfxbench-t-rex"));
        assert_eq!(z2_twin("bunny", false), None);
    }
}
