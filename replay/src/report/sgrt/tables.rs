//! Tables of reprojection results.

use super::Entry;
use crate::report::csv::Csv;
use crate::report::html::table::{Column, Table};
use crate::report::theme::group_thousands;
use crate::sgrt::accuracy::ClassCounts;
use crate::sgrt::compose::Reuse;
use crate::sgrt::result::{Outcome, Report};

/// A scene's name without folder and extension.
#[must_use]
pub fn label(scene: &str) -> &str {
    let file = scene.rsplit(['/', '\\']).next().unwrap_or(scene);
    file.split('.').next().unwrap_or(file)
}

/// The name of a trace in tables.
pub fn scene_name(report: &Report) -> String {
    label(&report.trace.scene).to_owned()
}

/// Short names of the two runs: rules can be long, and [`rule_line`] says which one it is.
fn both(report: &Report) -> [(&'static str, &Outcome); 2] {
    [("chosen", &report.result), ("plain", &report.plain)]
}

/// Which rule and level of reuse the rows called "chosen" have.
#[must_use]
pub fn rule_line(entries: &[Entry]) -> String {
    entries.first().map_or_else(String::new, |entry| {
        let config = &entry.report.config;
        format!(
            "chosen: rule {}, reuse of {}; plain: rule none, every arrival reused as it is",
            config.rule,
            reuse_name(config.reuse)
        )
    })
}

/// Mean reuse over the traces that stand for scenes of the paper, chosen and plain.
#[must_use]
pub fn mean_reuse_line(entries: &[Entry]) -> Option<String> {
    let of_paper: Vec<&Report> = entries
        .iter()
        .map(|e| &e.report)
        .filter(|r| r.paper.is_some())
        .collect();
    let count = of_paper.len();
    let mean =
        |pct: fn(&Report) -> f64| of_paper.iter().map(|r| pct(r)).sum::<f64>() / count as f64;
    (count > 0).then(|| {
        format!(
            "right pixels reused, mean of {count} scenes set beside the paper: {:.2} % chosen, {:.2} % plain; \
             paper {:.2} %",
            mean(|r| r.result.reuse_pct),
            mean(|r| r.plain.reuse_pct),
            crate::paper::sgrt::REUSE_PCT
        )
    })
}

/// What to know of traces whose eyes the paper's row test is not made for.
#[must_use]
pub fn row_notes(entries: &[Entry]) -> Vec<String> {
    let reports = entries.iter().map(|e| &e.report);
    reports
        .filter(|report| !report.rows.row_test_applies)
        .map(|report| {
            format!(
                "{}: the paper's row test does not apply to these eyes: {:.1} % of the left pixels \
                 arrive in a row of another number, and a right row needs {:.1} left rows; all \
                 rows that are needed are fetched and charged",
                scene_name(report),
                report.rows.other_row_pct,
                report.rows.left_rows_per_right_row
            )
        })
        .collect()
}

fn reuse_name(reuse: Reuse) -> &'static str {
    match reuse {
        Reuse::Primary => "primary",
        Reuse::Shadow => "shadow",
        Reuse::Color => "color",
    }
}

fn whole(n: u64) -> String {
    group_thousands(&n.to_string())
}

fn mega(n: u64) -> String {
    format!("{:.2}", n as f64 * 1e-6)
}

/// Rows of a scene and rule under the given columns.
fn by_rule(
    entries: &[Entry],
    columns: Vec<Column>,
    cells: impl Fn(&Report, &Outcome) -> Vec<String>,
) -> Table {
    let mut all = vec![Column::text("scene"), Column::text("rule")];
    all.extend(columns);
    let mut table = Table::new(all);
    for entry in entries {
        table.begin_group();
        for (rule, outcome) in both(&entry.report) {
            let mut row = vec![scene_name(&entry.report), rule.to_owned()];
            row.extend(cells(&entry.report, outcome));
            table.push(row);
        }
    }
    table
}

