//! A sweep's results: rows, table, CSV and page.

use super::plan::{Axis, Experiment, Point, plain};
use super::run::SweepOutcome;
use super::store::point_key;
use crate::config::{Order, RunConfig};
use crate::palette;
use crate::report::csv::Csv;
use crate::report::html::table::{Column, Table};
use crate::report::html::{self, Section, figures, folded};
use crate::report::plots::bars::{BarChart, BarGroup};
use crate::report::plots::hbars::HBarChart;
use crate::report::plots::{PlotError, SeriesStyle};
use crate::report::theme;
use crate::report::z2::experiment::{Subject, frames_of};
use crate::report::z2::model::BYTES_PER_MB;
use crate::result::{RunResult, TraceId};
use maud::html;
use serde::{Deserialize, Serialize};
use toml::Value;

/// Schema of a sweep's JSON.
pub const SWEEP_SCHEMA: &str = "replay.sweep/1";

/// The key whose Morton value the others are held against.
const ORDER: &str = "order";

/// A point of a trace.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepRow {
    /// The trace's label.
    pub scene: String,
    /// Values of the axes, in their order.
    pub settings: Vec<(String, Value)>,
    /// The value tried alone.
    pub change: Option<(String, Value)>,
    /// Name of the point's file, which holds the whole configuration and result.
    pub point: String,
    /// L1 miss rate, percent.
    pub l1_miss_pct: f64,
    /// L2 miss rate, percent.
    pub l2_miss_pct: f64,
    /// TMU utilisation, percent; none in functional mode.
    pub tmu_util_pct: Option<f64>,
    /// External traffic, all frames.
    pub external_bytes: u64,
    /// External traffic, MB (10^6 bytes) a frame.
    pub external_mb_per_frame: f64,
    /// An infinite cache's traffic, MB a frame.
    pub bound_mb_per_frame: f64,
    /// Traffic saved against Morton with everything else equal, percent.
    pub reduction_pct: Option<f64>,
    /// Traffic over that of the same axis values without the change.
    pub over_base: Option<f64>,
}

/// A sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepReport {
    /// `replay.sweep/1`.
    pub schema: String,
    /// Program and version.
    pub tool: String,
    /// Labels and traces.
    pub traces: Vec<(String, TraceId)>,
    /// The base configuration.
    pub base: RunConfig,
    /// Crossed axes.
    pub axes: Vec<Axis>,
    /// Axes tried one value at a time.
    pub one_at_a_time: Vec<Axis>,
    /// Rows: by trace, change, axis values.
    pub rows: Vec<SweepRow>,
}

impl SweepReport {
    /// Puts results into rows.
    #[must_use]
    pub fn new(
        experiment: &Experiment,
        subjects: &[Subject],
        points: &[Point],
        outcome: &SweepOutcome,
    ) -> Self {
        let mut rows = Vec::new();
        for (subject, results) in subjects.iter().zip(&outcome.results) {
            let frames = f64::from(frames_of(subject.source.tables()).max(1));
            for (point, result) in points.iter().zip(results) {
                let bytes_where = |wanted: &dyn Fn(&Point) -> bool| {
                    points
                        .iter()
                        .zip(results)
                        .find(|(p, _)| wanted(p))
                        .map(|(_, r)| r.external_bytes as f64)
                };
                let morton = point
                    .settings
                    .iter()
                    .any(|(key, _)| key == ORDER)
                    .then(|| bytes_where(&|p| p.change == point.change && is_morton_of(p, point)))
                    .flatten();
                let base = point.change.as_ref().and_then(|_| {
                    bytes_where(&|p| p.change.is_none() && p.settings == point.settings)
                });
                rows.push(row(subject, point, result, frames, morton, base));
            }
        }
        Self {
            schema: SWEEP_SCHEMA.to_owned(),
            tool: concat!("replay ", env!("CARGO_PKG_VERSION")).to_owned(),
            traces: subjects
                .iter()
                .map(|s| (s.label.clone(), s.id.clone()))
                .collect(),
            base: experiment.base,
            axes: experiment.axes.clone(),
            one_at_a_time: experiment.one_at_a_time.clone(),
            rows,
        }
    }
}

