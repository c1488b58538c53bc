//! Frame time by scheduler (`replay.schedule/1`).

use super::answers;
use super::columns::{Columns, columns_of};
use super::document::Document;
use super::html::{self, Answer, Page};
use super::lists::{geometric_mean, unique};
use super::plots::stacked::StackedChart;
use super::plots::{PlotError, SeriesStyle};
use super::table::{Style, Table};
use frame::schedulers::{Hardware, Scheduler, bits};
use frame::{CoreCycles, Figures, FrameTime, Settings};
use maud::html;
use serde::Serialize;
use sim::config::RunConfig;
use sim::figure::Figure;
use std::collections::BTreeMap;

/// A scheduler on a trace.
#[derive(Clone, Debug)]
pub struct ScheduleRow {
    /// The trace.
    pub trace: String,
    /// The scheduler.
    pub scheduler: Scheduler,
    /// Bandwidth that was asked for, in GB/s.
    pub bandwidth_gb_s: Option<f64>,
    /// With as many instructions as set, and with other numbers of them.
    pub times: Vec<Figures>,
    /// The same of the baseline.
    pub baseline: Vec<Figures>,
    /// Tiles that were not rendered, and all tiles.
    pub skipped_tiles: [u64; 2],
    /// State and tables in bits.
    pub bits: u64,
}

/// The range of instructions over which figures are bounded.
pub const INSTRUCTIONS: [f64; 3] = [1.0, 0.5, 2.0];

const OVER: &str = "half to twice the instructions";

/// Name and cycles of a part of the bars.
type BarPart = (&'static str, fn(&CoreCycles) -> u64);

/// From bottom to top.
const BAR_PARTS: [BarPart; 8] = [
    ("issues", |of| of.issue),
    ("texture unit filters", |of| of.texture),
    ("waits for DRAM", |of| of.dram),
    ("waits for the L2", |of| of.l2),
    ("waits for an MSHR", |of| of.mshr),
    ("pipelines and rasteriser", |of| of.latency + of.raster),
    ("barrier or writing", |of| of.barrier),
    ("no work", |of| of.no_work),
];

impl ScheduleRow {
    /// The row of replays with each of [`INSTRUCTIONS`].
    pub fn new(
        trace: &str,
        scheduler: Scheduler,
        bandwidth_gb_s: Option<f64>,
        times: &[FrameTime],
        baseline: &[FrameTime],
        eye_tiles: [u32; 2],
        warps: u32,
    ) -> Self {
        let hardware = Hardware {
            tiles: 2 * u64::from(eye_tiles[0]) * u64::from(eye_tiles[1]),
            cores: times[0].machine.cores as u64,
            warps: warps.into(),
        };
        Self {
            trace: trace.to_owned(),
            scheduler,
            bandwidth_gb_s,
            times: times.iter().map(Figures::of).collect(),
            baseline: baseline.iter().map(Figures::of).collect(),
            skipped_tiles: times[0].skipped_tiles,
            bits: bits(scheduler, &hardware, eye_tiles),
        }
    }

    fn bounded(&self, of: impl Fn(usize) -> f64) -> Figure {
        Figure::bounded(of(0), (1..self.times.len()).map(&of), OVER.to_owned())
    }

    /// Milliseconds per frame.
    pub fn ms(&self) -> Figure {
        self.bounded(|at| self.times[at].ms())
    }

    /// Speed over the baseline, in percent.
    pub fn faster_pct(&self) -> Figure {
        let speed = |at: usize| self.baseline[at].cycles as f64 / self.times[at].cycles as f64;
        self.bounded(|at| 100.0 * (speed(at) - 1.0))
    }

    /// Share of the cores' cycles, in percent.
    fn share(&self, of: impl Fn(&CoreCycles) -> u64) -> f64 {
        let cycles = &self.times[0].core_cycles;
        100.0 * of(cycles) as f64 / cycles.all().max(1) as f64
    }

    /// Milliseconds of a frame by [`BAR_PARTS`], means of all cores.
    fn parts_ms(&self) -> Vec<f64> {
        let ms = self.times[0].ms();
        let parts = BAR_PARTS.iter();
        parts.map(|(_, of)| ms * self.share(of) / 100.0).collect()
    }

    fn per_frame(&self, sum: f64) -> f64 {
        sum / self.times[0].frames.max(1) as f64
    }

    fn energy_mj(&self) -> Figure {
        let energy = &self.times[0].energy;
        let sum = |end: usize| self.per_frame(energy.chip_mj[end] + energy.dram_mj[end]);
        let over = "energies of later processes to those of 45 nm, open rows to a row per burst";
        Figure::bounded((sum(0) + sum(1)) / 2.0, [sum(0), sum(1)], over.to_owned())
    }
}

/// The JSON object's members.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct ScheduleJson {
    /// The machine's caches, cores and DRAM.
    config: RunConfig,
    /// Its other parameters.
    settings: Settings,
    /// The scheduler that speeds are over.
    baseline: &'static str,
    /// Clients of memory in the model.
    clients: [&'static str; 2],
    /// Rows.
    #[cfg_attr(
        feature = "testing",
        schemars(with = "Vec<serde_json::Map<String, serde_json::Value>>")
    )]
    rows: Table,
}

