//! `replay sample`: figures of a path from some of its frames, within a width that is asked for.

mod counts_file;

use super::experiment_args::{parse_caches, refuse_varied};
use super::order_arg::parse_over;
use super::outputs::ReplayArgs;
use crate::files;
use anyhow::{Context, Result, bail, ensure};
use formats::container::ScratchFolder;
use formats::textrace::Textrace;
use report::notices::open_textrace;
use report::sample::{SampleReport, SampleRow, TrialReport, TrialRow, frame_list};
use sim::config::{Mode, Order, RunConfig};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use studies::sampling::of::Of;
use studies::sampling::points::{Points, aim, bounds};
use studies::sampling::sample::{Aim, Promise, Sample, Step, Within};
use studies::sampling::strata::{Planned, planned, recorded};
use studies::sampling::trial::trial;

/// Confidence without `--confidence`.
const CONFIDENCE_PCT: f64 = 95.0;

/// Arguments of `replay sample`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay sample --within 1points -- tracegen raster jungle --path head --frames 300
  tracegen raster jungle --path head --frames 300 --plan-only -o plan.textrace
  replay sample plan.textrace --within 1points
  tracegen raster jungle --path head --frames 12,40..42,77 -o part.textrace
  replay sample plan.textrace part.textrace --within 1points
  replay sample all-frames.textrace --within 1points
The first line does what the other four do step by step: it plans the path, captures a pilot and the frames that the
promise needs, and replays them. The last one replays a part of the frames of a trace that has all. docs/models/sampling.md explains the intervals.")]
pub struct Args {
    /// Plan of a path, then traces of its frames; or one trace of all frames
    #[arg(
        value_name = "TRACE",
        required_unless_present = "command",
        conflicts_with = "command"
    )]
    traces: Vec<PathBuf>,
    /// Command that captures the path; --plan-only, --frames, --no-plain and -o are added to it
    #[arg(last = true, value_name = "COMMAND")]
    command: Vec<OsString>,
    /// Folder for the traces of COMMAND [default: a temporary one]
    #[arg(long, value_name = "DIR", requires = "command")]
    keep: Option<PathBuf>,
    /// Largest distance from a figure to the ends of its interval: `1points` of a share, `2%` of bytes or cycles
    #[arg(long, value_name = "WIDTH", default_value = "1points", value_parser = parse_within)]
    within: (String, Within),
    /// Figure that the intervals are for
    #[arg(long, value_name = "FIGURE", default_value = "saving")]
    of: Of,
    /// Probability that all intervals hold together, percent
    #[arg(long, value_name = "PERCENT", default_value_t = CONFIDENCE_PCT, value_parser = parse_confidence)]
    confidence: f64,
    /// Orders, comma-separated
    #[arg(long, value_name = "ORDERS", default_value = "z2-sta")]
    orders: String,
    /// Order that savings are over
    #[arg(long, value_name = "ORDER", default_value = "morton")]
    baseline: String,
    /// L1/L2 sizes in KiB, comma-separated
    #[arg(long, value_name = "L1/L2,...", default_value = "16/256")]
    caches: String,
    /// Draw this many samples of a path whose every frame is in the traces, and print how often intervals hold
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000), conflicts_with = "command")]
    draws: Option<u64>,
    /// Write the counts by frame, order and caches as CSV
    #[arg(long, value_name = "FILE")]
    save_values: Option<PathBuf>,
    /// Read counts by frame instead of replaying traces
    #[arg(long, value_name = "FILE", conflicts_with = "command")]
    values: Option<PathBuf>,
    #[command(flatten)]
    replay: ReplayArgs,
}

fn parse_within(text: &str) -> Result<(String, Within), String> {
    let number = |text: &str| {
        let number = text.trim().parse::<f64>().ok();
        number.filter(|n| n.is_finite() && *n > 0.0 && *n <= 100.0)
    };
    let within = match (text.strip_suffix("points"), text.strip_suffix('%')) {
        (Some(rest), _) => number(rest).map(Within::Points),
        (_, Some(rest)) => number(rest).map(Within::Percent),
        _ => None,
    };
    let within = within.ok_or_else(|| {
        format!("expected more than 0 and at most 100, as in 0.5points or 2%, found '{text}'")
    })?;
    Ok((text.to_owned(), within))
}