fn is_morton_of(candidate: &Point, point: &Point) -> bool {
    candidate.config.order == Order::MORTON
        && candidate
            .settings
            .iter()
            .zip(&point.settings)
            .all(|(a, b)| a.0 == ORDER || a == b)
}

fn row(
    subject: &Subject,
    point: &Point,
    result: &RunResult,
    frames: f64,
    morton: Option<f64>,
    base: Option<f64>,
) -> SweepRow {
    let external = result.external_bytes as f64;
    let above_zero = |v: &f64| *v > 0.0;
    SweepRow {
        scene: subject.label.clone(),
        settings: point.settings.clone(),
        change: point.change.clone(),
        point: point_key(&subject.id, &point.config),
        l1_miss_pct: 100.0 * result.l1.miss_rate,
        l2_miss_pct: 100.0 * result.l2.miss_rate,
        tmu_util_pct: result.tmu.as_ref().map(|t| 100.0 * t.utilization),
        external_bytes: result.external_bytes,
        external_mb_per_frame: external / BYTES_PER_MB / frames,
        bound_mb_per_frame: result.unique_lines as f64 * f64::from(point.config.line_bytes)
            / BYTES_PER_MB
            / frames,
        reduction_pct: morton
            .filter(above_zero)
            .map(|m| 100.0 * (1.0 - external / m)),
        over_base: base.filter(above_zero).map(|b| external / b),
    }
}

fn change_title(change: Option<&(String, Value)>) -> String {
    change.map_or_else(
        || "base".to_owned(),
        |(key, value)| format!("{key} = {}", plain(value)),
    )
}

/// The rows as a table.
#[must_use]
pub fn table(report: &SweepReport) -> Table {
    let mut columns = vec![Column::text("scene")];
    columns.extend(report.axes.iter().map(|a| Column::text(a.key.clone())));
    if !report.one_at_a_time.is_empty() {
        columns.push(Column::text("change"));
    }
    columns.extend([
        Column::number("L1 miss", "%"),
        Column::number("L2 miss", "%"),
        Column::number("TMU", "%"),
        Column::number("external", "MB/frame"),
        Column::number("bound", "MB/frame"),
    ]);
    let by_order = report.rows.iter().any(|r| r.reduction_pct.is_some());
    if by_order {
        columns.push(Column::number("saved", "% of Morton"));
    }
    if !report.one_at_a_time.is_empty() {
        columns.push(Column::number("external", "\u{d7} base"));
    }
    let mut table = Table::new(columns);
    let mut group = None;
    let number = |value: Option<f64>, decimals: usize| {
        value.map_or_else(String::new, |v| format!("{v:.decimals$}"))
    };
    for row in &report.rows {
        let this = (&row.scene, &row.change);
        if group != Some(this) {
            table.begin_group();
            group = Some(this);
        }
        let mut cells = vec![row.scene.clone()];
        cells.extend(row.settings.iter().map(|(_, value)| plain(value)));
        if !report.one_at_a_time.is_empty() {
            cells.push(change_title(row.change.as_ref()));
        }
        cells.extend([
            number(Some(row.l1_miss_pct), 2),
            number(Some(row.l2_miss_pct), 2),
            number(row.tmu_util_pct, 2),
            number(Some(row.external_mb_per_frame), 2),
            number(Some(row.bound_mb_per_frame), 2),
        ]);
        if by_order {
            cells.push(number(row.reduction_pct, 1));
        }
        if !report.one_at_a_time.is_empty() {
            cells.push(number(row.over_base, 3));
        }
        table.push(cells);
    }
    table
}

