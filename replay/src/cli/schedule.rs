//! `replay schedule`: frame time by scheduler, with shaders, texture units, caches and DRAM in a closed loop.

use super::ConfigArgs;
use super::choice::choice;
use super::outputs::PageOutputs;
use super::subjects::Traces;
use crate::files::{self, write_atomically};
use anyhow::{Context, Result, bail, ensure};
use frame::schedulers::{Scheduler, order_of};
use frame::{DramModel, FrameTime, Machine, Point, Settings};
use report::schedule::{INSTRUCTIONS, ScheduleReport, ScheduleRow};
use shell::{Output, Progress};
use sim::config::{Mode, RunConfig};
use sim::order::frames;
use std::path::PathBuf;
use std::process::ExitCode;
use studies::experiment::frame_count;

/// Arguments of `replay schedule`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay schedule atrium.textrace --preset mali-g710
  replay schedule *.textrace --preset adreno-740 --schedulers z2-sta,hot-cold,pair-pressure --json
  replay schedule head.textrace --bandwidth 1,2,4,8,16 --csv frame-time.csv
  replay schedule head.textrace --schedulers z2-sta --html bars.html --timeline head.perfetto.json
docs/models/frame-time.md states the machine, its parameters and the schedulers.")]
pub struct Args {
    /// Texture traces
    #[arg(required = true, value_name = "TRACE")]
    traces: Vec<PathBuf>,
    /// Schedulers, comma-separated; first-idle, over which speeds are, is always included
    #[arg(long, value_name = "SCHEDULERS", default_value = "all")]
    schedulers: String,
    /// Bandwidths of DRAM in GB/s, comma-separated, instead of a device's banks and rows
    #[arg(long, value_name = "GB/S,...", value_delimiter = ',')]
    bandwidth: Vec<f64>,
    /// Instructions per fragment besides textures; all figures are also replayed with half and twice as many
    #[arg(long, value_name = "N")]
    instructions: Option<f64>,
    /// Warps in flight per core
    #[arg(long, value_name = "N")]
    warps: Option<u32>,
    /// Quads per warp
    #[arg(long, value_name = "N", hide_short_help = true)]
    warp_quads: Option<u32>,
    /// Lanes of a core that issue an instruction per cycle
    #[arg(long, value_name = "N", hide_short_help = true)]
    alu_lanes: Option<u32>,
    /// Bilinear footprints that a core filters per cycle
    #[arg(long, value_name = "N", hide_short_help = true)]
    filter_footprints: Option<f64>,
    /// Quads between look-up and filter of a core
    #[arg(long, value_name = "N", hide_short_help = true)]
    fifo_quads: Option<u32>,
    /// Lines in flight per L1
    #[arg(long, value_name = "N", hide_short_help = true)]
    l1_mshrs: Option<u32>,
    /// Lines in flight to the L2
    #[arg(long, value_name = "N", hide_short_help = true)]
    l2_mshrs: Option<u32>,
    /// Tiles of a core in flight
    #[arg(long, value_name = "N", hide_short_help = true)]
    tiles_in_flight: Option<u32>,
    /// Let a core start a tile only when its last one is shaded
    #[arg(long, hide_short_help = true)]
    barrier: bool,
    /// How DRAM answers [default: banks, or rate with --bandwidth]
    #[arg(long, value_name = "MODEL", value_parser = choice::<DramModel>(), hide_short_help = true)]
    dram_model: Option<DramModel>,
    /// Latency of DRAM without banks and rows
    #[arg(long, value_name = "NS", hide_short_help = true)]
    dram_ns: Option<f64>,
    #[command(flatten)]
    outputs: PageOutputs,
    /// Also write which tiles each core holds over time, and its cycles by cause, for ui.perfetto.dev
    #[arg(long, value_name = "FILE")]
    timeline: Option<PathBuf>,
    #[command(flatten)]
    threads: shell::Threads,
    #[command(flatten)]
    machine: ConfigArgs,
}

impl Args {
    fn settings(&self) -> Settings {
        let usual = Settings::default();
        let model = match self.bandwidth.is_empty() {
            true => DramModel::Banks,
            false => DramModel::Rate,
        };
        Settings {
            instructions: self.instructions.unwrap_or(usual.instructions),
            warps: self.warps.unwrap_or(usual.warps),
            warp_quads: self.warp_quads.unwrap_or(usual.warp_quads),
            alu_lanes: self.alu_lanes.unwrap_or(usual.alu_lanes),
            filter_footprints: self.filter_footprints.unwrap_or(usual.filter_footprints),
            fifo_quads: self.fifo_quads.unwrap_or(usual.fifo_quads),
            l1_mshrs: self.l1_mshrs.unwrap_or(usual.l1_mshrs),
            l2_mshrs: self.l2_mshrs.unwrap_or(usual.l2_mshrs),
            tiles: self.tiles_in_flight.unwrap_or(usual.tiles),
            barrier: self.barrier,
            dram: self.dram_model.unwrap_or(model),
            dram_ns: self.dram_ns.unwrap_or(usual.dram_ns),
            ..usual
        }
    }
}

