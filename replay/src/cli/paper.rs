//! `replay paper`: prints the Z2 paper's experiment as a table.

use super::experiment_args::ExperimentArgs;
use super::outputs::PageOutputs;
use anyhow::{Result, ensure};
use report::picture::EmbeddedPicture;
use report::z2::model::PaperReport;
use report::z2::page;
use std::process::ExitCode;

/// Arguments of `replay paper`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay paper crytek.textrace
  replay paper *.textrace --orders all --csv table.csv --parquet table.parquet
  replay paper mine.textrace --as crytek-sponza --html out/report.html
  replay paper a.textrace --preset z2-paper --json")]
pub struct Args {
    /// Also replay in functional mode and show the difference
    #[arg(long)]
    functional: bool,
    #[command(flatten)]
    outputs: PageOutputs,
    #[command(flatten)]
    experiment: ExperimentArgs,
}

/// Runs the subcommand. Exit code 1 if the orders replayed different accesses.
///
/// # Errors
/// Wrong arguments, an unreadable trace, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    let page = args.outputs.html.is_some();
    ensure!(
        page || !args.experiment.has_pictures(),
        "--image: needs --html, because only the page shows pictures"
    );
    let outputs = args.outputs.list::<PaperReport>()?;
    let functional = args.functional || page;
    let write = |report: &PaperReport, pictures: &[EmbeddedPicture], prints| {
        let page = || page::page(report, pictures);
        args.outputs.write(report, prints, page)
    };
    args.experiment.run(&outputs, functional, page, write)
}
