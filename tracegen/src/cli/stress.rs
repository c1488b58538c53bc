//! `tracegen stress`.

use crate::stress::{self, SWEEPS};
use anyhow::Context;
use clap::Args;
use shell::Progress;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `tracegen stress`.
#[derive(Args, Debug)]
pub struct StressArgs {
    /// Folder for stress.json, stress.md and scratch files.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Sweeps to run, separated by commas [default: all].
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = names())]
    only: Vec<String>,
    /// Also points that take minutes and gigabytes: 10 million triangles.
    #[arg(long)]
    full: bool,
}

fn names() -> clap::builder::PossibleValuesParser {
    SWEEPS.each_ref().map(|sweep| sweep.name).into()
}

/// Runs `tracegen stress`.
///
/// # Errors
/// A folder that cannot be written.
pub fn run(args: &StressArgs) -> anyhow::Result<ExitCode> {
    super::raster::prepare_environment(None);
    let count = if args.only.is_empty() {
        SWEEPS.len()
    } else {
        args.only.len()
    };
    let progress = Progress::new("stress", count as u64, "sweeps");
    let scratch = args.output.join("scratch");
    let report = stress::run(&scratch, &args.only, args.full, |_| progress.advance(1))?;
    drop(progress);
    std::fs::remove_dir_all(&scratch)
        .with_context(|| format!("cannot remove {}", scratch.display()))?;
    let json = serde_json::to_string_pretty(&report)? + "\n";
    let markdown = report.markdown();
    for (name, text) in [("stress.json", &json), ("stress.md", &markdown)] {
        let path = args.output.join(name);
        std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    shell::print(&markdown)?;
    let broken = report.broken();
    if broken > 0 {
        shell::error(&format!(
            "{broken} points are beyond their bounds and nothing was said"
        ));
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}