/// The schedulers of a comma-separated list, after the baseline.
fn parse_schedulers(text: &str) -> Result<Vec<Scheduler>> {
    let mut schedulers: Vec<Scheduler> = Scheduler::all().take(1).collect();
    if text == "all" {
        return Ok(Scheduler::all().collect());
    }
    for name in text.split(',').map(str::trim) {
        let Some(scheduler) = Scheduler::find(name) else {
            let similar = Scheduler::similar(name);
            let hint = similar.map_or(String::new(), |of| {
                format!("; did you mean `{}`?", of.name())
            });
            let names: Vec<&str> = Scheduler::all().map(Scheduler::name).collect();
            bail!(
                "--schedulers: expected `all` or names of {}; found `{name}`{hint}",
                names.join(", ")
            );
        };
        if !schedulers.contains(&scheduler) {
            schedulers.push(scheduler);
        }
    }
    Ok(schedulers)
}

/// Runs the subcommand.
///
/// # Errors
/// Invalid arguments, an unreadable trace, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.threads.start()?;
    let usual = RunConfig {
        mode: Mode::Functional,
        ..RunConfig::default()
    };
    let config = args.machine.resolve_over(usual)?;
    ensure!(
        config.order == usual.order,
        "--order: expected with other commands; here --schedulers chooses orders"
    );
    ensure!(
        config.frame.is_none(),
        "--frame: expected with `replay run`, found with `replay schedule`, whose clients are textures and colour"
    );
    let schedulers = parse_schedulers(&args.schedulers)?;
    let settings = args.settings();
    ensure!(
        args.bandwidth.is_empty() || settings.dram == DramModel::Rate,
        "--bandwidth: expected with --dram-model rate, found with {}",
        settings.dram.name()
    );
    let mut bandwidths: Vec<Option<f64>> = args.bandwidth.iter().copied().map(Some).collect();
    if bandwidths.is_empty() {
        bandwidths.push(None);
    }
    ensure!(
        args.timeline.is_none() || (args.traces.len() == 1 && bandwidths.len() == 1),
        "--timeline: expected one trace and one bandwidth, found {} and {}",
        args.traces.len(),
        bandwidths.len()
    );
    let mut points = Vec::new();
    for &bandwidth_gb_s in &bandwidths {
        for &scheduler in &schedulers {
            for factor in INSTRUCTIONS {
                let settings = Settings {
                    instructions: settings.instructions * factor,
                    bandwidth_gb_s,
                    ..settings
                };
                let order = order_of(scheduler);
                Machine::new(&RunConfig { order, ..config }, &settings)?;
                points.push(Point {
                    scheduler,
                    settings,
                    records: args.timeline.is_some() && factor == 1.0,
                });
            }
        }
    }
    let inputs = args.traces.iter().map(PathBuf::as_path);
    let mut outputs = args.outputs.list::<ScheduleReport>()?;
    let timeline = args.timeline.iter();
    outputs.extend(timeline.map(|path| Output::text("--timeline", path)));
    let prints = files::check_outputs(&outputs, inputs.chain(args.machine.file()))?;
    let traces = Traces::open(&args.traces)?;
    let subjects = traces.subjects();
    let of_frames = subjects
        .iter()
        .map(|of| u64::from(frame_count(of.source.tables())));
    let steps = of_frames.sum::<u64>() * points.len() as u64;
    let progress = Progress::new("replaying", steps, "frames");
    let mut rows = Vec::new();
    for subject in &subjects {
        let times = frame::replay(subject.source, &config, &points, &|done| {
            progress.advance(done)
        });
        let times = times.with_context(|| subject.label.clone())?;
        let passes = &subject.source.tables().passes;
        let first = frames(passes).first().copied();
        let of_first = passes.iter().filter(|pass| Some(pass.frame) == first);
        let largest =
            of_first.max_by_key(|pass| u64::from(pass.size_px[0]) * u64::from(pass.size_px[1]));
        let eye_tiles = largest.map_or([0; 2], |pass| {
            pass.size_px.map(|size| size.div_ceil(config.tile_px))
        });
        let of_points: Vec<&[FrameTime]> = times.chunks(INSTRUCTIONS.len()).collect();
        if let Some(file) = &args.timeline {
            let named = schedulers.iter().zip(&of_points);
            let named: Vec<_> = named.map(|(by, of)| (by.name(), &of[0])).collect();
            let text = report::timeline::frames_json(&named, passes)?;
            write_atomically(file, text.as_bytes())?;
        }
        for (of_bandwidth, &bandwidth) in of_points.chunks(schedulers.len()).zip(&bandwidths) {
            for (&of, &scheduler) in of_bandwidth.iter().zip(&schedulers) {
                rows.push(ScheduleRow::new(
                    &subject.label,
                    scheduler,
                    bandwidth,
                    of,
                    of_bandwidth[0],
                    eye_tiles,
                    settings.warps,
                ));
            }
        }
    }
    drop(progress);
    let report = ScheduleReport {
        rows,
        config,
        settings,
    };
    args.outputs.write(&report, prints, || report.page())?;
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_baseline_is_first_and_a_mistyped_name_comes_with_a_suggestion() {
        let names = |text| -> Vec<&str> {
            let schedulers = parse_schedulers(text).unwrap();
            schedulers.into_iter().map(Scheduler::name).collect()
        };
        assert_eq!(names("z2-sta,static"), ["first-idle", "z2-sta", "static"]);
        assert_eq!(names("all").len(), Scheduler::all().len());
        let error = parse_schedulers("hotcold").unwrap_err().to_string();
        assert!(
            error.ends_with("found `hotcold`; did you mean `hot-cold`?"),
            "{error}"
        );
    }
}