/// The ratios beside the paper's.
pub fn performance(entries: &[Entry]) -> Table {
    let columns = vec![
        Column::number("reuse", "%"),
        Column::number("performance", "ratio"),
        Column::number("units alone", "ratio"),
        Column::published("paper", "ratio"),
        Column::number("energy", "ratio"),
        Column::published("paper", "ratio"),
        Column::number("primary steps", "%"),
        Column::number("unit cycles saved", "%"),
        Column::number("of the right eye's", "%"),
        Column::number("core cycles added", "%"),
    ];
    by_rule(entries, columns, |report, o| {
        let paper = report.paper.as_ref();
        let or_dash = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{v:.2}"));
        vec![
            format!("{:.2}", o.reuse_pct),
            format!("{:.2}", o.relative_performance),
            format!("{:.2}", o.tni_relative_performance),
            or_dash(paper.map(|p| p.relative_performance)),
            format!("{:.2}", o.relative_energy),
            or_dash(paper.map(|p| p.relative_energy)),
            format!("{:.1}", o.primary_steps_pct),
            format!("{:.1}", o.tni_reduction_pct),
            format!("{:.1}", o.right_tni_reduction_pct),
            format!("{:.1}", o.srp_overhead_pct),
        ]
    })
}

/// Reuse with its error.
pub fn accuracy(entries: &[Entry]) -> Table {
    let columns = vec![
        Column::number("reuse", "%"),
        Column::number("wrong object", "%"),
        Column::number("wrong triangle", "%"),
        Column::number("off > 1 px", "%"),
        Column::number("off > 2 px", "%"),
        Column::number("FLIP mean", ""),
        Column::number("FLIP p99", ""),
        Column::number("ppd", "px/deg"),
        Column::number("PSNR", "dB"),
        Column::number("SSIM", ""),
    ];
    by_rule(entries, columns, |_, o| {
        vec![
            format!("{:.2}", o.reuse_pct),
            format!("{:.3}", o.wrong_object_pct),
            format!("{:.3}", o.wrong_primitive_pct),
            format!("{:.3}", o.position_over_1px_pct),
            format!("{:.3}", o.position_over_2px_pct),
            format!("{:.5}", o.flip_mean),
            format!("{:.4}", o.flip_p99),
            format!("{:.1}", o.pixels_per_degree),
            format!("{:.1}", o.psnr_db),
            format!("{:.4}", o.ssim),
        ]
    })
}

/// Pixels by class, and what is wrong with those reused.
pub fn classes(entries: &[Entry]) -> Table {
    let mut table = Table::new(vec![
        Column::text("scene"),
        Column::text("rule"),
        Column::text("class"),
        Column::number("pixels", ""),
        Column::number("share", "%"),
        Column::number("wrong object", "px"),
        Column::number("wrong triangle", "px"),
        Column::number("off > 1 px", "px"),
        Column::number("off > 2 px", "px"),
    ]);
    for entry in entries {
        for (rule, o) in both(&entry.report) {
            table.begin_group();
            let c = &o.classes;
            let rows: [(&str, &ClassCounts); 4] = [
                ("reused", &c.reused),
                ("overlapped, nearest reused", &c.overlapped),
                ("missing, traced", &c.missing),
                ("bad, traced", &c.bad),
            ];
            for (class, counts) in rows {
                table.push(vec![
                    scene_name(&entry.report),
                    rule.to_owned(),
                    class.to_owned(),
                    whole(counts.pixels),
                    format!("{:.2}", c.pct(counts.pixels)),
                    whole(counts.wrong_object),
                    whole(counts.wrong_primitive),
                    whole(counts.position_over[0]),
                    whole(counts.position_over[1]),
                ]);
            }
        }
    }
    table
}

