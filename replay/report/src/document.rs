//! What a command found, in every form in which it is written.

use crate::table::{Style, Table};
use serde::Serialize;
use sim::figure::Figure;
use sim::model_version::MODEL_VERSION;
use sim::result::TOOL;
use std::collections::BTreeMap;

/// The result of a command: one JSON object, rows for CSV and Parquet, and text for a terminal.
pub trait Document {
    /// Name and version of the JSON object.
    const SCHEMA: &'static str;
    /// Version of the models behind its figures.
    const MODEL_VERSION: u32 = MODEL_VERSION;
    /// Whether the terminal shows more tables with `--details`.
    const HAS_DETAILS: bool = false;
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

    /// Members of the JSON object that have a doubt, by key. Members of table rows are beside their row.
    fn figures(&self) -> BTreeMap<String, Figure> {
        BTreeMap::new()
    }

    /// The sentences that the page and the text for a terminal begin with: what was found, then the machine.
    fn answer(&self) -> Vec<String> {
        Vec::new()
    }

    /// The main table for a terminal, and tables that a flag asks for.
    fn text(&self, style: Style) -> String;

    /// The other tables for a terminal.
    fn details(&self, _: Style) -> String {
        String::new()
    }

    /// The answer and the tables.
    fn terminal(&self, style: Style, with_details: bool) -> String {
        let answer = match style {
            Style::Terminal => {
                let lines = self.answer().into_iter().map(|s| wrapped(&s, LINE_CHARS));
                lines.collect::<Vec<_>>().join("\n")
            }
            Style::Markdown => self.answer().join("\n\n"),
        };
        let parts = [answer, self.text(style)].into_iter();
        let more = match (with_details, Self::HAS_DETAILS) {
            (true, _) => self.details(style),
            (false, true) => "(more tables: --details)".to_owned(),
            (false, false) => String::new(),
        };
        let parts: Vec<String> = (parts.chain([more]))
            .map(|part| part.trim_matches('\n').to_owned())
            .filter(|part| !part.is_empty())
            .collect();
        let mut text = parts.join("\n\n") + "\n";
        while style == Style::Markdown && text.contains("\n\n\n") {
            text = text.replace("\n\n\n", "\n\n");
        }
        text
    }

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
        let mut object = Envelope::new(Self::SCHEMA, Self::MODEL_VERSION, self.content());
        object.figures = self.figures();
        match Self::INDENTED {
            true => serde_json::to_string_pretty(&object),
            false => serde_json::to_string(&object),
        }
    }
}

/// Longest line of a sentence for a terminal.
const LINE_CHARS: usize = 100;

/// A sentence in lines of at most `most` characters, where its words allow it.
fn wrapped(sentence: &str, most: usize) -> String {
    let (mut text, mut chars) = (String::new(), 0);
    for word in sentence.split(' ') {
        let length = word.chars().count();
        if chars > 0 && chars + 1 + length > most {
            text.push('\n');
            chars = 0;
        } else if chars > 0 {
            text.push(' ');
            chars += 1;
        }
        text += word;
        chars += length;
    }
    text
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
    /// Members with their lowest and highest value, and the reason of the difference.
    #[cfg_attr(
        feature = "testing",
        schemars(with = "serde_json::Map<String, serde_json::Value>")
    )]
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    figures: BTreeMap<String, Figure>,
}

impl<T> Envelope<T> {
    /// An object of this schema.
    pub(crate) fn new(schema: &'static str, model_version: u32, content: T) -> Self {
        Self {
            schema,
            tool: TOOL,
            model_version,
            content,
            figures: BTreeMap::new(),
        }
    }
}

/// The schema of a document's JSON object, which has these members.
#[cfg(feature = "testing")]
pub fn published<D: Document, Members: schemars::JsonSchema>() -> formats::schemas::Published {
    let published = formats::schemas::Published::of::<Envelope<Members>>(D::SCHEMA);
    crate::schemas::with_tables(published, D::tables())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Doubtful(Option<Figure>);

    impl Document for Doubtful {
        const SCHEMA: &'static str = "replay.doubtful/1";

        fn content(&self) -> impl Serialize {
            serde_json::json!({ "saved_pct": 42.0 })
        }

        fn rows(&self) -> Table {
            Table::default()
        }

        fn text(&self, _: Style) -> String {
            "table\n".to_owned()
        }

        fn answer(&self) -> Vec<String> {
            vec!["One.".to_owned(), "Two.".to_owned()]
        }

        fn figures(&self) -> BTreeMap<String, Figure> {
            let figure = self.0.iter().cloned();
            figure.map(|f| ("saved_pct".to_owned(), f)).collect()
        }
    }

    #[test]
    fn the_text_begins_with_the_answer_in_lines_that_fit() {
        assert_eq!(
            Doubtful(None).terminal(Style::Terminal, false),
            "One.\nTwo.\n\ntable\n"
        );
        assert_eq!(wrapped("one two three", 8), "one two\nthree");
        assert_eq!(wrapped("overlong", 3), "overlong");
    }

    #[test]
    fn the_json_object_has_figures_only_where_they_exist() {
        let json = |of: Doubtful| -> serde_json::Value {
            serde_json::from_str(&of.json().unwrap()).unwrap()
        };
        let with = json(Doubtful(Some(Figure::exact(42.0))));
        assert_eq!(with["figures"]["saved_pct"]["because"]["doubt"], "exact");
        assert_eq!(with["saved_pct"], 42.0);
        assert!(json(Doubtful(None)).get("figures").is_none());
    }
}
