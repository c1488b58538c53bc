//! A sweep's results: rows, table, CSV and page.

use super::answers;
use super::columns::{Column, Columns, PointColumn, columns_of};
use super::config_columns;
use super::document::Document;
use super::errors;
use super::figures::{figure, figures, number};
use super::html::{self, Answer, Page, settings};
use super::lists::unique;
use super::plots::bars::{BarChart, BarGroup};
use super::plots::hbars::HBarChart;
use super::plots::lines::{self, Doublings, LineChart, LineSeries};
use super::plots::{PlotError, SeriesStyle};
use super::table::{Style, Table};
use super::theme;
use maud::html;
use serde::Serialize;
use sim::config::{Order, RunConfig};
use sim::palette;
use sim::result::TraceId;
use sim::size::format_bytes;
use studies::experiment::{
    Axis, ExperimentFile, Outcome, ResultRow, Setting, Subject, frame_count, plain, point_key,
};
use toml::Value;

const ORDER: &str = "order";
const TRAFFIC: &str = "external_mb_per_frame";

/// The results of a sweep, sorted by trace, change and axis values.
pub struct SweepReport<'a> {
    file: &'a ExperimentFile,
    outcome: &'a Outcome<'a>,
    rows: Vec<ResultRow<'a>>,
}

/// A trace and its label in the rows.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct LabelledTrace<'a> {
    label: &'a str,
    trace: &'a TraceId,
}

impl<'a> LabelledTrace<'a> {
    pub(super) fn of(subject: &'a Subject<'_>) -> Self {
        Self {
            label: &subject.label,
            trace: &subject.id,
        }
    }
}

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct SweepJson<'a> {
    traces: Vec<LabelledTrace<'a>>,
    base: RunConfig,
    axes: &'a [Axis],
    one_at_a_time: &'a [Axis],
    rows: Table,
}

fn change_title(change: Option<&Setting>) -> String {
    change.map_or_else(
        || "base".to_owned(),
        |(key, value)| format!("{key} = {}", plain(value)),
    )
}

impl<'a> SweepReport<'a> {
    /// The outcome of a file's plan.
    pub fn new(file: &'a ExperimentFile, outcome: &'a Outcome<'a>) -> Self {
        Self {
            file,
            outcome,
            rows: outcome.rows(),
        }
    }

