//! The Z2 paper's experiment: its rows, their averages and their checks (`replay.paper/3`).

use crate::columns::{Column, Columns, PointColumn, Row, Value, columns_of};
use crate::document::Document;
use crate::errors::{self, KnownError, Of};
use crate::figures::number;
use crate::lists::{mean, unique};
use crate::table::{Style, Table};
use crate::z2::{page, tables};
use formats::textrace::TraceMeta;
use serde::Serialize;
use sim::config::{Order, RunConfig};
use sim::paper::z2::{self, PublishedRow};
use sim::result::{Part, TileMap, TraceId};
use studies::experiment::{Outcome, ResultRow, Subject, frame_count};

/// A trace of the experiment.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct TraceInfo {
    /// Short name in tables.
    pub label: String,
    /// Scene name and checksum.
    pub trace: TraceId,
    /// Scene of the paper that it stands for.
    #[serde(rename = "twin")]
    pub stand_in_for: Option<&'static str>,
    /// Frames in the trace.
    pub frames: u32,
    /// Quads of the trace.
    pub quads: u64,
    /// Number of covered lanes.
    pub lanes: u64,
    /// Footprints under the base configuration.
    pub footprints: u64,
    /// Number of textures in the table.
    pub textures: usize,
    /// Tile columns and rows of a main view.
    pub tiles: [u32; 2],
    /// Render passes of the first frame's left and right eye.
    pub eye_passes: Vec<u32>,
    /// Description from the trace.
    #[cfg_attr(feature = "testing", schemars(with = "sim::schemas::Meta"))]
    pub meta: TraceMeta,
}

/// Means over scenes and cache configurations for one order.
#[derive(Clone, Debug, PartialEq)]
pub struct Average {
    /// A scene's label, or `all scenes`.
    pub scene: String,
    /// Order.
    pub order: Order,
    /// Mean traffic saved against Morton, percent.
    pub reduction_pct: f64,
    /// Mean utilisation over that in Morton order; `None` in functional mode.
    pub tmu_ratio: Option<f64>,
    /// The paper's mean reduction, for the corresponding scene or over all its scenes.
    pub paper_reduction_pct: Option<f64>,
    /// The paper's mean ratio.
    pub paper_tmu_ratio: Option<f64>,
}

impl Row for Average {
    #[rustfmt::skip]
    fn columns() -> Vec<Column<'static, Self>> {
        columns_of::<Self>()
            .text("scene", "mean over cache sizes", |a| a.scene.clone())
            .text("order", "order", |a| Value::Named(a.order.name(), a.order.title()))
            .real("reduction_pct", "saved", "% of Morton", 1, |a| a.reduction_pct)
            .real("tmu_ratio", "TMU", "\u{d7} Morton", 3, |a| a.tmu_ratio)
            .real("paper_reduction_pct", "paper saved", "% of Morton", 1, |a| a.paper_reduction_pct).published()
            .real("paper_tmu_ratio", "paper TMU", "\u{d7} Morton", 3, |a| a.paper_tmu_ratio).published()
    }
}

/// Deviation of the utilisation from the surface of the paper's table, on the machine of
/// `--preset z2-paper`, which counts rates as the paper does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Deviation {
    /// Mean absolute deviation, points.
    pub mean_absolute_points: f64,
    /// Largest absolute deviation, points.
    pub largest_points: f64,
    /// Rows of that machine.
    pub rows: usize,
}

/// Whether every run of a trace replayed the same multiset of accesses.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Conservation {
    /// The trace's label.
    pub scene: String,
    /// Hash of the first run.
    pub access_hash: String,
    /// Runs compared.
    pub runs: usize,
    /// Runs whose hash differs, as `8/128 KiB z2-sta`.
    pub differing: Vec<String>,
}