fn parse_confidence(text: &str) -> Result<f64, String> {
    let number = text.trim().trim_end_matches('%').parse::<f64>().ok();
    let number = number.filter(|n| (50.0..=99.99).contains(n));
    number.ok_or_else(|| format!("expected 50 to 99.99 percent, found '{text}'"))
}

/// The orders and caches of the arguments.
fn points(args: &Args) -> Result<Points> {
    let mode = match args.of {
        Of::Cycles => Mode::Timed,
        _ => Mode::Functional,
    };
    let usual = RunConfig {
        mode,
        ..RunConfig::default()
    };
    let base = args.replay.machine.resolve_over(usual)?;
    refuse_varied(&base, &usual)?;
    ensure!(
        args.of != Of::Cycles || base.mode == Mode::Timed,
        "--of cycles: expected --mode timed, found functional, which has no cycles"
    );
    ensure!(
        base.frame.is_none(),
        "--frame: expected with `replay run`, found with `replay sample`, which counts texture traffic alone"
    );
    let orders = parse_over(&args.baseline, &args.orders)?;
    ensure!(
        args.of != Of::Saving || orders.len() > 1,
        "--orders: expected an order other than the baseline, found `{}`",
        args.orders
    );
    let points = Points::new(&base, &orders, &parse_caches(&args.caches)?);
    for point in &points.points {
        point.config.validate()?;
    }
    Ok(points)
}

/// Runs the subcommand. Exit code 1 if a complete sample does not keep its promise.
///
/// # Errors
/// Invalid arguments, an unreadable trace, a command that fails, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.replay.threads.start()?;
    let question = Question::new(args.of, &args.within, args.confidence, &args.baseline)?;
    let mut points = points(args)?;
    let mut outputs = match args.draws {
        Some(_) => args.replay.outputs.list::<TrialReport>()?,
        None => args.replay.outputs.list::<SampleReport>()?,
    };
    let values = args.save_values.iter();
    outputs.extend(values.map(|path| shell::Output::text("--save-values", path)));
    let inputs = args.traces.iter().chain(&args.values).map(PathBuf::as_path);
    let prints = files::check_outputs(&outputs, inputs.chain(args.replay.machine.file()))?;
    let report = match (args.command.split_first(), args.draws) {
        (Some((program, rest)), _) => driven(args, &question, &mut points, program, rest)?,
        (None, draws) => {
            let (plan, whole) = plan_of(&args.traces)?;
            match &args.values {
                Some(path) => counts_file::read(path, &mut points)?,
                None if whole.is_some() && draws.is_some() => {
                    add(&mut points, &args.traces[0], false)?
                }
                None => {
                    for path in &args.traces[1..] {
                        add(&mut points, path, draws.is_none())?;
                    }
                }
            }
            if let Some(draws) = draws {
                let report = trials(&question, &points, &plan, draws)?;
                save_values(args, &points)?;
                args.replay.outputs.write(&report, prints)?;
                return Ok(ExitCode::SUCCESS);
            }
            match whole {
                Some(trace) => of_whole(&question, &mut points, &plan, &trace)
                    .with_context(|| args.traces[0].display().to_string())?,
                None => question.answer(&points, &plan, args.values.is_some()),
            }
        }
    };
    save_values(args, &points)?;
    args.replay.outputs.write(&report, prints)?;
    Ok(exit_code(&report))
}

/// Exit code 1 if a complete sample does not keep its promise.
pub(super) fn exit_code(report: &SampleReport) -> ExitCode {
    let broken = report.capture.is_empty() && !report.rows.iter().all(|row| row.kept);
    ExitCode::from(u8::from(broken))
}

/// The frames of a path from its plan, or from a trace of all frames, which is returned, too.
fn plan_of(paths: &[PathBuf]) -> Result<(Vec<Planned>, Option<Textrace>)> {
    let path = &paths[0];
    let plan = Textrace::open(path)?;
    let meta = &plan.tables().meta;
    if let Some(counts) = &meta.plan {
        return Ok((planned(&meta.frames, counts), None));
    }
    ensure!(
        paths.len() == 1 && meta.warm_frames.is_empty(),
        "{}: expected a plan (tracegen raster --plan-only) or one trace of all frames, found a trace of captured frames",
        path.display()
    );
    let numbers: Vec<u32> = meta.frames.iter().map(|views| views.frame).collect();
    ensure!(
        numbers == sim::order::frames(&plan.tables().passes),
        "{}: expected the poses of every frame, found {} poses",
        path.display(),
        numbers.len()
    );
    Ok((recorded(&plan), Some(plan)))
}