/// Cycles and work.
pub fn work(entries: &[Entry]) -> Table {
    let columns = vec![
        Column::number("unit cycles", "M"),
        Column::number("both eyes in full", "M"),
        Column::number("core cycles", "M"),
        Column::number("both eyes in full", "M"),
        Column::text("unit bottleneck"),
        Column::number("rays", "M"),
        Column::number("both eyes in full", "M"),
        Column::number("steps", "M"),
        Column::number("both eyes in full", "M"),
        Column::number("re-tests", "M"),
    ];
    by_rule(entries, columns, |_, o| {
        vec![
            mega(o.tni_cycles),
            mega(o.reference_tni_cycles),
            mega(o.srp_cycles),
            mega(o.reference_srp_cycles),
            o.tni_bottleneck.clone(),
            mega(o.work.rays),
            mega(o.reference_work.rays),
            mega(o.work.steps),
            mega(o.reference_work.steps),
            mega(o.work.retests),
        ]
    })
}

/// Bytes moved, with the G-buffer in tiles and without.
pub fn traffic(entries: &[Entry]) -> Table {
    let columns = vec![
        Column::number("detection reads", "B/px"),
        Column::number("tile buffers", "MB"),
        Column::number("G-buffer in DRAM", "MB"),
        Column::number("all DRAM", "MB"),
        Column::number("both eyes in full", "MB"),
        Column::number("energy", "ratio"),
        Column::number("whole screen: all DRAM", "MB"),
        Column::number("performance", "ratio"),
        Column::number("energy", "ratio"),
    ];
    by_rule(entries, columns, |report, o| {
        let screen = &o.whole_screen;
        let read_bytes = o.detection_reads.pixel_bytes(&report.config.model.gbuffer);
        vec![
            read_bytes.to_string(),
            mega(o.on_chip_bytes),
            mega(o.dram.gbuffer_bytes),
            mega(o.dram.total()),
            mega(o.reference_dram.total()),
            format!("{:.3}", o.relative_energy),
            mega(screen.dram.total()),
            format!("{:.3}", screen.relative_performance),
            format!("{:.3}", screen.relative_energy),
        ]
    })
}

/// Energy by component over the reference's total.
pub fn energy(entries: &[Entry]) -> Table {
    let mut table = Table::new(vec![
        Column::text("scene"),
        Column::text("run"),
        Column::number("units", "%"),
        Column::number("cores", "%"),
        Column::number("caches", "%"),
        Column::number("tile buffers", "%"),
        Column::number("DRAM", "%"),
        Column::number("static", "%"),
        Column::number("sum", "%"),
    ]);
    table.caption = "Energy by component, % of tracing both eyes in full".to_owned();
    for entry in entries {
        table.begin_group();
        let o = &entry.report.result;
        let whole = o.reference_energy.total();
        for (name, e) in [
            ("both eyes in full", &o.reference_energy),
            ("chosen", &o.energy),
        ] {
            let mut row = vec![scene_name(&entry.report), name.to_owned()];
            let parts = [
                e.tni_pj,
                e.srp_pj,
                e.caches_pj,
                e.sram_pj,
                e.dram_pj,
                e.static_pj,
                e.total(),
            ];
            row.extend(parts.map(|p| format!("{:.1}", 100.0 * p / whole)));
            table.push(row);
        }
    }
    table
}

/// The points of the curve.
pub fn curve(report: &Report) -> Table {
    let mut table = Table::new(vec![
        Column::text("rule"),
        Column::text("reused"),
        Column::number("reuse", "%"),
        Column::number("wrong object", "%"),
        Column::number("unit cycles saved", "%"),
        Column::number("performance", "ratio"),
        Column::number("FLIP mean", ""),
        Column::number("FLIP p99", ""),
    ]);
    let mut last = None;
    for p in &report.curve {
        if last != Some(&p.rule) {
            table.begin_group();
            last = Some(&p.rule);
        }
        table.push(vec![
            p.rule.to_string(),
            reuse_name(p.reuse).to_owned(),
            format!("{:.2}", p.reuse_pct),
            format!("{:.3}", p.wrong_object_pct),
            format!("{:.1}", p.tni_reduction_pct),
            format!("{:.2}", p.relative_performance),
            format!("{:.5}", p.flip_mean),
            format!("{:.4}", p.flip_p99),
        ]);
    }
    table
}

