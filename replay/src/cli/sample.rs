//! `replay sample`: figures of a path from some of its frames, within a width that is asked for.

use super::ConfigArgs;
use super::experiment_args::{parse_caches, refuse_varied};
use super::order_arg::parse_named;
use super::outputs::Outputs;
use crate::files;
use anyhow::{Context, Result, bail, ensure};
use formats::textrace::Textrace;
use report::notices::open_textrace;
use report::sample::{SampleReport, SampleRow, TrialReport, TrialRow, frame_list};
use sim::config::{Mode, Order, RunConfig};
use sim::figure::Figure;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use studies::sampling::cold::{cold_misses, not_bounded};
use studies::sampling::of::Of;
use studies::sampling::sample::{Aim, Promise, Sample, Step, Within};
use studies::sampling::strata::{Planned, planned};
use studies::sampling::trial::trial;
use studies::sampling::values::{FrameCounts, Series, by_frame};

/// Arguments of `replay sample`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay sample --within 1points -- tracegen raster jungle --path head --frames 300
  tracegen raster jungle --path head --frames 300 --plan-only -o plan.textrace
  replay sample plan.textrace --within 1points
  tracegen raster jungle --path head --frames 12,40..42,77 -o part.textrace
  replay sample plan.textrace part.textrace --within 1points
The first line does what the other four do step by step: it plans the path, captures a pilot and the frames that the
promise needs, and replays them. docs/models/sampling.md explains the intervals.")]
pub struct Args {
    /// Plan of a path, then traces of its frames
    #[arg(
        value_name = "TRACE",
        required_unless_present = "command",
        conflicts_with = "command"
    )]
    traces: Vec<PathBuf>,
    /// Command that captures the path; --plan-only, --frames and -o are added to it
    #[arg(last = true, value_name = "COMMAND")]
    command: Vec<OsString>,
    /// Folder for the traces of COMMAND [default: a temporary one]
    #[arg(long, value_name = "DIR", requires = "command")]
    keep: Option<PathBuf>,
    /// Largest distance from a figure to the ends of its interval: `1points` of a share, `2%` of bytes or cycles
    #[arg(long, value_name = "WIDTH", default_value = "1points", value_parser = parse_within)]
    within: (String, Within),
    /// Figure that the promise is about
    #[arg(long, value_name = "FIGURE", default_value = "saving")]
    of: Of,
    /// Probability that all intervals hold together, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 95.0, value_parser = parse_confidence)]
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
    outputs: Outputs,
    #[command(flatten)]
    threads: shell::Threads,
    #[command(flatten)]
    machine: ConfigArgs,
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

/// Orders and caches, each with its counts by frame.
struct Points {
    /// The baseline first for each pair of caches.
    points: Vec<Point>,
    orders: usize,
}

struct Point {
    caches: String,
    config: RunConfig,
    values: Series,
    /// Bytes of misses in sets that were not full, by frame.
    cold: BTreeMap<u32, u64>,
}

impl Points {
    fn new(args: &Args) -> Result<Self> {
        let usual = RunConfig {
            mode: if args.of == Of::Cycles {
                Mode::Timed
            } else {
                Mode::Functional
            },
            ..RunConfig::default()
        };
        let base = args.machine.resolve_over(usual)?;
        refuse_varied(&base, &usual)?;
        let [baseline] = parse_named(&args.baseline)?[..] else {
            bail!("--baseline: expected one order, found `{}`", args.baseline);
        };
        let mut orders: Vec<Order> = vec![baseline];
        orders.extend(
            parse_named(&args.orders)?
                .into_iter()
                .filter(|order| *order != baseline),
        );
        ensure!(
            args.of != Of::Saving || orders.len() > 1,
            "--orders: expected an order other than the baseline, found `{}`",
            args.orders
        );
        let mut points = Vec::new();
        for (l1, l2) in parse_caches(&args.caches)? {
            for &order in &orders {
                let mut config = RunConfig { order, ..base };
                (config.level.l1.size_bytes, config.level.l2.size_bytes) = (l1, l2);
                config.validate()?;
                points.push(Point {
                    caches: format!("{}/{}", l1 >> 10, l2 >> 10),
                    config,
                    values: Series::new(),
                    cold: BTreeMap::new(),
                });
            }
        }
        Ok(Self {
            points,
            orders: orders.len(),
        })
    }