/// The rows in full precision.
#[must_use]
pub fn csv(report: &SweepReport) -> String {
    let mut names = vec!["scene"];
    names.extend(report.axes.iter().map(|a| a.key.as_str()));
    names.extend([
        "change",
        "point",
        "l1_miss_pct",
        "l2_miss_pct",
        "tmu_util_pct",
        "external_bytes",
        "external_mb_per_frame",
        "bound_mb_per_frame",
        "reduction_pct",
        "over_base",
    ]);
    let mut csv = Csv::new(&names);
    for row in &report.rows {
        let mut line = csv.row().text(&row.scene);
        for (_, value) in &row.settings {
            line = line.text(&plain(value));
        }
        let _ended = line
            .text(&change_title(row.change.as_ref()))
            .text(&row.point)
            .value(row.l1_miss_pct)
            .value(row.l2_miss_pct)
            .maybe(row.tmu_util_pct)
            .value(row.external_bytes)
            .value(row.external_mb_per_frame)
            .value(row.bound_mb_per_frame)
            .maybe(row.reduction_pct)
            .maybe(row.over_base);
    }
    csv.finish()
}

/// What one trace's charts look up: external traffic in MB a frame.
struct Lookup<'a> {
    report: &'a SweepReport,
    scene: &'a str,
    /// Values of the order axis; empty where the order is no axis.
    orders: Vec<Value>,
}

impl<'a> Lookup<'a> {
    fn new(report: &'a SweepReport, scene: &'a str) -> Self {
        let orders = report.axes.iter().find(|a| a.key == ORDER);
        Self {
            report,
            scene,
            orders: orders.map_or_else(Vec::new, |a| a.values.clone()),
        }
    }

    /// One series an order, or a single one.
    fn series(&self) -> Vec<SeriesStyle> {
        if self.orders.is_empty() {
            return vec![SeriesStyle::nth("external traffic", 2)];
        }
        let style = |o: &Value| SeriesStyle {
            name: plain(o),
            color: theme::color(Order::find(&plain(o)).map_or(palette::GREY, Order::color)),
        };
        self.orders.iter().map(style).collect()
    }

    /// One value a series; axes that are not named are at their first value.
    fn values(
        &self,
        axis: Option<(&str, &Value)>,
        change: &Option<(String, Value)>,
    ) -> Vec<Option<f64>> {
        let with = |order: Option<&Value>| {
            let named: Vec<(&str, &Value)> =
                axis.into_iter().chain(order.map(|o| (ORDER, o))).collect();
            let matches = |row: &&SweepRow| {
                row.scene == self.scene
                    && row.change == *change
                    && row
                        .settings
                        .iter()
                        .zip(&self.report.axes)
                        .all(|((key, value), axis)| {
                            let wanted = named.iter().find(|(k, _)| k == key).map(|(_, v)| *v);
                            wanted.or(axis.values.first()) == Some(value)
                        })
            };
            self.report
                .rows
                .iter()
                .find(matches)
                .map(|r| r.external_mb_per_frame)
        };
        if self.orders.is_empty() {
            return vec![with(None)];
        }
        self.orders.iter().map(|o| with(Some(o))).collect()
    }
}

const VALUE_LABEL: &str = "external texture traffic, MB per frame";

/// A row for the base and one for each single change.
fn change_chart(report: &SweepReport, scene: &str) -> Option<HBarChart> {
    let lookup = Lookup::new(report, scene);
    let changes = report.one_at_a_time.iter().flat_map(|axis| {
        axis.values
            .iter()
            .map(|v| Some((axis.key.clone(), v.clone())))
    });
    (!report.one_at_a_time.is_empty()).then(|| HBarChart {
        title: format!("{scene}: one change at a time"),
        value_label: VALUE_LABEL.to_owned(),
        series: lookup.series(),
        rows: std::iter::once(None)
            .chain(changes)
            .map(|change| (change_title(change.as_ref()), lookup.values(None, &change)))
            .collect(),
        decimals: Some(2),
    })
}

/// A chart for each axis but the order, the other axes at their first value.
fn axis_charts(report: &SweepReport, scene: &str) -> Vec<BarChart> {
    let lookup = Lookup::new(report, scene);
    report
        .axes
        .iter()
        .filter(|a| a.key != ORDER && a.values.len() > 1)
        .map(|axis| BarChart {
            title: format!("{scene}: {}", axis.key),
            value_label: VALUE_LABEL.to_owned(),
            group_label: axis.key.clone(),
            series: lookup.series(),
            groups: axis
                .values
                .iter()
                .map(|v| BarGroup {
                    label: plain(v),
                    values: lookup.values(Some((&axis.key, v)), &None),
                    marks: Vec::new(),
                })
                .collect(),
            decimals: Some(1),
            ..BarChart::default()
        })
        .collect()
}

