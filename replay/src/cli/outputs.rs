//! Where a command writes what it found: `--json`, `--csv`, `--parquet` and `--html`.

use super::ConfigArgs;
use crate::files::{check_outputs, write_atomically};
use anyhow::{Context, Result, ensure};
use clap::Arg;
use report::document::Document;
use report::parquet;
use report::plots::PlotError;
use report::table::{Style, Table};
use shell::{Output, is_stdout};
use std::path::{Path, PathBuf};

/// The flag `--parquet`.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct ParquetArg {
    /// Also write the rows as Parquet: typed columns with the names of the CSV's columns
    #[arg(long = "parquet", value_name = "FILE")]
    pub path: Option<PathBuf>,
}

impl ParquetArg {
    /// The output file, if given.
    pub fn output(&self) -> Option<Output> {
        let path = self.path.as_deref()?;
        Some(Output::binary("--parquet", path))
    }

    /// Writes the rows if the flag is given.
    ///
    /// # Errors
    /// A cell that its column's type cannot hold, or a file that cannot be written.
    pub fn write(&self, rows: impl FnOnce() -> Table) -> Result<()> {
        let Some(path) = &self.path else {
            return Ok(());
        };
        let bytes = parquet::bytes(&rows()).with_context(|| path.display().to_string())?;
        write_atomically(path, &bytes)
    }
}

/// Forms of a result.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct Outputs {
    /// Print one JSON object (docs/use/analysis.md names its schema)
    #[arg(long)]
    pub json: bool,
    /// Also write the rows as CSV; without FILE or with -, print them instead of the table
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub csv: Option<PathBuf>,
    #[command(flatten)]
    parquet: ParquetArg,
    /// Also print the tables below the main one: parts, all figures, known errors
    #[arg(long, conflicts_with = "json")]
    details: bool,
    #[command(flatten)]
    style: StyleArg,
}

/// What commands have in common that replay traces and print rows.
#[derive(Debug, clap::Args)]
pub(super) struct ReplayArgs {
    #[command(flatten)]
    pub outputs: Outputs,
    #[command(flatten)]
    pub threads: shell::Threads,
    #[command(flatten)]
    pub machine: ConfigArgs,
}

impl ReplayArgs {
    /// Checks the outputs of a command on traces. Returns whether standard output is free for its result.
    ///
    /// # Errors
    /// An output that cannot be written, or that would replace an input or another output.
    pub fn check<D: Document>(&self, traces: &[PathBuf]) -> Result<bool> {
        let inputs = traces.iter().map(PathBuf::as_path);
        check_outputs(
            &self.outputs.list::<D>()?,
            inputs.chain(self.machine.file()),
        )
    }
}

/// The flag `--markdown`.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct StyleArg {
    /// Print the tables as Markdown
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
}

impl StyleArg {
    /// The style of the tables.
    pub fn style(&self) -> Style {
        match self.markdown {
            true => Style::Markdown,
            false => Style::Terminal,
        }
    }
}

/// `--csv` of a command whose traces may follow the flag.
pub(super) fn csv_before_traces(csv: Arg) -> Arg {
    csv.require_equals(true).conflicts_with("json")
}

/// `--html` of a command that writes no files beside the page.
pub(super) fn page_alone(html: Arg) -> Arg {
    html.help("Also write a page with charts")
}

impl Outputs {
    /// Every output.
    ///
    /// # Errors
    /// A folder for several CSV files that cannot be one, or `--details` of a result without any.
    pub fn list<D: Document>(&self) -> Result<Vec<Output>> {
        ensure!(
            D::HAS_DETAILS || !self.details,
            "--details: this result has no other tables"
        );
        let mut outputs = Vec::new();
        if let Some(path) = &self.csv {
            if D::CSV_FILES.is_empty() || is_stdout(path) {
                outputs.push(Output::text("--csv", path));
            } else {
                shell::check_folder("--csv", path)?;
                let files = D::CSV_FILES.iter().map(|name| path.join(name));
                outputs.extend(files.map(|path| Output::text("--csv", &path)));
            }
        }
        outputs.extend(self.parquet.output());
        outputs.extend(self.json.then(|| Output::result("--json")));
        Ok(outputs)
    }

    /// Writes the rows to the files, and prints the JSON or the tables if `prints`.
    ///
    /// # Errors
    /// A figure that is not finite, or an output that cannot be written.
    pub fn write<D: Document>(&self, document: &D, prints: bool) -> Result<()> {
        match &self.csv {
            Some(path) if is_stdout(path) => super::print(&document.csv())?,
            Some(path) if D::CSV_FILES.is_empty() => {
                write_atomically(path, document.csv().as_bytes())?;
            }
            Some(folder) => {
                for (name, text) in D::CSV_FILES.iter().zip(document.csv_files()) {
                    write_atomically(&folder.join(name), text.as_bytes())?;
                }
            }
            None => {}
        }
        self.parquet.write(|| document.rows())?;
        match (prints, self.json) {
            (false, _) => Ok(()),
            (true, true) => super::print(&document.json()?),
            (true, false) => super::print(&document.terminal(self.style.style(), self.details)),
        }
    }
}

