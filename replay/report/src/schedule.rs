//! Frame time by scheduler (`replay.schedule/1`).

use super::answers;
use super::columns::{Columns, columns_of};
use super::document::Document;
use super::lists::{geometric_mean, unique};
use super::table::{Style, Table};
use frame::schedulers::{Hardware, Scheduler, bits};
use frame::{Figures, FrameTime, Settings};
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
    fn share(&self, of: impl Fn(&frame::CoreCycles) -> u64) -> f64 {
        let cycles = &self.times[0].core_cycles;
        100.0 * of(cycles) as f64 / cycles.all().max(1) as f64
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

    #[rustfmt::skip]
    fn text(&self, style: Style) -> String {
        let waits = |c: &frame::CoreCycles| c.mshr + c.dram + c.l2;
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
        let table = Table::new(&columns, &self.rows).without_empty_columns();
        table.styled(style)
    }
}
