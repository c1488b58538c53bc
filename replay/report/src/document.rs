//! What a command found, in every form in which it is written.

use crate::table::Table;
use serde::Serialize;
use sim::model_version::MODEL_VERSION;
use sim::result::TOOL;

/// The result of a command: one JSON object, rows for CSV and Parquet, and text for a terminal.
pub trait Document {
    /// Name and version of the JSON object.
    const SCHEMA: &'static str;
    /// Version of the models behind its figures.
    const MODEL_VERSION: u32 = MODEL_VERSION;
    /// Whether the JSON object is indented.
    const INDENTED: bool = true;
    /// Files of a folder that `--csv` names; none where it names a file of all rows.
    const CSV_FILES: &'static [&'static str] = &[];
    /// Whether JSON and CSV files with the same numbers are written beside the page.
    const FILES_BESIDE_PAGE: bool = true;

    /// Members of the JSON object after its schema and versions.
    fn content(&self) -> impl Serialize;

    /// The rows in full precision.
    fn rows(&self) -> Table;

    /// The tables for a terminal.
    fn text(&self) -> String;

    /// Texts of [`Self::CSV_FILES`].
    fn csv_files(&self) -> Vec<String> {
        Vec::new()
    }

    /// Tables in the JSON object whose columns are the same in every run, for its schema.
    #[cfg(feature = "testing")]
    fn tables() -> Vec<(&'static str, Table)> {
        Vec::new()
    }

    /// The rows as CSV.
    fn csv(&self) -> String {
        self.rows().csv()
    }

    /// As one JSON object.
    ///
    /// # Errors
    /// A figure that is not finite.
    fn json(&self) -> serde_json::Result<String> {
        let object = Envelope::new(Self::SCHEMA, Self::MODEL_VERSION, self.content());
        match Self::INDENTED {
            true => serde_json::to_string_pretty(&object),
            false => serde_json::to_string(&object),
        }
    }
}

/// The members that every JSON object begins with, and those of its document.
#[derive(Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub(crate) struct Envelope<T> {
    schema: &'static str,
    tool: &'static str,
    model_version: u32,
    #[serde(flatten)]
    content: T,
}

impl<T> Envelope<T> {
    /// An object of this schema.
    pub(crate) fn new(schema: &'static str, model_version: u32, content: T) -> Self {
        Self {
            schema,
            tool: TOOL,
            model_version,
            content,
        }
    }
}

/// The schema of a document's JSON object, which has these members.
#[cfg(feature = "testing")]
pub fn published<D: Document, Members: schemars::JsonSchema>() -> formats::schemas::Published {
    let published = formats::schemas::Published::of::<Envelope<Members>>(D::SCHEMA);
    crate::schemas::with_tables(published, D::tables())
}
