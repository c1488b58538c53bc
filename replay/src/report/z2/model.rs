//! The rows of the experiment, their averages and their checks, as plain data (`replay.paper/1`).

use crate::config::{Order, RunConfig};
use crate::paper::{z2_row, z2_table};
use crate::result::{Part, RunResult, TileMap, TraceId};
use crate::tmu::closed_form as closed_form_utilization;
use formats::textrace::TraceMeta;
use serde::{Deserialize, Serialize};

/// Schema of the object that `replay paper --json` prints.
pub const PAPER_SCHEMA: &str = "replay.paper/1";

/// Bytes in the tables' megabyte.
pub const BYTES_PER_MB: f64 = 1e6;

/// A trace of the experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceInfo {
    /// Short name in tables.
    pub label: String,
    /// Scene name and checksum.
    pub trace: TraceId,
    /// Scene of the paper that it stands for.
    pub twin: Option<String>,
    /// Frames in the trace.
    pub frames: u32,
    /// Quads of the trace.
    pub quads: u64,
    /// Covered lanes.
    pub lanes: u64,
    /// Footprints under the base configuration.
    pub footprints: u64,
    /// Textures in the table.
    pub textures: usize,
    /// Tile columns and rows of a main view.
    pub tiles: [u32; 2],
    /// Passes of the first frame's left and right eye.
    pub eye_passes: Vec<u32>,
    /// Description from the trace.
    pub meta: TraceMeta,
}

/// One run: what was asked for and what came out.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Index of the trace.
    pub trace: usize,
    /// Configuration.
    pub config: RunConfig,
    /// Result.
    pub result: RunResult,
}

/// One row of the table: a scene, a cache configuration, an order; ours and the paper's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The trace's label.
    pub scene: String,
    /// L1 size in KiB.
    pub l1_kib: f64,
    /// L2 size in KiB.
    pub l2_kib: f64,
    /// Order.
    pub order: Order,
    /// The figures.
    #[serde(flatten)]
    pub figures: Figures,
    /// External traffic in bytes, all frames.
    pub external_bytes: u64,
    /// The same in MB (10^6 bytes) a frame.
    pub external_mb_per_frame: f64,
    /// Traffic of an infinite cache, a lower bound, in MB a frame.
    pub bound_mb_per_frame: f64,
    /// Utilisation that the paper's table implies for our miss rates, percent.
    pub closed_form_util_pct: f64,
    /// Ours minus that, points.
    pub closed_form_deviation_points: Option<f64>,
    /// Cycles until the last core is done.
    pub cycles: Option<u64>,
    /// The paper's figures for the scene that this one stands for.
    pub paper: Option<Figures>,
    /// Functional mode's figures, where it was run.
    pub functional: Option<FunctionalFigures>,
}

/// What the paper's Table 2 gives for a row, and the ratios that it derives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// L1 miss rate, percent.
    pub l1_miss_pct: f64,
    /// L2 miss rate, percent.
    pub l2_miss_pct: f64,
    /// TMU utilisation, percent; none in functional mode.
    pub tmu_util_pct: Option<f64>,
    /// Utilisation over Morton's.
    pub tmu_ratio: Option<f64>,
    /// External traffic saved against Morton, percent.
    pub reduction_pct: Option<f64>,
}

/// Functional mode's view of a row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FunctionalFigures {
    /// L1 miss rate, percent.
    pub l1_miss_pct: f64,
    /// L2 miss rate, percent.
    pub l2_miss_pct: f64,
    /// External traffic, MB a frame.
    pub external_mb_per_frame: f64,
    /// Functional over timed external traffic, minus one, percent.
    pub external_difference_pct: f64,
}

/// Means over scenes and cache configurations for one order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Average {
    /// A scene's label, or `all scenes`.
    pub scene: String,
    /// Order.
    pub order: Order,
    /// Mean traffic saved against Morton, percent.
    pub reduction_pct: f64,
    /// Mean utilisation over Morton's; none in functional mode.
    pub tmu_ratio: Option<f64>,
    /// The paper's mean reduction: for the scene's twin, or over all of its scenes.
    pub paper_reduction_pct: Option<f64>,
    /// The paper's mean ratio.
    pub paper_tmu_ratio: Option<f64>,
}

/// How far utilisation is from the surface of the paper's table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// Mean absolute deviation over the timed rows, points.
    pub mean_absolute_points: f64,
    /// Largest absolute deviation, points.
    pub largest_points: f64,
    /// Timed rows.
    pub rows: usize,
}