    /// The columns of every file: those that identify a row, then its figures.
    fn columns() -> Vec<PointColumn<'a>> {
        let mut columns = config_columns::trace();
        columns.extend(config_columns::config());
        columns.extend(config_columns::change());
        columns.push(
            PointColumn::text("point", "point", |r| {
                point_key(&r.subject.id, &r.point.config)
            })
            .about("key of the point's row in points/"),
        );
        columns.extend(figures());
        columns
    }

    /// Values of an axis as written in the experiment file.
    fn written(i: usize, axis: &Axis) -> PointColumn<'a> {
        Column::text(axis.key.clone(), axis.key.clone(), move |r: &ResultRow| {
            r.point.settings.get(i).map(|(_, value)| plain(value))
        })
    }

    /// The rows as a table, grouped by trace and change.
    fn table(&self, for_terminal: bool) -> Table {
        let mut columns =
            columns_of::<ResultRow>().text("label", "scene", |r| r.subject.label.clone());
        if !self.file.one_at_a_time.is_empty() {
            columns.push(PointColumn::text("change", "change", |r| {
                change_title(r.point.change.as_ref())
            }));
        }
        let axes = self.file.axes.iter().enumerate();
        columns.extend(axes.map(|(i, axis)| Self::written(i, axis)));
        let groups = 1 + usize::from(!self.file.one_at_a_time.is_empty());
        let shown = [
            "l1_footprint_miss_pct",
            "l2_line_miss_pct",
            "tmu_util_pct",
            TRAFFIC,
            "bound_mb_per_frame",
            "reduction_pct",
            "over_base",
        ];
        let shown = shown
            .iter()
            .filter(|key| !(for_terminal && **key == "tmu_util_pct"));
        columns.extend(super::columns::pick(&shown.copied().collect::<Vec<_>>()));
        let table = Table::new(&columns, &self.rows).grouped_by(groups);
        table.without_empty_columns()
    }

    /// The sweep as a page.
    ///
    /// # Errors
    /// A plot that cannot be drawn.
    pub fn page(&self, title: &str) -> Result<String, PlotError> {
        let subjects = self.outcome.subjects;
        let mut pictures = Vec::new();
        for subject in subjects {
            let charts = Charts::new(self, &subject.label);
            pictures.extend(charts.axes()?);
            if !self.file.one_at_a_time.is_empty() {
                pictures.push((charts.changes().svg()?, charts.fixed(None)));
            }
        }
        let about = html! {
            p {
                (self.rows.len()) " points over " (subjects.len()) @if subjects.len() == 1 { " trace. " } @else { " traces. " }
                "The same numbers are in the JSON and CSV files next to this page. The folder points/ has the configuration and result of each point."
            }
        };
        let traces = html! {
            ul { @for s in subjects { li { (s.label) ": " (s.id.scene) ", checksum " (s.id.checksum) } } }
        };
        let mut page = Page::default();
        page.add("Charts", html::figures(&pictures));
        page.add("Results", self.table(false).markup());
        page.add("Traces", traces);
        page.add("Base configuration", settings("TOML", &self.file.base));
        let chart = match pictures.first() {
            Some((svg, caption)) => html::figure(svg, caption),
            None => html! {},
        };
        let answer = Answer {
            sentences: self.answer(),
            chart,
            about,
        };
        Ok(page.text(title, &answer))
    }
}

impl Document for SweepReport<'_> {
    const SCHEMA: &'static str = "replay.sweep/3";
    const INDENTED: bool = false;

    fn content(&self) -> impl Serialize {
        let subjects = self.outcome.subjects.iter();
        SweepJson {
            traces: subjects.map(LabelledTrace::of).collect(),
            base: self.file.base,
            axes: &self.file.axes,
            one_at_a_time: &self.file.one_at_a_time,
            rows: self.rows(),
        }
    }

    fn rows(&self) -> Table {
        Table::new(&Self::columns(), &self.rows)
    }

    #[cfg(feature = "testing")]
    fn tables() -> Vec<(&'static str, Table)> {
        vec![("rows", Table::new(&Self::columns(), []))]
    }

    fn answer(&self) -> Vec<String> {
        self.sentences()
    }

    fn text(&self, style: Style) -> String {
        self.table(true).styled(style)
    }
}