/// Replays a trace and adds the counts of its frames.
fn add(points: &mut Points, path: &Path, bounds_cold: bool) -> Result<()> {
    let (trace, _) = open_textrace(path)?;
    let added = points.add(&trace, None, bounds_cold);
    added.with_context(|| path.display().to_string())
}

fn save_values(args: &Args, points: &Points) -> Result<()> {
    let path = args.save_values.as_deref();
    path.map_or(Ok(()), |path| counts_file::write(path, points))
}

/// Flags of commands that replay some of a trace's frames.
#[derive(Debug, clap::Args)]
pub(super) struct WithinArgs {
    /// Replay only the frames that an interval of this width needs, as `replay sample` does: `1points` for shares,
    /// `2%` for bytes and cycles
    #[arg(long, value_name = "WIDTH", value_parser = parse_within, hide_short_help = true)]
    pub within: Option<(String, Within)>,
    /// Figure that --within is for
    #[arg(
        long,
        value_name = "FIGURE",
        requires = "within",
        hide_short_help = true
    )]
    of: Option<Of>,
    /// Probability that all intervals hold together, percent [default: 95]
    #[arg(long, value_name = "PERCENT", requires = "within", value_parser = parse_confidence, hide_short_help = true)]
    confidence: Option<f64>,
}

impl WithinArgs {
    /// The answer for the orders, the baseline first, with pairs of L1 and L2 sizes in bytes, if the flag is given.
    /// `usual` is the figure without --of.
    ///
    /// # Errors
    /// A width or a figure that does not fit, or a trace without all frames.
    pub fn answer(
        &self,
        usual: Of,
        path: &Path,
        base: &RunConfig,
        orders: &[Order],
        caches_bytes: &[(u64, u64)],
    ) -> Result<Option<SampleReport>> {
        let Some(within) = &self.within else {
            return Ok(None);
        };
        let of = self.of.unwrap_or(usual);
        ensure!(
            of != Of::Cycles || base.mode == Mode::Timed,
            "--of cycles: expected --mode timed, found functional, which has no cycles"
        );
        ensure!(
            of != Of::Saving || orders.len() > 1,
            "--of saving: expected several orders, found one"
        );
        let confidence = self.confidence.unwrap_or(CONFIDENCE_PCT);
        let question = Question::new(of, within, confidence, orders[0].name())?;
        let mut points = Points::new(base, orders, caches_bytes);
        for point in &points.points {
            point.config.validate()?;
        }
        let (plan, Some(trace)) = plan_of(&[path.to_owned()])? else {
            bail!(
                "{}: expected a trace of all frames, found a plan",
                path.display()
            );
        };
        let report = of_whole(&question, &mut points, &plan, &trace);
        report.with_context(|| path.display().to_string()).map(Some)
    }
}

/// What is asked of a sample.
struct Question {
    of: Of,
    /// Width, as given.
    within: String,
    promise: Promise,
    /// The order that savings are over.
    baseline: String,
}

impl Question {
    /// `confidence` is in percent.
    fn new(
        of: Of,
        (within, width): &(String, Within),
        confidence: f64,
        baseline: &str,
    ) -> Result<Self> {
        ensure!(
            matches!(width, Within::Points(_)) == of.is_share(),
            "--within: expected {} for this figure, found {within}",
            if of.is_share() {
                "points, as in 1points,"
            } else {
                "percent, as in 1%,"
            }
        );
        Ok(Self {
            of,
            within: within.clone(),
            promise: Promise {
                within: *width,
                confidence: confidence / 100.0,
            },
            baseline: baseline.to_owned(),
        })
    }