/// The whole experiment.
pub struct PaperReport<'a> {
    /// The base configuration; each row has its own caches and order.
    pub config: RunConfig,
    /// Traces.
    pub traces: Vec<TraceInfo>,
    /// Rows: by trace, cache configuration, order.
    pub rows: Vec<ResultRow<'a>>,
    /// Means.
    pub averages: Vec<Average>,
    /// Utilisation compared with the paper's surface.
    pub closed_form: Deviation,
    /// Conservation check.
    pub conservation: Vec<Conservation>,
}

impl<'a> PaperReport<'a> {
    /// Builds the rows from an outcome of [`Plan::paper`](studies::experiment::Plan::paper).
    pub fn new(outcome: &'a Outcome<'a>) -> Self {
        let mut rows = outcome.rows();
        rows.retain(|row| row.point.change.is_none());
        let of_trace = |index: usize| {
            let label = &outcome.subjects[index].label;
            rows.iter().filter(move |r| r.subject.label == *label)
        };
        let subjects = outcome.subjects.iter();
        let traces: Vec<TraceInfo> = subjects
            .enumerate()
            .map(|(i, s)| info(s, of_trace(i).next()))
            .collect();
        let conservation = traces
            .iter()
            .enumerate()
            .map(|(i, t)| conservation(&t.label, of_trace(i)))
            .collect();
        let mut report = Self {
            config: outcome.plan.base,
            closed_form: deviation(&rows),
            conservation,
            traces,
            rows,
            averages: Vec::new(),
        };
        report.averages = report.means();
        report
    }

    /// Names the traces whose orders replayed different accesses; `None` when there are none.
    pub fn not_conserved(&self) -> Option<String> {
        let wrong = self.conservation.iter().filter(|c| !c.differing.is_empty());
        let wrong: Vec<String> = wrong
            .map(|c| format!("{}: {}", c.scene, c.differing.join(", ")))
            .collect();
        (!wrong.is_empty())
            .then(|| format!("orders replayed different accesses: {}", wrong.join("; ")))
    }

    /// The orders of the experiment in order of appearance.
    pub fn orders(&self) -> Vec<Order> {
        unique(self.rows.iter().map(|r| r.point.config.order))
    }

    /// The cache configurations, as `8/128`, in order of appearance.
    pub fn caches(&self) -> Vec<String> {
        unique(self.rows.iter().map(ResultRow::caches_title))
    }

    /// The row of a scene, a cache configuration and an order.
    pub fn row(&self, scene: &str, caches: &str, order: Order) -> Option<&ResultRow<'a>> {
        self.rows.iter().find(|r| {
            r.subject.label == scene && r.caches_title() == caches && r.point.config.order == order
        })
    }

    /// A trace's rows with the first cache configuration, one per order; the page shows their details.
    pub fn details(&self, scene: &str) -> Vec<&ResultRow<'a>> {
        let mut of_scene = self.rows.iter().filter(|r| r.subject.label == scene);
        let first = of_scene.clone().next().map(ResultRow::caches_kib);
        of_scene
            .by_ref()
            .filter(|r| Some(r.caches_kib()) == first)
            .collect()
    }

    /// Means per scene, then over all scenes if there are several, for every order except the baseline.
    fn means(&self) -> Vec<Average> {
        let average = |scene: Option<&TraceInfo>, order: Order| {
            let mean_of = |figure: &str| {
                let rows = self.rows.iter().filter(|r| {
                    r.point.config.order == order
                        && scene.is_none_or(|s| s.label == r.subject.label)
                });
                mean(rows.filter_map(|r| number(r, figure)))
            };
            let published = || {
                z2::table().iter().filter(move |row| {
                    let of_scene = scene.is_none_or(|s| s.stand_in_for == Some(row.scene.as_str()));
                    row.order == order && of_scene
                })
            };
            Some(Average {
                scene: scene.map_or_else(|| "all scenes".to_owned(), |s| s.label.clone()),
                order,
                reduction_pct: mean_of("reduction_pct")?,
                tmu_ratio: mean_of("tmu_ratio"),
                paper_reduction_pct: mean(published().filter_map(PublishedRow::reduction_pct)),
                paper_tmu_ratio: mean(published().filter_map(PublishedRow::tmu_ratio)),
            })
        };
        let mut orders = self.orders();
        orders.retain(|order| *order != Order::MORTON);
        let overall = (self.traces.len() > 1).then_some(None);
        let scenes = self.traces.iter().map(Some).chain(overall);
        scenes
            .flat_map(|scene| {
                orders
                    .iter()
                    .filter_map(move |&order| average(scene, order))
            })
            .collect()
    }

    /// The figures of the experiment, without those of a change against a base.
    fn figures() -> Vec<PointColumn<'a>> {
        let mut columns = ResultRow::columns();
        columns.retain(|c| !matches!(c.heading.key.as_ref(), "over_base" | "caches"));
        columns
    }
}

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct PaperJson<'a> {
    config: &'a RunConfig,
    traces: &'a [TraceInfo],
    rows: Table,
    averages: Table,
    closed_form: Deviation,
    conservation: &'a [Conservation],
    /// What is known of the figures' errors.
    errors: Vec<&'static KnownError>,
    details: Vec<Detail<'a>>,
}