/// Schedulers on traces.
#[derive(Clone, Debug)]
pub struct ScheduleReport {
    /// Rows by trace, bandwidth and scheduler; the baseline is first.
    pub rows: Vec<ScheduleRow>,
    /// The machine.
    pub config: RunConfig,
    /// Its other parameters.
    pub settings: Settings,
}

impl ScheduleReport {
    /// Geometric mean of a ratio over all traces and bandwidths of a scheduler, with its ends.
    fn mean_faster(&self, scheduler: Scheduler) -> Figure {
        let of = |row: &&ScheduleRow| row.scheduler == scheduler;
        let figures: Vec<Figure> = self
            .rows
            .iter()
            .filter(of)
            .map(ScheduleRow::faster_pct)
            .collect();
        let mean = |end: fn(&Figure) -> f64| {
            let speeds = figures.iter().map(|figure| 1.0 + end(figure) / 100.0);
            100.0 * (geometric_mean(speeds).unwrap_or(1.0) - 1.0)
        };
        let ends = [mean(|of| of.low), mean(|of| of.high)];
        Figure::bounded(mean(|of| of.value), ends, OVER.to_owned())
    }

    /// Stacked bars of the schedulers, one chart per trace and bandwidth.
    fn bars(&self) -> Vec<StackedChart> {
        let series = (0..).zip(BAR_PARTS);
        let series = series.map(|(at, (name, _))| SeriesStyle::nth(name, at));
        let series: Vec<SeriesStyle> = series.collect();
        let charts = self
            .rows
            .chunk_by(|a, b| (&a.trace, a.bandwidth_gb_s) == (&b.trace, b.bandwidth_gb_s));
        let chart = |rows: &[ScheduleRow]| StackedChart {
            title: match rows[0].bandwidth_gb_s {
                Some(gb_s) => format!("{}, {gb_s} GB/s", rows[0].trace),
                None => rows[0].trace.clone(),
            },
            value_label: "time of a frame, ms".into(),
            bar_label: "scheduler".into(),
            series: series.clone(),
            bars: rows
                .iter()
                .map(|row| (row.scheduler.name().to_owned(), row.parts_ms()))
                .collect(),
            bar_px: 70.0,
            highest: None,
            decimals: Some(2),
        };
        charts.map(chart).collect()
    }

    /// The page.
    ///
    /// # Errors
    /// A plot that could not be drawn.
    pub fn page(&self) -> Result<String, PlotError> {
        let mut charts = self.bars().into_iter().map(|of| of.svg());
        let answer = Answer {
            sentences: self.answer(),
            chart: html::chart(charts.next(), "")?,
            about: html! { p {
                "A bar is the mean time of a frame; its parts are the mean over the cores. A cycle in which a core neither issues nor filters counts for one cause. "
                "The JSON and CSV files beside this page have all figures."
            } },
        };
        let mut page = Page::default();
        if charts.len() > 0 {
            page.add("Other traces and bandwidths", html::charts(charts)?);
        }
        page.add("Schedulers", self.table().markup());
        let machine = html! {
            (html::settings("configuration (TOML)", &self.config))
            (html::settings("other parameters (TOML)", &self.settings))
        };
        page.add("Machine", machine);
        Ok(page.text("Parallax: frame time by scheduler", &answer))
    }

    fn schedulers(&self) -> Vec<Scheduler> {
        unique(self.rows.iter().map(|row| row.scheduler))
    }