    /// Replays a trace and adds the counts of its frames, but of those that only fill the caches. `bounds_cold` also counts
    /// what a frame missed because the frames before it are absent.
    fn add(&mut self, trace: &Textrace, path: &Path, bounds_cold: bool) -> Result<()> {
        let warm = &trace.tables().meta.warm_frames;
        let configs: Vec<RunConfig> = self.points.iter().map(|point| point.config).collect();
        let series = by_frame(trace, &configs).with_context(|| path.display().to_string())?;
        for (point, mut series) in self.points.iter_mut().zip(series) {
            series.retain(|frame, _| warm.binary_search(frame).is_err());
            if bounds_cold && not_bounded(&point.config).is_none() {
                let line = u64::from(point.config.line_bytes);
                let cold = cold_misses(trace, &point.config)?;
                // The first frame of a path has no frames before it.
                let cold = cold.into_iter().filter(|(frame, _)| *frame > 0);
                point
                    .cold
                    .extend(cold.map(|(frame, lines)| (frame, lines * line)));
            }
            point.values.extend(series);
        }
        Ok(())
    }

    /// Each point with the baseline of its caches, for the figures that are asked for.
    fn asked(&self, of: Of) -> impl Iterator<Item = (&Point, &Point)> {
        let groups = self.points.chunks(self.orders);
        groups.flat_map(move |group| {
            let asked = &group[usize::from(of == Of::Saving)..];
            asked.iter().map(|point| (point, &group[0]))
        })
    }
}

/// Runs the subcommand. Exit code 1 if a complete sample does not keep its promise.
///
/// # Errors
/// Invalid arguments, an unreadable trace, a command that fails, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.threads.start()?;
    let (within, width) = &args.within;
    ensure!(
        matches!(width, Within::Points(_)) == args.of.is_share(),
        "--within: expected {} for this figure, found {within}",
        if args.of.is_share() {
            "points, as in 1points,"
        } else {
            "percent, as in 1%,"
        }
    );
    let promise = Promise {
        within: *width,
        confidence: args.confidence / 100.0,
    };
    let mut points = Points::new(args)?;
    let mut outputs = match args.draws {
        Some(_) => args.outputs.list::<TrialReport>()?,
        None => args.outputs.list::<SampleReport>()?,
    };
    let values = args.save_values.iter();
    outputs.extend(values.map(|path| shell::Output::text("--save-values", path)));
    let inputs = args.traces.iter().chain(&args.values).map(PathBuf::as_path);
    let prints = files::check_outputs(&outputs, inputs.chain(args.machine.file()))?;
    let report = match args.command.split_first() {
        Some((program, rest)) => driven(args, &mut points, &promise, program, rest)?,
        None => {
            let plan = plan_of(&args.traces[0])?;
            match &args.values {
                Some(path) => read_values(path, &mut points)?,
                None => {
                    for path in &args.traces[1..] {
                        points.add(&open_textrace(path)?.0, path, args.draws.is_none())?;
                    }
                }
            }
            if let Some(draws) = args.draws {
                let report = trials(args, &points, &plan, &promise, draws)?;
                save_values(args, &points)?;
                args.outputs.write(&report, prints)?;
                return Ok(ExitCode::SUCCESS);
            }
            stepped(args, &points, &plan, &promise)
        }
    };
    save_values(args, &points)?;
    args.outputs.write(&report, prints)?;
    let broken = report.capture.is_empty() && !report.rows.iter().all(|row| row.kept);
    Ok(ExitCode::from(u8::from(broken)))
}

/// The frames of a plan.
fn plan_of(path: &Path) -> Result<Vec<Planned>> {
    let plan = Textrace::open(path)?;
    let meta = &plan.tables().meta;
    let Some(counts) = &meta.plan else {
        bail!(
            "{}: expected a plan (tracegen raster --plan-only), found a trace of captured frames",
            path.display()
        );
    };
    Ok(planned(&meta.frames, counts))
}

