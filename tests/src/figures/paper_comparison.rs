//! Tables of docs/results/z2-comparison.md, z2-open-choices.md and papers.md.

use super::view::{Results, markdown};
use replay::paper::z2;

const CACHES_KIB: [[&str; 2]; 4] = [["8", "128"], ["16", "128"], ["8", "256"], ["16", "256"]];
const ORDERS: [&str; 3] = ["morton", "z2-lrta", "z2-sta"];

/// The paper's scenes. For each one, the scene used in its place, and that scene's layout of shadow maps.
const TABLE_2: [[&str; 3]; 4] = [
    ["GFXBench T-Rex", "cocoa-temple", "morton"],
    ["Crytek Sponza", "crytek-sponza", "morton"],
    ["L-Bench, no shadows", "dabrovic-sponza", "morton"],
    ["L-Bench, shadows", "dabrovic-sponza-shadows", "linear"],
];

/// Each row of the paper's Table 2 with the result of a replay of its scene or of its stand-in scene.
pub fn table_2(results: &Results) -> String {
    let headings = [
        "paper's scene",
        "ours",
        "caches",
        "order",
        "L1 miss %",
        "L2 miss %",
        "TMU %",
        "saved %",
    ];
    let rows = TABLE_2.iter().flat_map(|&[paper, scene, maps]| {
        CACHES_KIB.iter().flat_map(move |&[l1, l2]| {
            ORDERS.map(|order| {
                let both = |column: &str| {
                    let keys = [
                        ("scene", scene),
                        ("shadow_map_order", maps),
                        ("l1_kib", l1),
                        ("l2_kib", l2),
                        ("order", order),
                    ];
                    let published = format!("paper_{column}");
                    let ours = results.number(&keys, column, 1);
                    format!("{ours} / {}", results.number(&keys, &published, 1))
                };
                let saved = if order == "morton" {
                    String::new()
                } else {
                    both("saved_pct")
                };
                vec![
                    paper.to_owned(),
                    scene.to_owned(),
                    format!("{l1}/{l2}"),
                    order.to_owned(),
                    both("l1_footprint_miss_pct"),
                    both("l2_line_miss_pct"),
                    both("tmu_util_pct"),
                    saved,
                ]
            })
        })
    });
    markdown(&headings, rows)
}

/// Crytek Sponza with eyes 500 mm apart, compared with the paper.
pub fn crytek_500mm(results: &Results) -> String {
    let headings = [
        "caches",
        "L1 %: Morton, LRTA, STA",
        "paper",
        "L2 %: Morton, LRTA, STA",
        "paper",
        "saved %: LRTA, STA",
        "paper",
    ];
    let rows = CACHES_KIB.map(|[l1, l2]| {
        let of = |column: &str, orders: &[&str]| {
            let number = |order: &&str| {
                let keys = [("l1_kib", l1), ("l2_kib", l2), ("order", *order)];
                results.number(&keys, column, 1)
            };
            orders.iter().map(number).collect::<Vec<_>>().join(", ")
        };
        vec![
            format!("{l1}/{l2}"),
            of("l1_footprint_miss_pct", &ORDERS),
            of("paper_l1_footprint_miss_pct", &ORDERS),
            of("l2_line_miss_pct", &ORDERS),
            of("paper_l2_line_miss_pct", &ORDERS),
            of("saved_pct", &ORDERS[1..]),
            of("paper_saved_pct", &ORDERS[1..]),
        ]
    });
    markdown(&headings, rows)
}

/// Shadow-map layouts on Dabrovic Sponza, with the paper's rows for its scene with shadows.
pub fn shadow_maps(results: &Results) -> String {
    let headings = [
        "maps",
        "eyes",
        "L2",
        "L1 miss %, Morton",
        "L2 miss %, Morton",
        "LRTA saved %",
        "STA saved %",
    ];
    let maps = [
        ("128", "linear", "linear"),
        ("128", "tiled", "tiles of 4x4 texels in rows"),
        ("128", "morton", "Morton"),
        ("256", "linear", "linear"),
        ("256", "morton", "Morton"),
    ];
    let ours = maps.into_iter().flat_map(|(l2, order, title)| {
        ["symmetric", "dk2"].map(|eyes| {
            let number = |tile_order: &str, column: &str| {
                let keys = [
                    ("scene", "dabrovic-sponza+shadows"),
                    ("eyes", eyes),
                    ("shadow_map_order", order),
                    ("l2_kib", l2),
                    ("order", tile_order),
                ];
                results.number(&keys, column, 1)
            };
            vec![
                title.to_owned(),
                if eyes == "dk2" { "DK2" } else { eyes }.to_owned(),
                format!("{l2} KB"),
                number("morton", "l1_footprint_miss_pct"),
                number("morton", "l2_line_miss_pct"),
                number("z2-lrta", "saved_pct"),
                number("z2-sta", "saved_pct"),
            ]
        })
    });
    let published = [128, 256].map(|l2| {
        let [morton, lrta, sta] = z2::ORDERS
            .map(|order| z2::row(z2::SCENES[3], 8, l2, order).expect("a row of the paper's table"));
        let saved = |row: &z2::PublishedRow| format!("{:.1}", row.reduction_pct().unwrap_or(0.0));
        vec![
            "paper".to_owned(),
            String::new(),
            format!("{l2} KB"),
            format!("{:.1}", morton.l1_footprint_miss_pct),
            format!("{:.1}", morton.l2_line_miss_pct),
            saved(lrta),
            saved(sta),
        ]
    });
    markdown(&headings, ours.chain(published))
}

/// Distance from the paper's table by eye distance and bias, for the scene used for choosing and for the
/// held-out scenes.
pub fn calibration(results: &Results) -> String {
    let headings = [
        "eyes, mm",
        "LOD bias",
        "functional: Crytek",
        "functional: held out",
        "preset: Crytek",
        "preset: held out",
    ];
    let models = results.values("model");
    let columns: Vec<(String, &str)> = (models.iter())
        .flat_map(|model| ["chooses", "held out"].map(|role| (model.clone(), role)))
        .collect();
    // Over several held-out scenes: the root mean square, as in the calibration.
    let distance = |ipd: &str, bias: &str, (model, role): &(String, &str)| {
        let of = results.rows.iter().filter(|row| {
            row["model"] == *model
                && row["role"] == *role
                && row["ipd_mm"] == ipd
                && row["lod_bias"] == bias
        });
        let all: Vec<f64> = of
            .map(|row| row["all_parts"].parse().expect("a number"))
            .collect();
        (all.iter().map(|d| d * d).sum::<f64>() / all.len() as f64).sqrt()
    };
    let mut settings = Vec::new();
    for ipd in results.values("ipd_mm") {
        for bias in results.values("lod_bias") {
            settings.push((ipd.clone(), bias));
        }
    }
    let least: Vec<f64> = (columns.iter())
        .map(|column| {
            let all = settings
                .iter()
                .map(|(ipd, bias)| distance(ipd, bias, column));
            all.fold(f64::INFINITY, f64::min)
        })
        .collect();
    let rows = settings.iter().map(|(ipd, bias)| {
        let cells = columns.iter().zip(&least).map(|(column, least)| {
            let found = distance(ipd, bias, column);
            if found == *least {
                format!("**{found:.3}**")
            } else {
                format!("{found:.3}")
            }
        });
        [ipd.clone(), bias.clone()]
            .into_iter()
            .chain(cells)
            .collect()
    });
    markdown(&headings, rows)
}