    /// The scheduler that renders a frame in the least time.
    fn fastest(&self) -> String {
        let schedulers = self.schedulers();
        let Some(&baseline) = schedulers.first() else {
            return String::new();
        };
        let ranked = schedulers.iter().map(|&of| (of, self.mean_faster(of)));
        let Some((best, faster)) = ranked.max_by(|a, b| a.1.value.total_cmp(&b.1.value)) else {
            return String::new();
        };
        let points = self.rows.len() / schedulers.len();
        let first = match best == baseline {
            true => format!(
                "No scheduler of {} is faster than {}",
                schedulers.len(),
                best.name()
            ),
            false => format!(
                "{} renders a frame {:.1} % faster than {} ({:.1} to {:.1} % for {OVER})",
                best.name(),
                faster.value,
                baseline.name(),
                faster.low,
                faster.high
            ),
        };
        let of_best = |row: &&ScheduleRow| row.scheduler == best;
        let gaps = (self.rows.iter().filter(of_best))
            .map(|row| row.times[0].ms() / row.times[0].bound_ms().max(f64::MIN_POSITIVE));
        let gap = 100.0 * (geometric_mean(gaps).unwrap_or(1.0) - 1.0);
        let over = match points {
            1 => String::new(),
            points => format!(", geometric mean of {points} traces and bandwidths"),
        };
        let narrow = match gap < 2.0 {
            true => " No scheduler matters here.",
            false => "",
        };
        format!("{first}{over}; {gap:.1} % above the lower bound.{narrow}")
    }
}

impl Document for ScheduleReport {
    const SCHEMA: &'static str = "replay.schedule/1";

    fn content(&self) -> impl Serialize {
        ScheduleJson {
            config: self.config,
            settings: self.settings,
            baseline: self.schedulers().first().map_or("", |of| of.name()),
            clients: ["texture", "colour"],
            rows: self.rows(),
        }
    }

    #[rustfmt::skip]
    fn rows(&self) -> Table {
        let columns = columns_of::<ScheduleRow>()
            .text("trace", "trace", |r| r.trace.clone())
            .text("scheduler", "scheduler", |r| r.scheduler.name())
            .real("bandwidth_gb_s", "GB/s", "", 1, |r| r.bandwidth_gb_s)
            .real("ms", "ms", "", 3, ScheduleRow::ms)
            .real("faster_pct", "faster", "%", 1, ScheduleRow::faster_pct)
            .real("slowest_ms", "slowest", "ms", 3, |r| r.times[0].slowest_ms())
            .real("bound_ms", "bound", "ms", 3, |r| r.times[0].bound_ms())
            .text("bound_by", "by", |r| r.times[0].bound.limit.name())
            .real("read_mb", "read", "MB", 2, |r| r.per_frame(r.times[0].dram_bytes[0] as f64 * 1e-6))
            .real("written_mb", "written", "MB", 2, |r| r.per_frame(r.times[0].dram_bytes[1] as f64 * 1e-6))
            .real("used_gb_s", "used", "GB/s", 2, |r| r.times[0].gb_per_s())
            .real("l2_look_ups_m", "L2 look-ups", "M", 3, |r| r.per_frame(r.times[0].l2_look_ups as f64 * 1e-6))
            .real("latency_cycles", "latency", "cycles", 0, |r| r.times[0].dram_latency_cycles)
            .real("energy_mj", "energy", "mJ", 2, ScheduleRow::energy_mj)
            .real("issue_pct", "issue", "%", 1, |r| r.share(|c| c.issue))
            .real("texture_pct", "texture", "%", 1, |r| r.share(|c| c.texture))
            .real("mshr_pct", "MSHR", "%", 1, |r| r.share(|c| c.mshr))
            .real("dram_pct", "DRAM", "%", 1, |r| r.share(|c| c.dram))
            .real("l2_pct", "L2", "%", 1, |r| r.share(|c| c.l2))
            .real("barrier_pct", "barrier", "%", 1, |r| r.share(|c| c.barrier))
            .real("raster_pct", "raster", "%", 1, |r| r.share(|c| c.raster))
            .real("latency_pct", "pipelines", "%", 1, |r| r.share(|c| c.latency))
            .real("no_work_pct", "no work", "%", 1, |r| r.share(|c| c.no_work))
            .real("skipped_pct", "skipped", "%", 1, |r| 100.0 * r.skipped_tiles[0] as f64 / r.skipped_tiles[1].max(1) as f64)
            .real("bits", "bits", "", 0, |r| r.bits as f64);
        Table::new(&columns, &self.rows)
    }

    fn figures(&self) -> BTreeMap<String, Figure> {
        let schedulers = self.schedulers().into_iter().skip(1);
        let key = |of: Scheduler| format!("{}_faster_pct", of.name().replace('-', "_"));
        schedulers
            .map(|of| (key(of), self.mean_faster(of)))
            .collect()
    }