/// Forms of a result that has a page.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct PageOutputs {
    #[command(flatten)]
    pub rows: Outputs,
    /// Also write a page with charts, and JSON and CSV files with the same numbers beside it
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

impl PageOutputs {
    /// Every output.
    ///
    /// # Errors
    /// As of [`Outputs::list`].
    pub fn list<D: Document>(&self) -> Result<Vec<Output>> {
        let mut outputs = self.rows.list::<D>()?;
        let pages = self.html.iter();
        outputs.extend(pages.flat_map(|path| page_outputs::<D>("--html", path)));
        Ok(outputs)
    }

    /// Writes the files, and prints the JSON or the tables if `prints`.
    ///
    /// # Errors
    /// A plot that cannot be drawn, and those of [`Outputs::write`].
    pub fn write<D: Document>(
        &self,
        document: &D,
        prints: bool,
        page: impl FnOnce() -> Result<String, PlotError>,
    ) -> Result<()> {
        if let Some(path) = &self.html {
            write_page(path, document, &page()?)?;
        }
        self.rows.write(document, prints)
    }
}

/// The page at `path`, and files with the same numbers; for standard output, only the page.
pub(super) fn page_outputs<D: Document>(flag: &'static str, path: &Path) -> Vec<Output> {
    let mut outputs = vec![Output::text(flag, path)];
    if D::FILES_BESIDE_PAGE && !is_stdout(path) {
        outputs.extend(["json", "csv"].map(|e| Output::text(flag, &path.with_extension(e))));
    }
    outputs
}

/// Writes a page, and files with the same numbers.
///
/// # Errors
/// A figure that is not finite, or a file that cannot be written.
pub(super) fn write_page<D: Document>(path: &Path, document: &D, page: &str) -> Result<()> {
    if D::FILES_BESIDE_PAGE && !is_stdout(path) {
        let json = document.json()? + "\n";
        write_atomically(&path.with_extension("json"), json.as_bytes())?;
        write_atomically(&path.with_extension("csv"), document.csv().as_bytes())?;
    }
    write_atomically(path, page.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use studies::experiment::Objective;

    #[derive(Debug, Parser)]
    struct Line {
        traces: Vec<PathBuf>,
        #[command(flatten)]
        outputs: Outputs,
    }

    #[derive(Debug, Parser)]
    #[command(mut_arg("csv", csv_before_traces))]
    struct TracesLast {
        traces: Vec<PathBuf>,
        #[command(flatten)]
        outputs: Outputs,
    }

    #[test]
    fn csv_without_a_file_is_printed() {
        let csv = |words: &[&str]| Line::try_parse_from(words).unwrap().outputs.csv;
        let (stdout, file) = (Some(PathBuf::from("-")), Some(PathBuf::from("rows.csv")));
        assert_eq!(csv(&["x", "a", "--csv"]), stdout);
        assert_eq!(csv(&["x", "--csv", "--json"]), stdout);
        assert_eq!(csv(&["x", "a", "--csv", "rows.csv"]), file);
        assert_eq!(csv(&["x", "--csv=rows.csv", "a"]), file);
    }

    #[test]
    fn a_trace_after_the_flag_is_no_file_for_the_rows() {
        let parse = |words: &[&str]| TracesLast::try_parse_from(words);
        let line = parse(&["x", "--csv", "a"]).unwrap();
        assert_eq!(line.outputs.csv, Some(PathBuf::from("-")));
        assert_eq!(line.traces, [PathBuf::from("a")]);
        let line = parse(&["x", "--csv=rows.csv", "a"]).unwrap();
        assert_eq!(line.outputs.csv, Some(PathBuf::from("rows.csv")));
        let error = parse(&["x", "--csv", "--json", "a"])
            .unwrap_err()
            .to_string();
        assert!(error.contains("cannot be used with"), "{error}");
    }

    #[test]
    fn rows_are_written_to_a_file_beside_the_table_and_printed_instead_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("rows.csv");
        let outputs = |csv: &Path| Outputs {
            csv: Some(csv.to_owned()),
            ..Outputs::default()
        };
        let report = report::calibration::CalibrationReport::new(
            sim::config::RunConfig::default(),
            Objective::Surface,
            Vec::new(),
        );
        let of_file = outputs(&file);
        let list = of_file
            .list::<report::calibration::CalibrationReport>()
            .unwrap();
        assert!(crate::files::check_outputs(&list, []).unwrap());
        of_file.write(&report, false).unwrap();
        let text = std::fs::read_to_string(file).unwrap();
        assert_eq!(text, "settings,chosen_by,held_out\n");
        let list = outputs(Path::new("-"));
        let list = list
            .list::<report::calibration::CalibrationReport>()
            .unwrap();
        assert!(!crate::files::check_outputs(&list, []).unwrap());
    }
}
