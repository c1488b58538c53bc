//! `replay paper`: prints the Z2 paper's experiment as a table.

use super::experiment_args::{ExperimentArgs, page_outputs, write_report};
use super::parquet_arg::ParquetArg;
use crate::files::write_atomically;
use anyhow::{Result, ensure};
use report::errors::{self, Of};
use report::z2::model::PaperReport;
use report::z2::tables;
use shell::{Output, is_stdout};
use std::fmt::Write as _;
use std::path::PathBuf;
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
    /// Print one JSON object (schema replay.paper/3)
    #[arg(long)]
    json: bool,
    /// Also write the rows as CSV; - writes them to standard output instead of the table
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    parquet: ParquetArg,
    /// Also write the report page, and JSON and CSV files with the same numbers
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    #[command(flatten)]
    experiment: ExperimentArgs,
}

/// Runs the subcommand. Exit code 1 if the orders replayed different accesses.
///
/// # Errors
/// Wrong arguments, an unreadable trace, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    let page = args.html.is_some();
    ensure!(
        page || !args.experiment.has_pictures(),
        "--image: needs --html, because only the page shows pictures"
    );
    let mut outputs: Vec<Output> = Vec::new();
    outputs.extend(args.csv.iter().map(|path| Output::text("--csv", path)));
    outputs.extend(
        args.html
            .iter()
            .flat_map(|path| page_outputs("--html", path)),
    );
    outputs.extend(args.parquet.output());
    outputs.extend(args.json.then(|| Output::result("--json")));
    let files = args.csv.iter().chain(&args.html);
    let prints = !args.parquet.takes_stdout() && !files.into_iter().any(|path| is_stdout(path));
    let functional = args.functional || page;
    args.experiment
        .run(&outputs, functional, page, |report, pictures| {
            if let Some(path) = &args.csv {
                write_atomically(path, report.csv().as_bytes())?;
            }
            args.parquet.write(|| report.table())?;
            if let Some(path) = &args.html {
                write_report(report, pictures, path)?;
            }
            if prints {
                super::print(&if args.json {
                    report.json()?
                } else {
                    text(report)
                })?;
            }
            Ok(())
        })
}

/// The tables as text for a terminal.
pub fn text(report: &PaperReport) -> String {
    let mut text = tables::table_2(report).text();
    let _ = write!(text, "\n{}", tables::averages(&report.averages).text());
    if let Some(table) = tables::as_the_paper_counts(report) {
        let _ = write!(
            text,
            "\nCounted as in the paper (--preset z2-paper): first look-ups, with merged requests; memory traffic is in the columns on the right\n{}",
            table.text()
        );
    }
    if let Some(modes) = tables::modes(report) {
        let _ = write!(text, "\n{}", modes.text());
    }
    let fit = &report.closed_form;
    if fit.rows > 0 {
        let _ = write!(
            text,
            "\nTMU utilisation against the paper's surface, at first look-ups: mean absolute deviation {:.2} points, maximum {:.2}, over {} rows\n",
            fit.mean_absolute_points, fit.largest_points, fit.rows
        );
    }
    text += &errors::text(Of::Textures);
    for c in report
        .conservation
        .iter()
        .filter(|c| c.differing.is_empty())
    {
        let _ = writeln!(
            text,
            "{}: {} runs replayed the same accesses ({})",
            c.scene, c.runs, c.access_hash
        );
    }
    text
}