    fn answer(&self) -> Vec<String> {
        vec![
            self.fastest(),
            format!(
                "{}; clients of memory are textures and colour. Figures are means of a frame; faster than the first row [for {OVER}].",
                answers::hardware(
                    &self.config,
                    [[self.config.level.l1, self.config.level.l2].map(|cache| cache.size_bytes)]
                )
            ),
        ]
    }

    fn text(&self, style: Style) -> String {
        self.table().styled(style)
    }
}

impl ScheduleReport {
    /// The table of the text and the page.
    #[rustfmt::skip]
    fn table(&self) -> Table {
        let waits = |c: &CoreCycles| c.mshr + c.dram + c.l2;
        let several = self.rows.iter().any(|row| row.trace != self.rows[0].trace);
        let columns = columns_of::<ScheduleRow>()
            .text("trace", "trace", move |r| several.then(|| r.trace.clone()))
            .text("scheduler", "scheduler", |r| r.scheduler.name())
            .real("gb_s", "GB/s", "", 1, |r| r.bandwidth_gb_s)
            .real("ms", "ms", "", 3, |r| r.times[0].ms())
            .real("faster", "faster, %", "", 1, ScheduleRow::faster_pct)
            .real("bound", "bound", "", 3, |r| r.times[0].bound_ms())
            .real("mb", "MB", "", 2, |r| r.per_frame(r.times[0].dram_bytes.iter().sum::<u64>() as f64 * 1e-6))
            .real("issue", "issue", "%", 0, |r| r.share(|c| c.issue))
            .real("texture", "tex", "%", 0, |r| r.share(|c| c.texture))
            .real("memory", "mem", "%", 0, move |r| r.share(waits))
            .real("other", "rest", "%", 0, move |r| r.share(|c| c.all() - c.issue - c.texture - waits(c)))
            .real("bits", "bits", "", 0, |r| r.bits as f64);
        Table::new(&columns, &self.rows).without_empty_columns()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timeline::frames_json;
    use frame::{Point, replay};
    use serde_json::Value;
    use sim::stream::TileSource;
    use sim::stream::testing::different_frames;

    #[test]
    fn bars_add_up_to_the_time_of_a_frame_and_counters_to_its_cycles() {
        let (trace, config) = (different_frames(), RunConfig::default());
        let settings = Settings::default();
        let schedulers = ["first-idle", "quads-in-turn"].map(|name| Scheduler::find(name).unwrap());
        let points = schedulers.map(|scheduler| Point {
            scheduler,
            settings,
            records: true,
        });
        let times = replay(&trace, &config, &points, &|_| {}).unwrap();
        let row = |(of, time): (&FrameTime, Scheduler)| {
            let (of, first) = (std::slice::from_ref(of), &times[..1]);
            ScheduleRow::new("frames", time, None, of, first, [1, 1], 4)
        };
        let report = ScheduleReport {
            rows: times.iter().zip(schedulers).map(row).collect(),
            config,
            settings,
        };
        let [chart] = &report.bars()[..] else {
            panic!("one trace and one bandwidth");
        };
        for ((name, parts), row) in chart.bars.iter().zip(&report.rows) {
            let (sum, ms) = (parts.iter().sum::<f64>(), row.ms().value);
            assert!((sum / ms - 1.0).abs() < 1e-12, "{name}: {sum}, {ms}");
        }
        let page = report.page().unwrap();
        assert!(page.contains("waits for DRAM") && page.contains("quads-in-turn"));

        let named = [("first-idle", &times[0]), ("quads-in-turn", &times[1])];
        let text = frames_json(&named, &trace.tables().passes).unwrap();
        let found: Value = serde_json::from_str(&text).unwrap();
        let events = found["traceEvents"].as_array().unwrap();
        for (process, (_, time)) in (1_u64..).zip(named) {
            let of_kind = |kind: &'static str| {
                let is_own = move |e: &&Value| e["ph"] == kind && e["pid"] == process;
                events.iter().filter(is_own)
            };
            let values = of_kind("C").flat_map(|e| e["args"].as_object().unwrap().values());
            let cycles: u64 = values.map(|value| value.as_u64().unwrap()).sum();
            let all: u64 = time.frames.iter().map(|(cycles, _)| cycles).sum();
            assert_eq!(cycles, all * u64::from(config.cores));
            let spans = &time.timeline.as_ref().unwrap().spans;
            assert_eq!(of_kind("X").count(), time.frames.len() + spans.len());
            let tracks = 1 + (config.cores * settings.tiles) as usize;
            assert_eq!(of_kind("M").count(), 1 + tracks);
        }
    }
}
