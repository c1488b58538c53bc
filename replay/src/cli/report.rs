//! `replay report`: writes the Z2 paper's experiment as a page.

use super::experiment_args::ExperimentArgs;
use super::outputs::{ParquetArg, page_outputs, write_page};
use anyhow::Result;
use report::document::Document;
use report::picture::EmbeddedPicture;
use report::z2::model::PaperReport;
use report::z2::page;
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
    let mut outputs = page_outputs::<PaperReport>("--output", &args.output);
    outputs.extend(args.parquet.output());
    let write = |report: &PaperReport, pictures: &[EmbeddedPicture], prints| {
        write_page(&args.output, report, &page::page(report, pictures)?)?;
        args.parquet.write(|| report.rows())?;
        match prints {
            true => super::print(&args.output.display().to_string()),
            false => Ok(()),
        }
    };
    args.experiment.run(&outputs, true, true, write)
}
