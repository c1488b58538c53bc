//! The command line, one file a subcommand.

mod config_args;
pub mod convert;
pub mod diff;
pub mod dump;
mod experiment_args;
pub mod info;
mod paper;
mod report;
mod reproject;
mod run;
mod sweep;
#[cfg(test)]
mod testing;
mod tiles;
pub mod validate;

pub use config_args::ConfigArgs;

use crate::result::TraceId;
use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use formats::textrace::Textrace;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

/// Exit code of wrong use or unreadable input; clap's own, too.
const USAGE: u8 = 2;

/// Replays Parallax traces through cache, texture-unit and ray-tracing-unit models.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Replay one trace in one tile order through one cache configuration.
    Run(Box<run::Args>),
    /// Print what a trace holds.
    Info(info::InfoArgs),
    /// Check every checksum and invariant of a trace.
    Validate(validate::ValidateArgs),
    /// Print decoded records, quads or rays, as JSON Lines.
    Dump(dump::DumpArgs),
    /// Print the first difference between two traces.
    Diff(diff::DiffArgs),
    /// Write a trace's accesses for other simulators, or the trace in another encoding.
    Convert(Box<convert::ConvertArgs>),
    /// Replay the Z2 paper's experiment: its caches and orders, beside its published figures.
    Paper(Box<paper::Args>),
    /// Replay every point of an experiment file; goes on where it stopped.
    Sweep(sweep::Args),
    /// Write the experiment as one self-contained page, with JSON and CSV beside it.
    Report(Box<report::Args>),
    /// Replay ray traces through a ray-tracing GPU that reuses the left image for the right.
    Reproject(Box<reproject::ReprojectArgs>),
}

/// Parses the command line and runs it. Errors go to stderr.
#[must_use]
pub fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Run(args) => run::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Validate(args) => validate::run(&args),
        Command::Dump(args) => dump::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Paper(args) => paper::run(&args),
        Command::Sweep(args) => sweep::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Reproject(args) => reproject::run(*args),
    };
    match outcome {
        Ok(code) => code,
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            anstream::eprintln!("error: {error:#}");
            ExitCode::from(USAGE)
        }
    }
}

/// True where the reader of our output has gone: `replay ... | head` is no failure.
fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let io = error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<io::Error>());
    io.into_iter()
        .any(|cause| cause.kind() == io::ErrorKind::BrokenPipe)
}

/// Writes a result to stdout, with a line feed at its end.
///
/// # Errors
/// Those of writing.
pub fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{}", text.trim_end_matches('\n'))?;
    Ok(out.flush()?)
}

/// Opens a texture trace and names it as results do.
///
/// # Errors
/// The file cannot be read or is damaged.
pub fn open_textrace(path: &Path) -> Result<(Textrace, TraceId)> {
    let trace = Textrace::open(path)?;
    let id = TraceId {
        scene: trace.tables().meta.scene.clone(),
        checksum: format!("{:08x}", trace.file_checksum()),
    };
    Ok((trace, id))
}

/// Limits rayon to `threads`, if given. Results never depend on it.
///
/// # Errors
/// The threads cannot be started.
pub fn set_threads(threads: Option<usize>) -> Result<()> {
    let Some(threads) = threads else {
        return Ok(());
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .context("--threads")
}
