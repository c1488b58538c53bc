//! `replay report`: the Z2 paper's experiment as a page.

use super::experiment_args::{ExperimentArgs, page_outputs, write_page};
use anyhow::Result;
use shell::is_stdout;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `replay report`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay report crytek.textrace -o out/report.html
  replay report crytek.textrace --image crytek-sponza=crytek.png -o out/report.html
  replay report *.textrace --orders all -o out/report.html")]
pub struct Args {
    #[command(flatten)]
    experiment: ExperimentArgs,
    /// The page; JSON and CSV with the same numbers are written beside it
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Runs the subcommand; exit code 1 when the orders replayed different accesses.
///
/// # Errors
/// Wrong arguments, an unreadable trace, an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    let outputs = page_outputs("--output", &args.output);
    args.experiment.run(&outputs, true, true, |report| {
        write_page(report, &args.experiment.pictures(report)?, &args.output)?;
        if !is_stdout(&args.output) {
            super::print(&args.output.display().to_string())?;
        }
        Ok(())
    })
}
