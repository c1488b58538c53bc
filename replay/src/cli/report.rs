//! `replay report`: writes the Z2 paper's experiment as a page.

use super::experiment_args::{ExperimentArgs, page_outputs, write_report};
use super::parquet_arg::ParquetArg;
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
    /// Page to write; JSON and CSV files with the same numbers are written next to it
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    parquet: ParquetArg,
    #[command(flatten)]
    experiment: ExperimentArgs,
}

/// Runs the subcommand. Exit code 1 if the orders replayed different accesses.
///
/// # Errors
/// Wrong arguments, an unreadable trace, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut outputs = page_outputs("--output", &args.output);
    outputs.extend(args.parquet.output());
    args.experiment
        .run(&outputs, true, true, |report, pictures| {
            write_report(report, pictures, &args.output)?;
            args.parquet.write(|| report.table())?;
            if !is_stdout(&args.output) && !args.parquet.takes_stdout() {
                super::print(&args.output.display().to_string())?;
            }
            Ok(())
        })
}