/// Whether every run of a trace replayed the same multiset of accesses.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

/// Where a trace's traffic goes under one configuration and order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detail {
    /// The trace's label.
    pub scene: String,
    /// L1 and L2 size in KiB.
    pub l1_kib: f64,
    /// L2 size in KiB.
    pub l2_kib: f64,
    /// Order.
    pub order: Order,
    /// By view.
    pub by_view: Vec<Part>,
    /// By texture.
    pub by_texture: Vec<Part>,
    /// By mip level.
    pub by_level: Vec<Part>,
    /// By tile, where asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tile_maps: Vec<TileMap>,
}

/// The whole experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PaperReport {
    /// `replay.paper/1`.
    pub schema: String,
    /// Program and version.
    pub tool: String,
    /// Configuration of the first run; caches and order vary as the rows say.
    pub config: RunConfig,
    /// Traces.
    pub traces: Vec<TraceInfo>,
    /// Rows: by trace, cache configuration, order.
    pub rows: Vec<Row>,
    /// Means.
    pub averages: Vec<Average>,
    /// Utilisation against the paper's surface.
    pub closed_form: Deviation,
    /// Conservation check.
    pub conservation: Vec<Conservation>,
    /// Details of the first cache configuration.
    pub details: Vec<Detail>,
}

impl PaperReport {
    /// Puts the runs into rows. `functional` holds runs in functional mode of the same points, or
    /// nothing.
    #[must_use]
    pub fn new(traces: Vec<TraceInfo>, base: RunConfig, runs: &[Run], functional: &[Run]) -> Self {
        let mut report = Self {
            schema: PAPER_SCHEMA.to_owned(),
            tool: concat!("replay ", env!("CARGO_PKG_VERSION")).to_owned(),
            config: base,
            rows: runs
                .iter()
                .map(|run| row(&traces, runs, functional, run))
                .collect(),
            averages: Vec::new(),
            closed_form: Deviation::default(),
            conservation: conservation(&traces, runs),
            details: details(&traces, runs),
            traces,
        };
        report.averages = averages(&report);
        report.closed_form = deviation(&report.rows);
        report
    }

    /// Whether every order replayed the same accesses.
    #[must_use]
    pub fn conserved(&self) -> bool {
        self.conservation.iter().all(|c| c.differing.is_empty())
    }

    /// The orders of the experiment in order of appearance.
    #[must_use]
    pub fn orders(&self) -> Vec<Order> {
        unique(self.rows.iter().map(|r| r.order))
    }

    /// The cache configurations (L1, L2 in KiB) in order of appearance.
    #[must_use]
    pub fn caches_kib(&self) -> Vec<(f64, f64)> {
        unique(self.rows.iter().map(|r| (r.l1_kib, r.l2_kib)))
    }

    /// The row of a scene, a cache configuration and an order.
    #[must_use]
    pub fn row(&self, scene: &str, caches: (f64, f64), order: Order) -> Option<&Row> {
        self.rows
            .iter()
            .find(|r| r.scene == scene && (r.l1_kib, r.l2_kib) == caches && r.order == order)
    }
}

fn unique<T: PartialEq>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for item in items {
        if !seen.contains(&item) {
            seen.push(item);
        }
    }
    seen
}

fn caches_kib(config: &RunConfig) -> (f64, f64) {
    let kib = |bytes: u64| bytes as f64 / 1024.0;
    (kib(config.l1.size_bytes), kib(config.l2.size_bytes))
}

/// The run of the same trace and caches with another order.
fn sibling<'a>(runs: &'a [Run], of: &Run, order: Order) -> Option<&'a Run> {
    runs.iter().find(|r| {
        r.trace == of.trace
            && caches_kib(&r.config) == caches_kib(&of.config)
            && r.config.order == order
    })
}

fn percent(fraction: f64) -> f64 {
    100.0 * fraction
}

/// `1 - part / whole` in percent, none when the whole is nothing.
fn saved_pct(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| percent(1.0 - part / whole))
}