/// Parameters by their effect on the ratios.
pub fn sensitivity(report: &Report) -> Table {
    let mut table = Table::new(vec![
        Column::text("parameter"),
        Column::number("value", ""),
        Column::number("performance, half", "ratio"),
        Column::number("twice", "ratio"),
        Column::number("energy, half", "ratio"),
        Column::number("twice", "ratio"),
    ]);
    let o = &report.result;
    let effect = |s: &crate::sgrt::result::Sensitivity| {
        let off = |pair: [f64; 2], base: f64| pair.map(|v| (v - base).abs()).into_iter().sum();
        let performance: f64 = off(s.relative_performance, o.relative_performance);
        let energy: f64 = off(s.relative_energy, o.relative_energy);
        performance + energy
    };
    let mut rows: Vec<_> = report.sensitivity.iter().collect();
    rows.sort_by(|a, b| effect(b).total_cmp(&effect(a)));
    for s in rows {
        table.push(vec![
            s.parameter.clone(),
            s.value.to_string(),
            format!("{:.3}", s.relative_performance[0]),
            format!("{:.3}", s.relative_performance[1]),
            format!("{:.3}", s.relative_energy[0]),
            format!("{:.3}", s.relative_energy[1]),
        ]);
    }
    table
}

/// A row for the rule and one for plain reuse, per trace.
#[must_use]
pub fn csv(entries: &[Entry]) -> String {
    let mut csv = Csv::new(&[
        "scene",
        "checksum",
        "rule",
        "reuse",
        "reuse_pct",
        "wrong_object_pct",
        "wrong_primitive_pct",
        "position_over_1px_pct",
        "position_over_2px_pct",
        "relative_performance",
        "tni_relative_performance",
        "primary_steps_pct",
        "paper_relative_performance",
        "relative_energy",
        "paper_relative_energy",
        "tni_cycles",
        "reference_tni_cycles",
        "srp_cycles",
        "reference_srp_cycles",
        "tni_reduction_pct",
        "srp_overhead_pct",
        "flip_mean",
        "flip_p99",
        "pixels_per_degree",
        "psnr_db",
        "ssim",
        "on_chip_bytes",
        "gbuffer_dram_bytes",
        "dram_bytes",
        "reference_dram_bytes",
        "whole_screen_dram_bytes",
        "whole_screen_relative_performance",
        "whole_screen_relative_energy",
        "row_test_applies",
    ]);
    for entry in entries {
        let report = &entry.report;
        for (rule, o) in [
            (report.config.rule.to_string(), &report.result),
            ("none".to_owned(), &report.plain),
        ] {
            let paper = report.paper.as_ref();
            drop(
                csv.row()
                    .text(&report.trace.scene)
                    .text(&report.trace.checksum)
                    .text(&rule)
                    .text(reuse_name(report.config.reuse))
                    .value(o.reuse_pct)
                    .value(o.wrong_object_pct)
                    .value(o.wrong_primitive_pct)
                    .value(o.position_over_1px_pct)
                    .value(o.position_over_2px_pct)
                    .value(o.relative_performance)
                    .value(o.tni_relative_performance)
                    .value(o.primary_steps_pct)
                    .maybe(paper.map(|p| p.relative_performance))
                    .value(o.relative_energy)
                    .maybe(paper.map(|p| p.relative_energy))
                    .value(o.tni_cycles)
                    .value(o.reference_tni_cycles)
                    .value(o.srp_cycles)
                    .value(o.reference_srp_cycles)
                    .value(o.tni_reduction_pct)
                    .value(o.srp_overhead_pct)
                    .value(o.flip_mean)
                    .value(o.flip_p99)
                    .value(o.pixels_per_degree)
                    .value(o.psnr_db)
                    .value(o.ssim)
                    .value(o.on_chip_bytes)
                    .value(o.dram.gbuffer_bytes)
                    .value(o.dram.total())
                    .value(o.reference_dram.total())
                    .value(o.whole_screen.dram.total())
                    .value(o.whole_screen.relative_performance)
                    .value(o.whole_screen.relative_energy)
                    .value(report.rows.row_test_applies),
            );
        }
    }
    csv.finish()
}