/// The sweep as a page.
///
/// # Errors
/// A plot that cannot be drawn.
pub fn page(title: &str, report: &SweepReport) -> Result<String, PlotError> {
    let mut pictures = Vec::new();
    for (label, _) in &report.traces {
        if let Some(chart) = change_chart(report, label) {
            pictures.push((chart.svg()?, String::new()));
        }
        for chart in axis_charts(report, label) {
            pictures.push((chart.svg()?, String::new()));
        }
    }
    let base = toml::to_string(&report.base).unwrap_or_default();
    let lead = html! {
        p {
            (report.rows.len()) " points over " (report.traces.len()) @if report.traces.len() == 1 { " trace. " } @else { " traces. " }
            "The same numbers are in the JSON and CSV files next to this page; each point's whole configuration and result is in points/."
        }
    };
    let sections = [
        Section::new("Charts", figures(&pictures)),
        Section::new("Results", table(report).markup()),
        Section::new(
            "Traces",
            html! {
                ul { @for (label, id) in &report.traces { li { (label) ": " (id.scene) ", checksum " (id.checksum) } } }
            },
        ),
        Section::new("Base configuration", folded("TOML", &base)),
    ];
    Ok(html::page(title, &lead, &sections))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> SweepReport {
        let experiment = Experiment::parse(
            "[axes]\norder = [\"morton\", \"z2-sta\"]\n[one-at-a-time]\nsampling.helper_lanes = [true]\n",
        )
        .unwrap();
        let row =
            |order: &str, change: bool, bytes: u64, reduction: f64, over: Option<f64>| SweepRow {
                scene: "a,b".into(),
                settings: vec![("order".into(), Value::String(order.into()))],
                change: change.then(|| ("sampling.helper_lanes".into(), Value::Boolean(true))),
                point: "00".into(),
                l1_miss_pct: 12.5,
                l2_miss_pct: 50.0,
                tmu_util_pct: None,
                external_bytes: bytes,
                external_mb_per_frame: bytes as f64 / 1e6,
                bound_mb_per_frame: 1.0,
                reduction_pct: Some(reduction),
                over_base: over,
            };
        SweepReport {
            schema: SWEEP_SCHEMA.into(),
            tool: "replay".into(),
            traces: vec![("a,b".into(), TraceId::default())],
            base: experiment.base,
            axes: experiment.axes.clone(),
            one_at_a_time: experiment.one_at_a_time.clone(),
            rows: vec![
                row("morton", false, 4_000_000, 0.0, None),
                row("z2-sta", false, 3_000_000, 25.0, None),
                row("morton", true, 4_400_000, 0.0, Some(1.1)),
                row("z2-sta", true, 3_300_000, 25.0, Some(1.1)),
            ],
        }
    }

    #[test]
    fn csv_and_table_show_the_same_numbers() {
        let report = report();
        let csv = csv(&report);
        assert_eq!(
            csv.lines().nth(2).unwrap(),
            "\"a,b\",z2-sta,base,00,12.5,50,,3000000,3,1,25,"
        );
        let table = table(&report);
        assert_eq!(
            table.rows[3],
            [
                "a,b",
                "z2-sta",
                "sampling.helper_lanes = true",
                "12.50",
                "50.00",
                "",
                "3.30",
                "1.00",
                "25.0",
                "1.100"
            ]
        );
    }

    #[test]
    fn the_chart_of_changes_has_the_orders_as_series() {
        let chart = change_chart(&report(), "a,b").unwrap();
        assert_eq!(chart.series.len(), 2);
        assert_eq!(chart.rows[1].1, [Some(4.4), Some(3.3)]);
        assert!(axis_charts(&report(), "a,b").is_empty());
    }

    #[test]
    fn the_page_is_the_same_every_time() {
        let report = report();
        assert_eq!(page("t", &report).unwrap(), page("t", &report).unwrap());
    }
}
