//! Tables of reprojection results.

use super::Entry;
use crate::columns::{Column, Columns, Row, Show, columns_of, name, pick};
use crate::table::Table;
use sgrt::accuracy::{Accuracy, ClassCounts};
use sgrt::hierarchy_update::{HierarchyUpdate, UpdateBytes};
use sgrt::result::{CurvePoint, Outcome, Report, Sensitivity};
use sgrt::run::EnergyPj;
use sgrt::timing::Timing;
use sim::paper::sgrt::PaperValues;

/// The name of a trace in tables.
pub fn scene_name(report: &Report) -> String {
    sim::result::scene_name(&report.trace.scene).to_owned()
}

/// Describes the rule and level of reuse of the rows named "chosen".
pub(super) fn rule_line(entries: &[Entry]) -> String {
    entries.first().map_or_else(String::new, |entry| {
        let config = &entry.report.config;
        let timing = match config.timing {
            Timing::ClosedForm => "",
            Timing::Cycle => "; units simulated cycle by cycle",
        };
        let rates = entries.iter().map(|entry| &entry.report);
        let rates = rates.filter(|report| report.config.cache_misses == "rates");
        let rates: Vec<String> = rates.map(scene_name).collect();
        let rates = if rates.is_empty() {
            String::new()
        } else {
            format!(
                "; cache misses by stated hit rates, as these traces have no visits (tracegen rays --visits): {}",
                rates.join(", ")
            )
        };
        format!(
            "chosen: rule {}, reuse of {}; plain: rule none, every reprojected hit is reused{timing}{rates}",
            config.rule,
            name(&config.reuse)
        )
    })
}

/// Mean reuse over the traces that correspond to a scene of the paper, for both rules.
pub(super) fn mean_reuse_line(entries: &[Entry]) -> Option<String> {
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
            "right pixels reused, mean of {count} scenes that stand for the paper's: {:.2} % chosen, \
             {:.2} % plain; paper {:.2} %",
            mean(|r| r.result.reuse_pct),
            mean(|r| r.plain.reuse_pct),
            sim::paper::sgrt::REUSE_PCT
        )
    })
}

/// Notes on traces whose eyes do not meet the conditions of the paper's row test.
pub(super) fn row_notes(entries: &[Entry]) -> Vec<String> {
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

/// A trace with one of the two rules that every report has.
struct RuleRow<'a> {
    report: &'a Report,
    /// "chosen" or "plain": tables use these names because rules can be long. [`rule_line`] describes the
    /// chosen rule.
    run: &'static str,
    outcome: &'a Outcome,
}

fn rule_rows(entries: &[Entry]) -> Vec<RuleRow<'_>> {
    let both = |entry| {
        let report: &Report = entry;
        [("chosen", &report.result), ("plain", &report.plain)].map(|(run, outcome)| RuleRow {
            report,
            run,
            outcome,
        })
    };
    entries.iter().flat_map(|e| both(&e.report)).collect()
}

fn pct<'a>(
    key: &'static str,
    name: &'static str,
    decimals: usize,
    value: fn(&Outcome) -> f64,
) -> Column<'static, RuleRow<'a>> {
    Column::real(key, name, "%", decimals, move |r: &RuleRow| {
        value(r.outcome)
    })
}

fn ratio<'a>(
    key: &'static str,
    name: &'static str,
    value: fn(&Outcome) -> f64,
) -> Column<'static, RuleRow<'a>> {
    Column::real(key, name, "ratio", 3, move |r: &RuleRow| value(r.outcome))
}

/// The paper's ratio.
fn paper<'a>(key: &'static str, value: fn(&PaperValues) -> f64) -> Column<'static, RuleRow<'a>> {
    let of = move |r: &RuleRow| r.report.paper.as_ref().map(value);
    Column::real(key, "paper", "ratio", 2, of).published()
}

fn millions<'a>(
    key: &'static str,
    name: &'static str,
    unit: &'static str,
    value: fn(&Outcome) -> u64,
) -> Column<'static, RuleRow<'a>> {
    let show = Show::Millions(2);
    Column::new(key, name, unit, show, move |r: &RuleRow| value(r.outcome))
}

/// What a row is about.
fn identity<'a>() -> Vec<Column<'static, RuleRow<'a>>> {
    columns_of::<RuleRow>()
        .text("scene", "scene", |r| scene_name(r.report))
        .text("trace", "trace", |r| r.report.trace.name.as_str())
        .text("checksum", "checksum", |r| r.report.trace.checksum.as_str())
        .text("camera", "camera", |r| r.report.trace.camera.as_str())
        .text("display", "display", |r| r.report.trace.display.as_str())
        .text("width_px", "width", |r| r.report.eye_size_px[0])
        .text("height_px", "height", |r| r.report.eye_size_px[1])
        .text("model_version", "model", |r| r.report.model_version)
        .text("cache_misses", "cache misses from", |r| {
            r.report.config.cache_misses.as_str()
        })
        .text("timing", "timing", |r| r.report.config.timing.name())
        .text("run", "rule", |r| r.run)
        .text("rule", "rule", |r| match r.run {
            "chosen" => r.report.config.rule.to_string(),
            _ => "none".to_owned(),
        })
        .text("reuse", "reused", |r| name(&r.report.config.reuse))
}