impl Document for PaperReport<'_> {
    const SCHEMA: &'static str = "replay.paper/3";
    const HAS_DETAILS: bool = true;
    const INDENTED: bool = false;

    fn content(&self) -> impl Serialize {
        let details = self.traces.iter().flat_map(|t| self.details(&t.label));
        PaperJson {
            config: &self.config,
            traces: &self.traces,
            rows: self.rows(),
            averages: Table::new(&Average::columns(), &self.averages),
            closed_form: self.closed_form,
            conservation: &self.conservation,
            errors: errors::known(Of::Textures),
            details: details.map(Detail::new).collect(),
        }
    }

    fn rows(&self) -> Table {
        Table::new(&Self::figures(), &self.rows)
    }

    #[cfg(feature = "testing")]
    fn tables() -> Vec<(&'static str, Table)> {
        vec![
            ("rows", Table::new(&Self::figures(), [])),
            ("averages", Table::new(&Average::columns(), [])),
        ]
    }

    fn answer(&self) -> Vec<String> {
        page::sentences(self)
    }

    fn text(&self, style: Style) -> String {
        tables::text(self, style)
    }

    fn details(&self, style: Style) -> String {
        tables::details(self, style)
    }
}

/// Breakdown of a trace's traffic for one configuration and order.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Detail<'a> {
    scene: &'a str,
    l1_kib: f64,
    l2_kib: f64,
    order: Order,
    by_view: &'a [Part],
    by_texture: &'a [Part],
    by_level: &'a [Part],
    #[serde(skip_serializing_if = "<[Part]>::is_empty")]
    by_draw: &'a [Part],
    #[serde(skip_serializing_if = "<[TileMap]>::is_empty")]
    tile_maps: &'a [TileMap],
}

impl<'a> Detail<'a> {
    fn new(row: &'a ResultRow<'_>) -> Self {
        let (l1_kib, l2_kib) = row.caches_kib();
        Self {
            scene: &row.subject.label,
            l1_kib,
            l2_kib,
            order: row.point.config.order,
            by_view: &row.result.by_view,
            by_texture: &row.result.by_texture,
            by_level: &row.result.by_level,
            by_draw: &row.result.by_draw,
            tile_maps: &row.result.tile_maps,
        }
    }
}