/// The answer, or the frames that it lacks.
fn stepped(args: &Args, points: &Points, plan: &[Planned], promise: &Promise) -> SampleReport {
    let seed = points.points[0].config.seed;
    let sample = Sample::new(plan, seed);
    let asked: Vec<_> = points.asked(args.of).collect();
    let aim = |(point, baseline): &(&'_ Point, &'_ Point)| -> [Series; 2] {
        [point.values.clone(), baseline.values.clone()]
    };
    let series: Vec<[Series; 2]> = asked.iter().map(aim).collect();
    let aims: Vec<Aim<'_>> = (series.iter())
        .map(|[values, baseline]| Aim {
            of: args.of,
            values,
            baseline,
        })
        .collect();
    let mut report = SampleReport {
        rows: Vec::new(),
        within: args.within.0.clone(),
        confidence: promise.confidence,
        seed,
        baseline: args.baseline.clone(),
        strata: Vec::new(),
        capture: Vec::new(),
        not_bounded: match &args.values {
            Some(_) => Some("counts from a file"),
            None => not_bounded(&points.points[0].config),
        },
    };
    let sizes = match sample.step(&aims, promise) {
        Step::Capture(frames) => {
            report.capture = frames;
            vec![0; sample.strata.len()]
        }
        Step::Done(figures, sizes) => {
            for ((point, baseline), figure) in asked.iter().zip(figures) {
                report.rows.push(SampleRow {
                    caches: point.caches.clone(),
                    order: point.config.order.name().to_owned(),
                    of: args.of,
                    kept: figure.half() <= promise.half(figure.value) * (1.0 + 1e-9),
                    warm_up: match &args.values {
                        Some(_) => None,
                        None => warm_up(&sample, args.of, point, baseline, &sizes),
                    },
                    figure,
                });
            }
            sizes
        }
    };
    let open = |row: &SampleRow| row.warm_up.is_none();
    if matches!(args.of, Of::Saving | Of::Bytes) && report.rows.iter().any(open) {
        let unfilled = "the frames before do not fill them; raise --warm of tracegen raster";
        report.not_bounded = report.not_bounded.or(Some(unfilled));
    }
    let strata = sample.strata.iter().zip(sizes);
    report.strata = strata.map(|(block, n)| [block.frames.len(), n]).collect();
    report
}

/// Largest upper end of a ratio, over its value, that is printed.
const MOST_TIMES: f64 = 10.0;

/// The lowest and the highest value of a figure for whatever the caches held before the captured frames.
fn warm_up(
    sample: &Sample<'_>,
    of: Of,
    point: &Point,
    baseline: &Point,
    sizes: &[usize],
) -> Option<Figure> {
    if not_bounded(&point.config).is_some() || !matches!(of, Of::Saving | Of::Bytes) {
        return None;
    }
    let warmest = |point: &Point| -> Series {
        let less = |(frame, counts): (&u32, &FrameCounts)| {
            let cold = point.cold.get(frame).copied().unwrap_or(0);
            let external_bytes = counts.external_bytes - cold;
            (
                *frame,
                FrameCounts {
                    external_bytes,
                    ..*counts
                },
            )
        };
        point.values.iter().map(less).collect()
    };
    let ratio = |values: &Series, baseline: &Series| {
        sample
            .estimate(
                &Aim {
                    of,
                    values,
                    baseline,
                },
                sizes,
            )
            .ratio
    };
    let value = ratio(&point.values, &baseline.values);
    let ends = [
        ratio(&warmest(point), &baseline.values),
        ratio(&point.values, &warmest(baseline)),
    ];
    // If nearly all misses of the baseline may have been hits, the ratio has no upper end.
    if ends[1] > MOST_TIMES * value {
        return None;
    }
    Some(Figure::bounded(
        value,
        ends,
        "whatever the caches held before".into(),
    ))
}