/// Reused hits and their errors.
#[rustfmt::skip]
fn hits<'a>() -> Vec<Column<'static, RuleRow<'a>>> {
    vec![
        pct("reuse_pct", "reuse", 2, |o| o.reuse_pct),
        pct("wrong_object_pct", "wrong object", 3, |o| o.wrong_object_pct),
        pct("wrong_primitive_pct", "other triangle, off > 1 px", 3, |o| o.wrong_primitive_pct).about("right object, another triangle than the traced one, and off by more than 1 px; part of the pixels that are off by more than 1 px"),
        pct("position_over_1px_pct", "off > 1 px", 3, |o| o.position_over_1px_pct),
        pct("position_over_2px_pct", "off > 2 px", 3, |o| o.position_over_2px_pct),
    ]
}

/// Performance and energy relative to tracing both eyes completely.
#[rustfmt::skip]
fn ratios<'a>() -> Vec<Column<'static, RuleRow<'a>>> {
    vec![
        ratio("relative_performance", "performance", |o| o.relative_performance),
        ratio("tni_relative_performance", "units alone", |o| o.tni_relative_performance),
        paper("paper_relative_performance", |p| p.relative_performance),
        ratio("relative_energy", "energy", |o| o.relative_energy),
        ratio("relative_energy_least", "14 nm, least", |o| o.relative_energy_bounds[0]),
        ratio("relative_energy_most", "14 nm, most", |o| o.relative_energy_bounds[1]),
        paper("paper_relative_energy", |p| p.relative_energy),
        pct("primary_steps_pct", "primary steps", 1, |o| o.primary_steps_pct),
        pct("tni_reduction_pct", "unit cycles saved", 1, |o| o.tni_reduction_pct),
        pct("right_tni_reduction_pct", "of the right eye's", 1, |o| o.right_tni_reduction_pct),
        pct("srp_overhead_pct", "core cycles added", 1, |o| o.srp_overhead_pct),
    ]
}

/// Cycles, rays and steps.
#[rustfmt::skip]
fn cycles<'a>() -> Vec<Column<'static, RuleRow<'a>>> {
    vec![
        millions("tni_cycles", "unit cycles", "M", |o| o.tni_cycles),
        millions("reference_tni_cycles", "both eyes in full", "M", |o| o.reference_tni_cycles),
        millions("srp_cycles", "core cycles", "M", |o| o.srp_cycles),
        millions("reference_srp_cycles", "both eyes in full", "M", |o| o.reference_srp_cycles),
        Column::text("tni_bottleneck", "unit bottleneck", |r: &RuleRow| r.outcome.tni_bottleneck.clone()),
        millions("rays", "rays", "M", |o| o.work.rays),
        millions("reference_rays", "both eyes in full", "M", |o| o.reference_work.rays),
        millions("steps", "steps", "M", |o| o.work.steps),
        millions("reference_steps", "both eyes in full", "M", |o| o.reference_work.steps),
        millions("retests", "re-tests", "M", |o| o.work.retests),
    ]
}

/// Differences between the pictures.
fn image_error<'a>() -> Vec<Column<'static, RuleRow<'a>>> {
    columns_of::<RuleRow>()
        .real("flip_mean", "FLIP mean", "", 5, |r| r.outcome.flip_mean)
        .real("flip_p99", "FLIP p99", "", 4, |r| r.outcome.flip_p99)
        .real("pixels_per_degree", "ppd", "px/deg", 1, |r| {
            r.outcome.pixels_per_degree
        })
        .real("psnr_db", "PSNR", "dB", 1, |r| r.outcome.psnr_db)
        .real("ssim", "SSIM", "", 4, |r| r.outcome.ssim)
}

/// Bytes of the hierarchy's update.
fn update<'a>(
    key: &'static str,
    name: &'static str,
    bytes: fn(&HierarchyUpdate) -> Option<UpdateBytes>,
) -> Column<'static, RuleRow<'a>> {
    Column::new(key, name, "MB", Show::Millions(2), move |r: &RuleRow| {
        let bytes = r.report.hierarchy_update.as_ref().and_then(bytes);
        bytes.map(|bytes| bytes.total())
    })
}