fn info(subject: &Subject, row: Option<&ResultRow>) -> TraceInfo {
    let tables = subject.source.tables();
    let first_frame = tables.passes.iter().map(|p| p.frame).min().unwrap_or(0);
    let passes = tables.passes.iter().enumerate();
    let seen = passes.filter(|(_, p)| p.is_seen());
    let result = row.map(|r| r.result);
    TraceInfo {
        label: subject.label.clone(),
        trace: subject.id.clone(),
        stand_in_for: subject.stand_in_for,
        frames: frame_count(tables),
        quads: result.map_or(0, |r| r.quads),
        lanes: result.map_or(0, |r| r.lanes),
        footprints: result.map_or(0, |r| r.footprints),
        textures: tables.textures.len(),
        tiles: seen.clone().next().map_or([0, 0], |(_, p)| p.tiles),
        eye_passes: seen
            .filter(|(_, p)| p.frame == first_frame)
            .map(|(i, _)| i as u32)
            .collect(),
        meta: tables.meta.clone(),
    }
}

fn conservation<'r>(
    scene: &str,
    rows: impl Iterator<Item = &'r ResultRow<'r>> + Clone,
) -> Conservation {
    let hash = |row: &ResultRow<'r>| row.result.access_hash.clone();
    let first = rows.clone().next().map(hash).unwrap_or_default();
    let differing = rows.clone().filter(|row| hash(row) != first);
    Conservation {
        scene: scene.to_owned(),
        differing: differing
            .map(|r| format!("{} KiB {}", r.caches_title(), r.point.config.order.name()))
            .collect(),
        runs: rows.count(),
        access_hash: first,
    }
}

fn deviation(rows: &[ResultRow]) -> Deviation {
    let points: Vec<f64> = rows
        .iter()
        .filter_map(|row| Some(number(row, "z2_paper.closed_form_deviation_points")?.abs()))
        .collect();
    Deviation {
        mean_absolute_points: mean(points.iter().copied()).unwrap_or(0.0),
        largest_points: points.iter().copied().fold(0.0, f64::max),
        rows: points.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::with_report;
    use super::*;

    #[test]
    fn reductions_and_ratios_are_against_morton() {
        with_report(|report| {
            let get = |order, key: &str| {
                let row = report.row("crytek-sponza", "8/128", order).unwrap();
                number(row, key).unwrap()
            };
            let bytes = |order| get(order, "external_bytes");
            let saved = 1.0 - bytes(Order::Z2_STA) / bytes(Order::MORTON);
            assert!((get(Order::Z2_STA, "reduction_pct") - 100.0 * saved).abs() < 1e-9);
            assert_eq!(get(Order::MORTON, "reduction_pct"), 0.0);
            assert_eq!(get(Order::MORTON, "tmu_ratio"), 1.0);
        });
    }

    #[test]
    fn an_order_that_replays_other_accesses_is_reported() {
        let check = |edit: fn(usize) -> bool| {
            super::super::testing::with_edited(
                |point, result| {
                    if edit(point) {
                        result.access_hash = "other".into();
                    }
                },
                |report| report.not_conserved(),
            )
        };
        assert_eq!(check(|_| false), None);
        assert_eq!(
            check(|point| point == 2).unwrap(),
            "orders replayed different accesses: crytek-sponza: 8/128 KiB z2-sta; \
             l-bench-sponza-shadows: 8/128 KiB z2-sta"
        );
    }

    #[test]
    fn the_json_has_its_schema_and_every_row_with_the_papers_values() {
        with_report(|report| {
            let json: serde_json::Value = serde_json::from_str(&report.json().unwrap()).unwrap();
            assert_eq!(json["schema"], "replay.paper/3");
            assert_eq!(json["rows"].as_array().unwrap().len(), report.rows.len());
            let row = &json["rows"][2];
            assert_eq!(row["order"], "z2-sta");
            assert_eq!(row["external_bytes"], report.rows[2].result.external_bytes);
            let lrta = &json["rows"][10]["paper"];
            assert_eq!(
                (&lrta["l1_footprint_miss_pct"], &lrta["l2_line_miss_pct"]),
                (&8.76.into(), &54.81.into())
            );
            assert!((lrta["reduction_pct"].as_f64().unwrap() - 42.7).abs() < 0.1);
        });
    }
}