/// Plans, captures and replays until the sample is complete.
fn driven(
    args: &Args,
    points: &mut Points,
    promise: &Promise,
    program: &OsString,
    rest: &[OsString],
) -> Result<SampleReport> {
    let temporary;
    let folder = match &args.keep {
        Some(folder) => {
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
            folder.as_path()
        }
        None => {
            temporary = tempfile::tempdir()?;
            temporary.path()
        }
    };
    let capture = |added: &[&str], file: &Path| -> Result<()> {
        let mut command = Command::new(program);
        command.args(rest).args(added).arg("-o").arg(file);
        // The answer alone goes to standard output.
        command.stdin(Stdio::null()).stdout(std::io::stderr());
        let status = command
            .status()
            .with_context(|| format!("{}", program.display()))?;
        ensure!(
            status.success() && file.is_file(),
            "{}: expected to write {}, ended with {status}",
            program.display(),
            file.display()
        );
        Ok(())
    };
    let file = folder.join("plan.textrace");
    capture(&["--plan-only"], &file)?;
    let plan = plan_of(&file)?;
    for stage in 1.. {
        let report = stepped(args, points, &plan, promise);
        if report.capture.is_empty() {
            return Ok(report);
        }
        let frames = frame_list(&report.capture);
        shell::note(&format!(
            "stage {stage}: {} of {} frames: {frames}",
            report.capture.len(),
            plan.len()
        ));
        let file = folder.join(format!("stage-{stage}.textrace"));
        capture(&["--frames", &frames], &file)?;
        points.add(&open_textrace(&file)?.0, &file, true)?;
        ensure!(
            stage < 8,
            "{}: expected the frames that --frames lists, found others",
            program.display()
        );
    }
    bail!("no stage")
}

/// Trials of each figure.
fn trials(
    args: &Args,
    points: &Points,
    plan: &[Planned],
    promise: &Promise,
    draws: u64,
) -> Result<TrialReport> {
    let mut report = TrialReport::default();
    for (point, baseline) in points.asked(args.of) {
        let aim = Aim {
            of: args.of,
            values: &point.values,
            baseline: &baseline.values,
        };
        if let Some(frame) = plan.iter().find(|frame| aim.pair(frame.number).is_none()) {
            bail!(
                "--draws: expected the counts of every frame, found none of frame {}",
                frame.number
            );
        }
        report.rows.push(TrialRow {
            caches: point.caches.clone(),
            order: point.config.order.name().to_owned(),
            of: args.of,
            trial: trial(plan, &aim, promise, draws),
        });
    }
    Ok(report)
}

const HEADINGS: [&str; 9] = [
    "caches",
    "order",
    "frame",
    "external_bytes",
    "footprints",
    "l1_footprint_misses",
    "l2_line_lookups",
    "l2_line_misses",
    "cycles",
];

fn save_values(args: &Args, points: &Points) -> Result<()> {
    let Some(path) = &args.save_values else {
        return Ok(());
    };
    let mut text = HEADINGS.join(",") + "\n";
    for point in &points.points {
        for (frame, c) in &point.values {
            let counts = [
                c.external_bytes,
                c.footprints,
                c.l1_footprint_misses,
                c.l2_line_lookups,
                c.l2_line_misses,
                c.cycles,
            ];
            let counts = counts.map(|count| count.to_string()).join(",");
            text += &format!(
                "{},{},{frame},{counts}\n",
                point.caches,
                point.config.order.name()
            );
        }
    }
    files::write_atomically(path, text.as_bytes())
}

fn read_values(path: &Path, points: &mut Points) -> Result<()> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let mut lines = (1..).zip(text.lines());
    let head = lines.next().map(|(_, line)| line).unwrap_or_default();
    ensure!(
        head == HEADINGS.join(","),
        "{}: line 1: expected {}, found {head}",
        path.display(),
        HEADINGS.join(",")
    );
    for (number, line) in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let numbers: Vec<u64> = cells
            .iter()
            .skip(2)
            .filter_map(|cell| cell.parse().ok())
            .collect();
        let [frame, bytes, footprints, l1, lookups, l2, cycles] = numbers[..] else {
            bail!(
                "{}: line {number}: expected caches, order and 7 counts, found {line}",
                path.display()
            );
        };
        let frame =
            u32::try_from(frame).with_context(|| format!("{}: line {number}", path.display()))?;
        let of_row = |p: &&mut Point| p.caches == cells[0] && p.config.order.name() == cells[1];
        if let Some(point) = points.points.iter_mut().find(of_row) {
            let counts = FrameCounts {
                external_bytes: bytes,
                footprints,
                l1_footprint_misses: l1,
                l2_line_lookups: lookups,
                l2_line_misses: l2,
                cycles,
            };
            point.values.insert(frame, counts);
        }
    }
    Ok(())
}