/// Reads of the detection, buffers and DRAM traffic.
fn bytes<'a>() -> Vec<Column<'static, RuleRow<'a>>> {
    vec![
        Column::new("detection_bytes", "detection reads", "B/px", Show::Whole, {
            |r: &RuleRow| {
                let reads = r.outcome.detection_reads;
                reads.pixel_bytes(&r.report.config.model.gbuffer)
            }
        }),
        Column::real(
            "detection_sram_kib",
            "row buffers",
            "KiB",
            0,
            |r: &RuleRow| r.outcome.detection_sram_bytes as f64 / 1024.0,
        ),
        millions("on_chip_bytes", "tile buffers", "MB", |o| o.on_chip_bytes),
        millions("gbuffer_dram_bytes", "G-buffer in DRAM", "MB", |o| {
            o.dram.gbuffer_bytes
        }),
        millions("hierarchy_dram_bytes", "hierarchy in DRAM", "MB", |o| {
            o.dram.hierarchy_bytes
        }),
        millions(
            "reference_hierarchy_dram_bytes",
            "both eyes in full",
            "MB",
            |o| o.reference_dram.hierarchy_bytes,
        ),
        update("update_bytes", "update", |u| Some(u.bytes)),
        update("ploc_update_bytes", "rebuild by PLOC", |u| u.ploc),
        millions("dram_bytes", "all DRAM", "MB", |o| o.dram.total()),
        millions("reference_dram_bytes", "both eyes in full", "MB", |o| {
            o.reference_dram.total()
        }),
        millions("whole_screen_dram_bytes", "whole screen: DRAM", "MB", |o| {
            o.whole_screen.dram.total()
        }),
        ratio("whole_screen_relative_performance", "performance", |o| {
            o.whole_screen.relative_performance
        }),
        ratio("whole_screen_relative_energy", "energy", |o| {
            o.whole_screen.relative_energy
        }),
        Column::text("row_test_applies", "row test applies", |r: &RuleRow| {
            r.report.rows.row_test_applies
        }),
    ]
}

impl Row for RuleRow<'_> {
    fn columns() -> Vec<Column<'static, Self>> {
        let groups = [
            identity(),
            hits(),
            ratios(),
            cycles(),
            image_error(),
            bytes(),
        ];
        groups.into_iter().flatten().collect()
    }
}

fn by_rule<'a>(entries: &'a [Entry], figures: Vec<Column<'static, RuleRow<'a>>>) -> Table {
    let mut columns = pick::<RuleRow>(&["scene", "run"]);
    columns.extend(figures);
    Table::new(&columns, &rule_rows(entries)).grouped_by(1)
}

/// The ratios, and the paper's.
pub fn performance(entries: &[Entry]) -> Table {
    let mut figures = pick(&["reuse_pct"]);
    figures.extend(ratios());
    by_rule(entries, figures).without_empty_columns()
}

/// Reuse and its error.
pub fn accuracy(entries: &[Entry]) -> Table {
    let mut figures = hits();
    figures.extend(image_error());
    by_rule(entries, figures)
}

/// Cycles and work.
pub fn work(entries: &[Entry]) -> Table {
    by_rule(entries, cycles())
}

/// Bytes moved, with a tiled G-buffer and without.
pub fn traffic(entries: &[Entry]) -> Table {
    let mut figures = bytes();
    figures.retain(|figure| figure.heading.key != "row_test_applies");
    by_rule(entries, figures).without_empty_columns()
}

/// Per trace, one row for the rule and one for plain reuse.
pub fn rows(entries: &[Entry]) -> Table {
    Table::new(&RuleRow::columns(), &rule_rows(entries))
}

/// Pixels of a class.
struct ClassRow<'a> {
    run: &'a RuleRow<'a>,
    class: &'static str,
    counts: &'a ClassCounts,
}

impl ClassRow<'_> {
    fn accuracy(&self) -> &Accuracy {
        &self.run.outcome.classes
    }
}

/// Pixels by class, and the errors of the reused ones.
pub fn classes(entries: &[Entry]) -> Table {
    let runs = rule_rows(entries);
    let pixels = |key, name, value: fn(&ClassCounts) -> u64| {
        Column::new(key, name, "px", Show::Whole, move |r: &ClassRow| {
            value(r.counts)
        })
    };
    let columns = [
        Column::text("scene", "scene", |r: &ClassRow| scene_name(r.run.report)),
        Column::text("run", "rule", |r: &ClassRow| r.run.run),
        Column::text("class", "class", |r: &ClassRow| r.class),
        pixels("pixels", "pixels", |c| c.pixels),
        Column::real("share_pct", "share", "%", 2, |r: &ClassRow| {
            r.accuracy().pct(r.counts.pixels)
        }),
        pixels("wrong_object", "wrong object", |c| c.wrong_object),
        pixels("wrong_primitive", "other triangle, off > 1 px", |c| {
            c.wrong_primitive
        }),
        pixels("over_1px", "off > 1 px", |c| c.position_over_1px),
        pixels("over_2px", "off > 2 px", |c| c.position_over_2px),
    ];
    let rows: Vec<ClassRow> = runs
        .iter()
        .flat_map(|run| {
            let c = &run.outcome.classes;
            [
                ("reused", &c.reused),
                ("overlapped, nearest reused", &c.overlapped),
                ("missing, traced", &c.missing),
                ("bad, traced", &c.bad),
            ]
            .map(|(class, counts)| ClassRow { run, class, counts })
        })
        .collect();
    Table::new(&columns, &rows).grouped_by(2)
}

