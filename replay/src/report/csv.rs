//! Comma-separated values (RFC 4180) in full precision.

use std::fmt::Display;
use std::fmt::Write as _;

/// A CSV text under construction.
#[derive(Clone, Debug)]
pub struct Csv {
    text: String,
}

impl Csv {
    /// Begins with the heading line.
    #[must_use]
    pub fn new(columns: &[&str]) -> Self {
        let mut csv = Self {
            text: String::new(),
        };
        let mut row = csv.row();
        for column in columns {
            row = row.text(column);
        }
        drop(row);
        csv
    }

    /// Begins a row; it ends when the value is dropped.
    pub fn row(&mut self) -> CsvRow<'_> {
        CsvRow {
            text: &mut self.text,
            first: true,
        }
    }

    /// The text.
    #[must_use]
    pub fn finish(self) -> String {
        self.text
    }
}

/// A row under construction.
#[derive(Debug)]
pub struct CsvRow<'a> {
    text: &'a mut String,
    first: bool,
}

impl CsvRow<'_> {
    /// Adds a cell of text, quoted where it must be.
    #[must_use = "the row ends when it is dropped"]
    pub fn text(mut self, cell: &str) -> Self {
        if !std::mem::take(&mut self.first) {
            self.text.push(',');
        }
        if cell.contains([',', '"', '\n', '\r']) {
            let _ = write!(self.text, "\"{}\"", cell.replace('"', "\"\""));
        } else {
            self.text.push_str(cell);
        }
        self
    }

    /// Adds a number.
    #[must_use = "the row ends when it is dropped"]
    pub fn value(self, cell: impl Display) -> Self {
        self.text(&cell.to_string())
    }

    /// Adds a number or an empty cell.
    #[must_use = "the row ends when it is dropped"]
    pub fn maybe(self, cell: Option<impl Display>) -> Self {
        self.text(&cell.map_or_else(String::new, |c| c.to_string()))
    }
}

impl Drop for CsvRow<'_> {
    fn drop(&mut self) {
        self.text.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_commas_and_quotes_are_quoted() {
        let mut csv = Csv::new(&["name", "value"]);
        drop(csv.row().text("a, \"b\"").value(0.5));
        drop(csv.row().text("c").maybe(None::<f64>));
        assert_eq!(csv.finish(), "name,value\n\"a, \"\"b\"\"\",0.5\nc,\n");
    }
}