impl SweepReport<'_> {
    /// The smallest L2 whose traffic, with the best other settings, is within 5 % of the least; none unless the L2
    /// is varied. Traffic is summed over the traces.
    fn smallest_l2(&self) -> Option<String> {
        const NEAR: f64 = 1.05;
        let l2 = |row: &ResultRow| row.point.config.level.l2.size_bytes;
        let titles = unique(self.rows.iter().map(|row| row.point.title()));
        let sums = titles.into_iter().filter_map(|title| {
            let own = || self.rows.iter().filter(|row| row.point.title() == title);
            let sum: f64 = own().filter_map(|row| number(row, TRAFFIC)).sum();
            Some((l2(own().next()?), sum, title.clone()))
        });
        let sums: Vec<(u64, f64, String)> = sums.collect();
        let [smallest, largest] = [
            sums.iter().map(|s| s.0).min()?,
            sums.iter().map(|s| s.0).max()?,
        ];
        let least = sums.iter().map(|s| s.1).min_by(f64::total_cmp)?;
        let near = sums.iter().filter(|s| s.1 <= NEAR * least);
        let best = near.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))?;
        let traces = self.outcome.subjects.len() as f64;
        (smallest < largest).then(|| {
            format!(
                "The smallest L2 within 5 % of the least traffic has {}: {:.2} MB per frame (known errors: {:.1} %; {}).",
                format_bytes(best.0),
                best.1 / traces,
                errors::sum_of_largest("external_bytes"),
                best.2
            )
        })
    }

    fn sentences(&self) -> Vec<String> {
        let several = self.outcome.subjects.len() > 1;
        let point = |row: &ResultRow| {
            let place = if several {
                format!("{}: ", row.subject.label)
            } else {
                String::new()
            };
            Some((
                format!("{place}{}", row.point.title()),
                number(row, TRAFFIC)?,
            ))
        };
        let points: Vec<(String, f64)> = self.rows.iter().filter_map(point).collect();
        let effect = |(index, axis): (usize, &Axis)| {
            let mean = |value: &Value| {
                let own = self.rows.iter().filter(|row| {
                    let own = row.point.settings.get(index).map(|(_, own)| own);
                    row.point.change.is_none() && own == Some(value)
                });
                let all: Vec<f64> = own.filter_map(|row| number(row, TRAFFIC)).collect();
                let mean = all.iter().sum::<f64>() / all.len() as f64;
                (!all.is_empty()).then(|| (plain(value), mean))
            };
            (
                axis.key.clone(),
                axis.values.iter().filter_map(mean).collect(),
            )
        };
        let effects: Vec<_> = self.file.axes.iter().enumerate().map(effect).collect();
        let mut out: Vec<String> = self.smallest_l2().into_iter().collect();
        out.extend(answers::sweep(&points, &effects));
        let caches = self.rows.iter().map(|row| {
            let level = &row.point.config.level;
            [level.l1.size_bytes, level.l2.size_bytes]
        });
        let subjects = self.outcome.subjects.iter();
        let frames: Vec<u32> = subjects.map(|s| frame_count(s.source.tables())).collect();
        out.insert(1, answers::machine(&self.file.base, caches, &frames));
        out
    }
}

/// The number that an axis's value stands for, and whether it has a unit of bytes.
fn numeric(value: &Value) -> Option<(f64, bool)> {
    match value {
        Value::Integer(number) => Some((*number as f64, false)),
        Value::Float(number) => Some((*number, false)),
        Value::String(text) => {
            let bytes = sim::size::parse_bytes(text).ok()?;
            Some((bytes as f64, true))
        }
        _ => None,
    }
}

fn value_label() -> String {
    figure(TRAFFIC).map_or_else(String::new, |f| f.heading.axis_label())
}

/// The charts of one trace: external traffic in MB per frame.
struct Charts<'a> {
    report: &'a SweepReport<'a>,
    scene: &'a str,
    rows: Vec<&'a ResultRow<'a>>,
    /// Values of the order axis; empty if there is none.
    orders: &'a [Value],
}

impl<'a> Charts<'a> {
    fn new(report: &'a SweepReport<'a>, scene: &'a str) -> Self {
        let orders = report.file.axes.iter().find(|a| a.key == ORDER);
        let rows = report.rows.iter();
        Self {
            report,
            scene,
            rows: rows.filter(|r| r.subject.label == scene).collect(),
            orders: orders.map_or(&[], |a| &a.values),
        }
    }

    /// One series per order, or a single one.
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

    /// One value per series. Other axes are at their first value.
    fn values(&self, axis: Option<(&str, &Value)>, change: Option<&Setting>) -> Vec<Option<f64>> {
        let with = |order: Option<&Value>| {
            let named = |key: &str| {
                let order = order.filter(|_| key == ORDER);
                order.or(axis.filter(|(k, _)| *k == key).map(|(_, value)| value))
            };
            let axes = &self.report.file.axes;
            let matches = |row: &&&ResultRow| {
                let mut settings = row.point.settings.iter().zip(axes);
                row.point.change.as_ref() == change
                    && settings.all(|((key, value), axis)| {
                        named(key).or(axis.values.first()) == Some(value)
                    })
            };
            number(self.rows.iter().find(matches)?, TRAFFIC)
        };
        if self.orders.is_empty() {
            return vec![with(None)];
        }
        self.orders.iter().map(|o| with(Some(o))).collect()
    }