fn row(traces: &[TraceInfo], runs: &[Run], functional: &[Run], run: &Run) -> Row {
    let info = &traces[run.trace];
    let result = &run.result;
    let (l1_kib, l2_kib) = caches_kib(&run.config);
    let order = run.config.order;
    let mb_per_frame = |bytes: f64| bytes / BYTES_PER_MB / f64::from(info.frames.max(1));
    let morton = sibling(runs, run, Order::MORTON).map(|r| &r.result);
    let utilization = |r: &RunResult| r.tmu.as_ref().map(|t| t.utilization);
    let closed_form_util_pct = percent(closed_form_utilization(
        result.l1.miss_rate,
        result.l2.miss_rate,
    ));
    let tmu_util_pct = utilization(result).map(percent);
    let external_mb_per_frame = mb_per_frame(result.external_bytes as f64);
    Row {
        scene: info.label.clone(),
        l1_kib,
        l2_kib,
        order,
        figures: Figures {
            l1_miss_pct: percent(result.l1.miss_rate),
            l2_miss_pct: percent(result.l2.miss_rate),
            tmu_util_pct,
            tmu_ratio: utilization(result)
                .zip(morton.and_then(utilization))
                .map(|(u, m)| u / m),
            reduction_pct: morton
                .and_then(|m| saved_pct(result.external_bytes as f64, m.external_bytes as f64)),
        },
        external_bytes: result.external_bytes,
        external_mb_per_frame,
        bound_mb_per_frame: mb_per_frame(
            result.unique_lines as f64 * f64::from(run.config.line_bytes),
        ),
        closed_form_util_pct,
        closed_form_deviation_points: tmu_util_pct.map(|u| u - closed_form_util_pct),
        cycles: result.cycles,
        paper: info
            .twin
            .as_deref()
            .and_then(|twin| published(twin, l1_kib, l2_kib, order)),
        functional: sibling(functional, run, order).map(|f| FunctionalFigures {
            l1_miss_pct: percent(f.result.l1.miss_rate),
            l2_miss_pct: percent(f.result.l2.miss_rate),
            external_mb_per_frame: mb_per_frame(f.result.external_bytes as f64),
            external_difference_pct: saved_pct(
                f.result.external_bytes as f64,
                result.external_bytes as f64,
            )
            .map_or(0.0, |saved| -saved),
        }),
    }
}

/// The paper's figures for one of its scenes.
fn published(twin: &str, l1_kib: f64, l2_kib: f64, order: Order) -> Option<Figures> {
    let row = |order| z2_row(twin, l1_kib as u32, l2_kib as u32, order);
    let (ours, morton) = (row(order)?, row(Order::MORTON)?);
    Some(Figures {
        l1_miss_pct: ours.l1_miss_pct,
        l2_miss_pct: ours.l2_miss_pct,
        tmu_util_pct: Some(ours.tmu_util_pct),
        tmu_ratio: Some(ours.tmu_util_pct / morton.tmu_util_pct),
        reduction_pct: saved_pct(
            ours.external_lines_per_footprint(),
            morton.external_lines_per_footprint(),
        ),
    })
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
    (count > 0).then(|| sum / count as f64)
}

/// Means a scene, then over all scenes if there are several, for every order but the baseline.
fn averages(report: &PaperReport) -> Vec<Average> {
    let paper: Vec<(&str, Order, Figures)> = z2_table()
        .iter()
        .filter_map(|r| {
            let figures = published(&r.scene, f64::from(r.l1_kib), f64::from(r.l2_kib), r.order)?;
            Some((r.scene.as_str(), r.order, figures))
        })
        .collect();
    let average = |scene: Option<&TraceInfo>, order: Order| {
        let rows = || {
            report
                .rows
                .iter()
                .filter(move |r| r.order == order && scene.is_none_or(|s| s.label == r.scene))
        };
        let published = || {
            paper.iter().filter(move |(name, o, _)| {
                *o == order && scene.is_none_or(|s| s.twin.as_deref() == Some(*name))
            })
        };
        Some(Average {
            scene: scene.map_or_else(|| "all scenes".to_owned(), |s| s.label.clone()),
            order,
            reduction_pct: mean(rows().filter_map(|r| r.figures.reduction_pct))?,
            tmu_ratio: mean(rows().filter_map(|r| r.figures.tmu_ratio)),
            paper_reduction_pct: mean(published().filter_map(|(_, _, f)| f.reduction_pct)),
            paper_tmu_ratio: mean(published().filter_map(|(_, _, f)| f.tmu_ratio)),
        })
    };
    let orders: Vec<Order> = report
        .orders()
        .into_iter()
        .filter(|o| *o != Order::MORTON)
        .collect();
    let overall = (report.traces.len() > 1).then_some(None);
    let scenes = report.traces.iter().map(Some).chain(overall);
    scenes
        .flat_map(|scene| {
            orders
                .iter()
                .filter_map(move |&order| average(scene, order))
        })
        .collect()
}