/// Energy of a rendering method.
struct EnergyRow<'a> {
    scene: String,
    run: &'static str,
    energy: &'a EnergyPj,
    whole_pj: f64,
}

/// Energy by component, relative to the reference's total.
pub fn energy(entries: &[Entry]) -> Table {
    let part = |key, name, value: fn(&EnergyPj) -> f64| {
        Column::real(key, name, "%", 1, move |r: &EnergyRow| {
            100.0 * value(r.energy) / r.whole_pj
        })
    };
    let columns = [
        Column::text("scene", "scene", |r: &EnergyRow| r.scene.clone()),
        Column::text("run", "run", |r: &EnergyRow| r.run),
        part("tni_pct", "units", |e| e.tni_pj),
        part("srp_pct", "cores", |e| e.srp_pj),
        part("caches_pct", "caches", |e| e.caches_pj),
        part("sram_pct", "tile buffers", |e| e.sram_pj),
        part("dram_pct", "DRAM", |e| e.dram_pj),
        part("static_pct", "static", |e| e.static_pj),
        part("sum_pct", "sum", EnergyPj::total),
    ];
    let both = |report| {
        let report: &Report = report;
        let o = &report.result;
        let runs = [
            ("both eyes in full", &o.reference_energy),
            ("chosen", &o.energy),
        ];
        runs.map(|(run, energy)| EnergyRow {
            scene: scene_name(report),
            run,
            energy,
            whole_pj: o.reference_energy.total(),
        })
    };
    let rows: Vec<EnergyRow> = entries.iter().flat_map(|e| both(&e.report)).collect();
    let mut table = Table::new(&columns, &rows).grouped_by(1);
    table.caption = "Energy by component, % of tracing both eyes in full";
    table
}

/// The points of the curve.
pub fn curve(report: &Report) -> Table {
    let columns = columns_of::<CurvePoint>()
        .text("rule", "rule", |p| p.rule.to_string())
        .text("reuse", "reused", |p| name(&p.reuse))
        .real("reuse_pct", "reuse", "%", 2, |p| p.reuse_pct)
        .real("wrong_object_pct", "wrong object", "%", 3, |p| {
            p.wrong_object_pct
        })
        .real("tni_reduction_pct", "unit cycles saved", "%", 1, |p| {
            p.tni_reduction_pct
        })
        .real("relative_performance", "performance", "ratio", 3, |p| {
            p.relative_performance
        })
        .real("relative_energy", "energy", "ratio", 3, |p| {
            p.relative_energy
        })
        .real("flip_mean", "FLIP mean", "", 5, |p| p.flip_mean)
        .real("flip_p99", "FLIP p99", "", 4, |p| p.flip_p99);
    Table::new(&columns, &report.curve).grouped_by(1)
}

/// Parameters, sorted by their effect on the ratios.
pub fn sensitivity(report: &Report) -> Table {
    let ratio = |key, name, value: fn(&Sensitivity) -> f64| {
        Column::real(key, name, "ratio", 3, move |s: &Sensitivity| value(s))
    };
    let columns = [
        Column::text("parameter", "parameter", |s: &Sensitivity| {
            s.parameter.clone()
        }),
        Column::new("value", "value", "", Show::Text, |s: &Sensitivity| s.value),
        ratio("performance_half", "performance, half", |s| {
            s.relative_performance[0]
        }),
        ratio("performance_twice", "twice", |s| s.relative_performance[1]),
        ratio("energy_half", "energy, half", |s| s.relative_energy[0]),
        ratio("energy_twice", "twice", |s| s.relative_energy[1]),
    ];
    let o = &report.result;
    let effect = |s: &Sensitivity| {
        let off = |pair: [f64; 2], base: f64| pair.map(|v| (v - base).abs()).into_iter().sum();
        let performance: f64 = off(s.relative_performance, o.relative_performance);
        let energy: f64 = off(s.relative_energy, o.relative_energy);
        performance + energy
    };
    let mut rows: Vec<&Sensitivity> = report.sensitivity.iter().collect();
    rows.sort_by(|a, b| effect(b).total_cmp(&effect(a)));
    Table::new(&columns, rows)
}
