//! `replay sweep`: the points of an experiment file.

use crate::report::files::write_atomically;
use crate::report::z2::experiment::{Subject, labels, twin_of};
use crate::sweep::{self, Experiment, Store, SweepReport};
use anyhow::{Context, Result, ensure};
use shell::Progress;
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
    #[arg(long)]
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
    let file = args.experiment.display();
    let text = std::fs::read_to_string(&args.experiment).with_context(|| file.to_string())?;
    let experiment = Experiment::parse(&text).with_context(|| file.to_string())?;
    let points = experiment.points().with_context(|| file.to_string())?;
    if args.plan {
        let titles: Vec<String> = points.iter().map(sweep::Point::title).collect();
        super::print(&titles.join("\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let paths = trace_paths(args, &experiment);
    ensure!(
        !paths.is_empty(),
        "{file}: no traces: name them in `traces` or on the command line"
    );
    let opened = paths
        .iter()
        .map(|p| super::open_textrace(p))
        .collect::<Result<Vec<_>>>()?;
    let names = labels(
        &opened
            .iter()
            .map(|(t, id)| (t.tables(), id))
            .collect::<Vec<_>>(),
    );
    let subjects: Vec<Subject> = opened
        .iter()
        .zip(names)
        .map(|((trace, id), label)| Subject {
            source: trace,
            id: id.clone(),
            twin: twin_of(trace.tables()),
            label,
        })
        .collect();

    let name = args
        .experiment
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy();
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| Path::new("out").join(&*name));
    let total = subjects.len() * points.len();
    let progress = Progress::new("replaying", total as u64, "points");
    let outcome = sweep::run(&subjects, &points, &Store::new(&out), &|| {
        progress.advance(1);
    })?;
    drop(progress);
    shell::note(&format!(
        "{} points computed, {} taken from {}",
        outcome.computed,
        total - outcome.computed,
        out.display()
    ));

    let report = SweepReport::new(&experiment, &subjects, &points, &outcome);
    let json = serde_json::to_string(&report)?;
    write_atomically(&out.join("results.json"), format!("{json}\n").as_bytes())?;
    write_atomically(&out.join("results.csv"), sweep::csv(&report).as_bytes())?;
    let page = sweep::page(&format!("Parallax sweep: {name}"), &report)?;
    write_atomically(&out.join("report.html"), page.as_bytes())?;
    super::print(&if args.json {
        json
    } else {
        sweep::table(&report).text()
    })?;
    Ok(ExitCode::SUCCESS)
}

/// The command line's traces, or the file's, which are relative to it.
fn trace_paths(args: &Args, experiment: &Experiment) -> Vec<PathBuf> {
    if !args.traces.is_empty() {
        return args.traces.clone();
    }
    let folder = args.experiment.parent().unwrap_or(Path::new(""));
    experiment.traces.iter().map(|t| folder.join(t)).collect()
}
