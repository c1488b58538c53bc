//! Reads results files and writes Markdown tables.

use std::collections::BTreeMap;
use std::path::Path;

/// A row by column name.
pub type Row = BTreeMap<String, String>;

/// The content of a results file.
pub struct Results {
    /// Commands that made it, one or more.
    pub commands: Vec<String>,
    /// Column names in their order.
    pub columns: Vec<String>,
    /// Rows in their order.
    pub rows: Vec<Row>,
}

impl Results {
    /// Reads a file of [`super`]'s form.
    ///
    /// # Errors
    /// The file is unreadable, has no command, two columns with the same name, or rows of different
    /// lengths.
    pub fn read(file: &Path) -> Result<Self, String> {
        let name = file.display();
        let text = std::fs::read_to_string(file).map_err(|e| format!("{name}: {e}"))?;
        let commands: Vec<String> = (text.lines())
            .filter_map(|line| line.strip_prefix("# command: "))
            .map(str::to_owned)
            .collect();
        if commands.is_empty() {
            return Err(format!(
                "{name}: expected a line '# command: ...', found none"
            ));
        }
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let rows = reader.deserialize().collect::<Result<Vec<Row>, _>>();
        let columns = reader
            .headers()
            .map(|h| h.iter().map(str::to_owned).collect());
        let columns: Vec<String> = columns.map_err(|e| format!("{name}: {e}"))?;
        // Rows are indexed by column name, so duplicate names would show the last column twice.
        if let Some(twice) = (1..columns.len()).find(|&i| columns[..i].contains(&columns[i])) {
            return Err(format!(
                "{name}: expected column names that differ, found '{}' twice",
                columns[twice]
            ));
        }
        Ok(Self {
            commands,
            columns,
            rows: rows.map_err(|e| format!("{name}: {e}"))?,
        })
    }

    /// Every column and row.
    pub fn full_table(&self) -> String {
        let cells = |row: &Row| self.columns.iter().map(|c| row[c].clone()).collect();
        let headings: Vec<&str> = self.columns.iter().map(String::as_str).collect();
        markdown(&headings, self.rows.iter().map(cells))
    }

    /// The number in a column of the row with these keys, with `decimals` decimals.
    ///
    /// # Panics
    /// There is no such row or number.
    pub fn number(&self, keys: &[(&str, &str)], column: &str, decimals: usize) -> String {
        let is = |row: &&Row| keys.iter().all(|(key, value)| row[*key] == *value);
        let row = self.rows.iter().find(is);
        let row = row.unwrap_or_else(|| panic!("no row of {keys:?}"));
        rounded(&row[column], decimals)
    }

    /// The distinct values of a column, in order.
    pub fn values(&self, column: &str) -> Vec<String> {
        let mut values: Vec<String> = Vec::new();
        for row in &self.rows {
            if !values.contains(&row[column]) {
                values.push(row[column].clone());
            }
        }
        values
    }
}

/// A number with `decimals` decimals.
///
/// # Panics
/// The text is not a number.
pub fn rounded(text: &str, decimals: usize) -> String {
    let number: f64 = text
        .parse()
        .unwrap_or_else(|_| panic!("no number: '{text}'"));
    format!("{number:.decimals$}")
}

/// A table with these headings and rows.
pub fn markdown(headings: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let headings: Vec<String> = headings.iter().map(|&h| h.to_owned()).collect();
    let mut text = line(&headings) + &line(&vec!["---".to_owned(); headings.len()]);
    text.extend(rows.into_iter().map(|row| line(&row)));
    text
}
