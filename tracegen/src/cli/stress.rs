//! `tracegen stress`.

use anyhow::Context;
use clap::Args;
use formats::container::ScratchFolder;
use formats::text::json_text;
use lab::stress::{self, SWEEPS};
use shell::{Output, Progress};
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `tracegen stress`.
#[derive(Args, Debug)]
pub struct StressArgs {
    /// Folder for stress.json and stress.md; its other files stay as they are.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Sweeps to run, separated by commas [default: all].
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = names())]
    only: Vec<String>,
    /// Also run points that take minutes and gigabytes: 10 million triangles.
    #[arg(long)]
    full: bool,
}

fn names() -> clap::builder::PossibleValuesParser {
    SWEEPS.iter().map(|sweep| sweep.name).into()
}

/// Runs `tracegen stress`.
///
/// # Errors
/// A folder that cannot be written.
pub fn run(args: &StressArgs) -> anyhow::Result<ExitCode> {
    super::capture_steps::prepare_environment(None);
    shell::Threads::default().start()?;
    shell::check_folder("--output", &args.output)?;
    let [json_file, markdown_file] = ["stress.json", "stress.md"].map(|f| args.output.join(f));
    let outputs = [&json_file, &markdown_file].map(|file| Output::text("--output", file));
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("cannot make {}", args.output.display()))?;
    shell::check_outputs(&outputs, None)?;
    let count = if args.only.is_empty() {
        SWEEPS.len()
    } else {
        args.only.len()
    };
    let scratch = ScratchFolder::create_in(&args.output)
        .with_context(|| format!("cannot make a folder in {}", args.output.display()))?;
    let progress = Progress::new("stress", count as u64, "sweeps");
    let report = stress::run(scratch.path(), &args.only, args.full, |_| {
        progress.advance(1)
    })?;
    drop(progress);
    drop(scratch);
    let json = json_text(&report)?;
    let markdown = report.markdown();
    for (file, text) in [(&json_file, &json), (&markdown_file, &markdown)] {
        shell::write_file(file, text)?;
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