    /// A chart with one row for the base and one for each single change.
    fn changes(&self) -> HBarChart {
        let axes = self.report.file.one_at_a_time.iter();
        let changes: Vec<Setting> = axes
            .flat_map(|axis| axis.values.iter().map(|v| (axis.key.clone(), v.clone())))
            .collect();
        let row = |change| (change_title(change), self.values(None, change));
        HBarChart {
            title: format!("{}: one change at a time", self.scene),
            value_label: value_label(),
            series: self.series(),
            rows: std::iter::once(None)
                .chain(changes.iter().map(Some))
                .map(row)
                .collect(),
            decimals: Some(2),
        }
    }

    /// The settings that a chart of this axis holds fixed.
    fn fixed(&self, axis: Option<&str>) -> String {
        let varies = |key: &str| Some(key) == axis || (key == ORDER && !self.orders.is_empty());
        let axes = self.report.file.axes.iter();
        let fixed: Vec<String> = axes
            .filter(|a| !varies(&a.key))
            .filter_map(|a| Some(format!("{} = {}", a.key, plain(a.values.first()?))))
            .collect();
        match fixed.is_empty() {
            true => "Held fixed: the base configuration.".to_owned(),
            false => format!(
                "Held fixed: {}; all else as in the base configuration.",
                fixed.join(", ")
            ),
        }
    }

    /// A chart for each axis except the order, with the other axes at their first value: lines over
    /// numbers, bars over names.
    fn axes(&self) -> Result<Vec<(String, String)>, PlotError> {
        let axes = self.report.file.axes.iter();
        axes.filter(|a| a.key != ORDER && a.values.len() > 1)
            .map(|axis| {
                let numbers: Option<Vec<_>> = axis.values.iter().map(numeric).collect();
                let svg = match numbers {
                    Some(numbers) => self.lines(axis, &numbers).svg()?,
                    None => self.bars(axis).svg()?,
                };
                Ok((svg, self.fixed(Some(&axis.key))))
            })
            .collect()
    }

    fn lines(&self, axis: &Axis, numbers: &[(f64, bool)]) -> LineChart {
        let values: Vec<Vec<Option<f64>>> = (axis.values.iter())
            .map(|v| self.values(Some((&axis.key, v)), None))
            .collect();
        let series = |(index, style): (usize, SeriesStyle)| {
            let points = numbers.iter().zip(&values);
            let mut points: Vec<(f64, f64)> = points
                .filter_map(|((at, _), values)| Some((*at, values[index]?)))
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            LineSeries::line(style, points)
        };
        let ends = |of: fn(f64, f64) -> f64| numbers.iter().map(|n| n.0).reduce(of).unwrap_or(0.0);
        let (low, high) = (ends(f64::min), ends(f64::max));
        let is_bytes = numbers.iter().all(|n| n.1) || axis.key.ends_with("_bytes");
        let x = match (low > 0.0 && high >= 4.0 * low, is_bytes) {
            (true, true) => lines::Axis::doublings(axis.key.clone(), Doublings::Bytes),
            (true, false) => lines::Axis::doublings(axis.key.clone(), Doublings::Numbers),
            (false, _) => lines::Axis::linear(axis.key.clone()),
        };
        LineChart {
            title: format!("{}: {}", self.scene, axis.key),
            x,
            y: lines::Axis::linear(value_label()),
            series: self.series().into_iter().enumerate().map(series).collect(),
        }
    }

    fn bars(&self, axis: &Axis) -> BarChart {
        BarChart {
            title: format!("{}: {}", self.scene, axis.key),
            value_label: value_label(),
            group_label: axis.key.clone(),
            series: self.series(),
            groups: (axis.values.iter())
                .map(|v| BarGroup {
                    label: plain(v),
                    values: self.values(Some((&axis.key, v)), None),
                    ..BarGroup::default()
                })
                .collect(),
            decimals: Some(2),
            ..BarChart::default()
        }
    }
}