fn deviation(rows: &[Row]) -> Deviation {
    let points: Vec<f64> = rows
        .iter()
        .filter_map(|r| r.closed_form_deviation_points)
        .map(f64::abs)
        .collect();
    Deviation {
        mean_absolute_points: mean(points.iter().copied()).unwrap_or(0.0),
        largest_points: points.iter().copied().fold(0.0, f64::max),
        rows: points.len(),
    }
}

fn conservation(traces: &[TraceInfo], runs: &[Run]) -> Vec<Conservation> {
    traces
        .iter()
        .enumerate()
        .map(|(index, info)| {
            let mut of_trace = runs.iter().filter(|r| r.trace == index).peekable();
            let first = of_trace
                .peek()
                .map_or("", |r| r.result.access_hash.as_str());
            let (mut count, mut differing) = (0, Vec::new());
            for run in of_trace {
                count += 1;
                if run.result.access_hash != first {
                    let (l1, l2) = caches_kib(&run.config);
                    differing.push(format!("{l1}/{l2} KiB {}", run.config.order.name()));
                }
            }
            Conservation {
                scene: info.label.clone(),
                access_hash: first.to_owned(),
                runs: count,
                differing,
            }
        })
        .collect()
}

/// Details of each trace's first cache configuration: all orders' parts, and the tile maps.
fn details(traces: &[TraceInfo], runs: &[Run]) -> Vec<Detail> {
    let mut out = Vec::new();
    for (index, info) in traces.iter().enumerate() {
        let Some(first) = runs.iter().find(|r| r.trace == index) else {
            continue;
        };
        let caches = caches_kib(&first.config);
        for run in runs
            .iter()
            .filter(|r| r.trace == index && caches_kib(&r.config) == caches)
        {
            out.push(Detail {
                scene: info.label.clone(),
                l1_kib: caches.0,
                l2_kib: caches.1,
                order: run.config.order,
                by_view: run.result.by_view.clone(),
                by_texture: run.result.by_texture.clone(),
                by_level: run.result.by_level.clone(),
                tile_maps: run.result.tile_maps.clone(),
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::testing::report;
    use super::*;

    #[test]
    fn reductions_and_ratios_are_against_morton() {
        let report = report();
        let row = report
            .row("crytek-sponza", (8.0, 128.0), Order::Z2_STA)
            .unwrap();
        let morton = report
            .row("crytek-sponza", (8.0, 128.0), Order::MORTON)
            .unwrap();
        let saved = 1.0 - row.external_bytes as f64 / morton.external_bytes as f64;
        assert!((row.figures.reduction_pct.unwrap() - 100.0 * saved).abs() < 1e-9);
        assert_eq!(morton.figures.reduction_pct, Some(0.0));
        assert_eq!(morton.figures.tmu_ratio, Some(1.0));
    }

    #[test]
    fn the_twins_published_row_stands_beside_ours() {
        let report = report();
        let row = report
            .row("crytek-sponza", (16.0, 256.0), Order::Z2_LRTA)
            .unwrap();
        let paper = row.paper.unwrap();
        assert_eq!((paper.l1_miss_pct, paper.l2_miss_pct), (8.76, 54.81));
        assert!((paper.reduction_pct.unwrap() - 42.7).abs() < 0.1);
    }

    #[test]
    fn an_order_that_replays_other_accesses_is_named() {
        let (traces, config, mut runs) = super::super::testing::inputs();
        runs[2].result.access_hash = "other".into();
        let report = PaperReport::new(traces, config, &runs, &[]);
        assert!(!report.conserved());
        assert_eq!(report.conservation[0].differing, ["8/128 KiB z2-sta"]);
    }

    #[test]
    fn the_json_names_its_schema_and_keeps_every_row() {
        let report = report();
        let text = serde_json::to_string(&report).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["schema"], "replay.paper/1");
        assert_eq!(json["rows"].as_array().unwrap().len(), report.rows.len());
        assert_eq!(json["rows"][2]["order"], "z2-sta");
        assert_eq!(
            json["rows"][2]["external_bytes"],
            report.rows[2].external_bytes
        );
        assert!(serde_json::from_str::<PaperReport>(&text).is_ok());
    }
}
