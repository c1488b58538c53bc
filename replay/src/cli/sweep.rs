//! `replay sweep`: the points of an experiment file.

use super::config_args::read_toml;
use super::subjects::Traces;
use crate::experiment::{self, ExperimentFile, Point, Store};
use crate::files::{self, write_atomically};
use crate::report::sweep::SweepReport;
use anyhow::{Context, Result, ensure};
use shell::{Output, Progress};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `replay sweep`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay sweep replay/experiments/caches.toml crytek.textrace --out out/caches
  replay sweep replay/experiments/open-choices.toml *.textrace --out out/open-choices --json

A sweep that was stopped goes on where it stopped when it is started again with the same --out.")]
pub struct Args {
    /// Experiment: [base], [axes] and [one-at-a-time] over keys of the configuration
    experiment: PathBuf,
    /// Texture traces; win over the file's own list
    traces: Vec<PathBuf>,
    /// Folder for results.json, results.csv, report.html and points/ [default: out/NAME]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object (schema replay.sweep/1)
    #[arg(long)]
    json: bool,
    /// Print the points and stop
    #[arg(long, conflicts_with_all = ["json", "out"])]
    plan: bool,
    #[command(flatten)]
    threads: shell::Threads,
}

/// Runs the subcommand.
///
/// # Errors
/// A bad experiment file, an unreadable trace, an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.threads.start()?;
    let name = args.experiment.display();
    let file = ExperimentFile::parse(&read_toml(&args.experiment)?);
    let file = file.with_context(|| name.to_string())?;
    let plan = file.plan().with_context(|| name.to_string())?;
    if args.plan {
        let titles: Vec<String> = plan.points.iter().map(Point::title).collect();
        super::print(&titles.join("\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let paths = trace_paths(args, &file);
    ensure!(
        !paths.is_empty(),
        "{name}: no traces: name them in `traces` or on the command line"
    );
    let stem = args.experiment.file_stem().unwrap_or_default();
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| Path::new("out").join(stem));
    let outputs = ["results.json", "results.csv", "report.html"].map(|name| out.join(name));
    let inputs = paths.iter().chain([&args.experiment]).map(PathBuf::as_path);
    let checked = outputs.each_ref().map(|path| Output::text("--out", path));
    files::check_outputs(&checked, inputs)?;
    let traces = Traces::open(&paths)?;
    let subjects = traces.subjects();

    let points = subjects.len() * plan.points.len();
    let progress = Progress::new("replaying", points as u64, "points");
    let store = Store::new(&out);
    let done = |done| progress.advance(done);
    let outcome = experiment::run(&plan, &subjects, Some(&store), &done)?;
    drop(progress);
    shell::note(&outcome.shared());

    let report = SweepReport::new(&file, &outcome);
    let json = report.json()?;
    let page = report.page(&format!("Parallax sweep: {}", stem.to_string_lossy()))?;
    let contents = [format!("{json}\n"), report.csv(), page];
    for (path, text) in outputs.iter().zip(contents) {
        write_atomically(path, text.as_bytes())?;
    }
    super::print(&if args.json {
        json
    } else {
        report.table().text()
    })?;
    Ok(ExitCode::SUCCESS)
}

/// The command line's traces, or the file's, which are relative to it.
fn trace_paths(args: &Args, file: &ExperimentFile) -> Vec<PathBuf> {
    if !args.traces.is_empty() {
        return args.traces.clone();
    }
    let folder = args.experiment.parent().unwrap_or(Path::new(""));
    file.traces.iter().map(|t| folder.join(t)).collect()
}
