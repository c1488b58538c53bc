//! The flag `--parquet` of every command that writes its rows as CSV.

use crate::files::write_atomically;
use anyhow::{Context, Result};
use report::parquet;
use report::table::Table;
use shell::{Output, is_stdout};
use std::path::PathBuf;

/// The flag.
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

    /// Whether it writes to standard output instead of the command's result.
    pub(super) fn takes_stdout(&self) -> bool {
        self.path.as_deref().is_some_and(is_stdout)
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