    /// The answer, or the frames that it lacks. Counts from a file have no bounds.
    fn answer(&self, points: &Points, plan: &[Planned], is_from_file: bool) -> SampleReport {
        let promise = &self.promise;
        let seed = points.points[0].config.seed;
        let sample = Sample::new(plan, seed);
        let aims: Vec<Aim<'_>> = points.asked(self.of).map(|of| aim(self.of, of)).collect();
        let mut report = SampleReport {
            rows: Vec::new(),
            within: self.within.clone(),
            confidence: promise.confidence,
            seed,
            baseline: self.baseline.clone(),
            strata: Vec::new(),
            capture: Vec::new(),
            not_bounded: None,
        };
        let sizes = match sample.step(&aims, promise) {
            Step::Capture(frames) => {
                report.capture = frames;
                vec![0; sample.strata.len()]
            }
            Step::Done(figures, sizes) => {
                for (pair, figure) in points.asked(self.of).zip(figures) {
                    let bounds = match is_from_file {
                        true => Err("counts from a file"),
                        false => bounds(&sample, self.of, pair, &sizes),
                    };
                    report.not_bounded = report.not_bounded.or(bounds.as_ref().err().copied());
                    report.rows.push(SampleRow {
                        caches: pair[0].caches.clone(),
                        order: pair[0].config.order.name().to_owned(),
                        of: self.of,
                        kept: figure.half() <= promise.half(figure.value) * (1.0 + 1e-9),
                        warm_up: bounds.ok(),
                        figure,
                    });
                }
                sizes
            }
        };
        let strata = sample.strata.iter().zip(sizes);
        report.strata = strata.map(|(block, n)| [block.frames.len(), n]).collect();
        report
    }
}

/// Replays the frames of a trace that the promise needs.
fn of_whole(
    question: &Question,
    points: &mut Points,
    plan: &[Planned],
    trace: &Textrace,
) -> Result<SampleReport> {
    let mut replayed = 0;
    loop {
        let report = question.answer(points, plan, false);
        if report.capture.is_empty() {
            return Ok(report);
        }
        replayed += report.capture.len();
        // With all frames, one run from the first to the last leaves no cold start.
        let wanted = (replayed < plan.len()).then_some(report.capture.as_slice());
        points.add(trace, wanted, true)?;
    }
}

/// Plans, captures and replays until the sample is complete.
fn driven(
    args: &Args,
    question: &Question,
    points: &mut Points,
    program: &OsString,
    rest: &[OsString],
) -> Result<SampleReport> {
    /// A pilot, and the last frames.
    const STAGES: usize = 2;
    let temporary;
    let folder = match &args.keep {
        Some(folder) => {
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
            folder.as_path()
        }
        None => {
            temporary = ScratchFolder::create_in(&std::env::temp_dir())?;
            temporary.path()
        }
    };
    let capture = |added: &[&str], file: &Path| -> Result<()> {
        let mut command = Command::new(program);
        command.args(rest).args(added).arg("-o").arg(file);
        super::capture::run(&mut command, file)
    };
    let file = folder.join("plan.textrace");
    capture(&["--plan-only"], &file)?;
    let (plan, _) = plan_of(std::slice::from_ref(&file))?;
    let mut report = question.answer(points, &plan, false);
    for stage in 1..=STAGES {
        if report.capture.is_empty() {
            break;
        }
        let frames = frame_list(&report.capture);
        shell::note(&format!(
            "stage {stage}: {} of {} frames: {frames}",
            report.capture.len(),
            plan.len()
        ));
        let file = folder.join(format!("stage-{stage}.textrace"));
        // The render without capture costs as much as the capture, and only its time would be printed.
        let is_needed = |flag: &&str| !rest.iter().any(|word| word == flag);
        let skip = ["--no-plain"].into_iter().filter(is_needed);
        let added: Vec<&str> = ["--frames", &frames].into_iter().chain(skip).collect();
        capture(&added, &file)?;
        add(points, &file, true)?;
        report = question.answer(points, &plan, false);
    }
    ensure!(
        report.capture.is_empty(),
        "{}: expected the frames that --frames lists, found others",
        program.display()
    );
    Ok(report)
}

/// Trials of each figure.
fn trials(
    question: &Question,
    points: &Points,
    plan: &[Planned],
    draws: u64,
) -> Result<TrialReport> {
    let mut report = TrialReport::default();
    for pair in points.asked(question.of) {
        let aim = aim(question.of, pair);
        if let Some(frame) = plan.iter().find(|frame| aim.pair(frame.number).is_none()) {
            bail!(
                "--draws: expected the counts of every frame, found none of frame {}",
                frame.number
            );
        }
        report.rows.push(TrialRow {
            caches: pair[0].caches.clone(),
            order: pair[0].config.order.name().to_owned(),
            of: question.of,
            trial: trial(plan, &aim, &question.promise, draws),
        });
    }
    Ok(report)
}
