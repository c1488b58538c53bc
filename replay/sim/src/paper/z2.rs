//! Nah, Lim, Ki, Shin, "Z2 traversal order: An interleaving approach for VR stereo rendering on
//! tile-based GPUs", Computational Visual Media 3(4), 2017. Table 2 is `data/z2-table2.csv`.

use crate::config::Order;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// One row of the paper's Table 2: a scene, a cache configuration, an order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct PublishedRow {
    /// Scene, as in [`SCENES`].
    pub scene: String,
    /// L1 size in KiB.
    pub l1_kib: u32,
    /// L2 size in KiB.
    pub l2_kib: u32,
    /// Order.
    pub order: Order,
    /// L1 miss rate, percent of footprints.
    pub l1_footprint_miss_pct: f64,
    /// L2 miss rate, percent of L2 look-ups.
    pub l2_line_miss_pct: f64,
    /// TMU utilisation, percent.
    pub tmu_util_pct: f64,
}

impl PublishedRow {
    /// DRAM traffic in lines per footprint (L1 times L2 miss rate). This is Fig. 5 except for its scale,
    /// which the paper does not give in numbers.
    fn external_lines_per_footprint(&self) -> f64 {
        self.l1_footprint_miss_pct * self.l2_line_miss_pct / 1e4
    }

    /// The same scene and caches in Morton order.
    pub fn morton(&self) -> Option<&'static Self> {
        row(&self.scene, self.l1_kib, self.l2_kib, Order::MORTON)
    }

    /// DRAM traffic saved relative to Morton order, percent.
    pub fn reduction_pct(&self) -> Option<f64> {
        let morton = self.morton()?.external_lines_per_footprint();
        Some(100.0 * (1.0 - self.external_lines_per_footprint() / morton))
    }

    /// TMU utilisation relative to Morton order.
    pub fn tmu_ratio(&self) -> Option<f64> {
        Some(self.tmu_util_pct / self.morton()?.tmu_util_pct)
    }
}

/// The paper's scenes, in table order.
pub const SCENES: [&str; 4] = [
    "gfxbench-t-rex",
    "crytek-sponza",
    "l-bench-sponza-no-shadows",
    "l-bench-sponza-shadows",
];

/// The paper's cache configurations: L1 and L2 size in KiB, in the order of its Table 2.
pub const CACHES_KIB: [(u32, u32); 4] = [(8, 128), (16, 128), (8, 256), (16, 256)];

/// The orders that the paper compares.
pub const ORDERS: [Order; 3] = [Order::MORTON, Order::Z2_LRTA, Order::Z2_STA];

static TABLE: LazyLock<Vec<PublishedRow>> =
    LazyLock::new(|| parse_table(include_str!("../../data/z2-table2.csv")));

/// The paper's Table 2.
pub fn table() -> &'static [PublishedRow] {
    &TABLE
}

/// The row of Table 2 for a scene, a cache configuration and an order, if it has one.
pub fn row(scene: &str, l1_kib: u32, l2_kib: u32, order: Order) -> Option<&'static PublishedRow> {
    table()
        .iter()
        .find(|r| r.scene == scene && r.l1_kib == l1_kib && r.l2_kib == l2_kib && r.order == order)
}

/// Skips lines that do not parse; a test checks that there are none.
fn parse_table(text: &str) -> Vec<PublishedRow> {
    let mut lines = csv::Reader::from_reader(text.as_bytes());
    lines.deserialize().filter_map(Result::ok).collect()
}

/// Stand-in scenes: short name, and the paper's scene without and with shadow maps. The built-in ones were
/// made for this purpose, the others are the same or similar models.
const STAND_INS: [(&str, [Option<&str>; 2]); 7] = {
    let [t_rex, crytek, plain, shadows] = SCENES;
    [
        ("atrium", [Some(crytek), None]),
        ("crytek-sponza", [Some(crytek), None]),
        ("atrium-plain", [Some(plain), Some(shadows)]),
        ("dabrovic-sponza", [Some(plain), Some(shadows)]),
        ("atrium-shadows", [None, Some(shadows)]),
        ("jungle", [Some(t_rex), Some(t_rex)]),
        ("stk-cocoa-temple", [Some(t_rex), Some(t_rex)]),
    ]
};

/// The paper's scene that a scene stands in for, by its exact short name and by whether it samples shadow maps.
pub fn stand_in(scene: &str, shadow_maps: bool) -> Option<&'static str> {
    super::stand_in(scene, &STAND_INS)?[usize::from(shadow_maps)]
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_2_is_complete() {
        assert_eq!(table().len(), 48);
        for scene in SCENES {
            for (l1, l2) in CACHES_KIB {
                for order in ORDERS {
                    assert!(
                        row(scene, l1, l2, order).is_some(),
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
            let rows = table().iter().filter(|row| row.order == order);
            rows.map(|row| row.reduction_pct().unwrap()).collect()
        };
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let sta = reductions(Order::Z2_STA);
        // The table's rates are rounded and weight all L2 look-ups equally; the paper sums bytes.
        assert!((mean(&reductions(Order::Z2_LRTA)) - 24.8).abs() < 0.4);
        assert!((mean(&sta) - 27.9).abs() < 0.4);
        assert!((sta.iter().copied().fold(0.0, f64::max) - 47.8).abs() < 0.4);
    }

    #[test]
    fn a_stand_in_scene_is_found_by_its_exact_name() {
        let path = "../scenes/crytek-sponza/sponza.gltf";
        assert_eq!(stand_in(path, false), Some("crytek-sponza"));
        assert_eq!(stand_in("atrium", false), Some("crytek-sponza"));
        assert_eq!(stand_in("atrium", true), None);
        let dabrovic = |shadow_maps| stand_in("dabrovic-sponza/sponza.obj", shadow_maps);
        assert_eq!(dabrovic(false), Some("l-bench-sponza-no-shadows"));
        assert_eq!(dabrovic(true), Some("l-bench-sponza-shadows"));
        assert_eq!(stand_in("jungle", true), Some("gfxbench-t-rex"));
        for other in [
            "bunny",
            "my-atrium-test.gltf",
            "jungle-book",
            "not-crytek.obj",
        ] {
            assert_eq!(stand_in(other, false), None, "{other}");
        }
    }
}
