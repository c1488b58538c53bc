//! Tables for the page and, with the same cells, for the terminal and CSV.

use comfy_table::{CellAlignment, ContentArrangement, Table as Terminal, presets};
use maud::{Markup, html};

/// A column: heading and unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Heading.
    pub name: String,
    /// Unit, empty where there is none.
    pub unit: String,
    /// Numbers are set flush right.
    pub numeric: bool,
    /// Holds published figures, set in a lighter ink.
    pub published: bool,
}

impl Column {
    /// A column of text.
    pub fn text(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            unit: String::new(),
            numeric: false,
            published: false,
        }
    }

    /// A column of numbers.
    pub fn number(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            numeric: true,
            published: false,
        }
    }

    /// A column of published numbers.
    pub fn published(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            published: true,
            ..Self::number(name, unit)
        }
    }
}

/// A table of formatted cells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Columns.
    pub columns: Vec<Column>,
    /// Rows of cells, one a column.
    pub rows: Vec<Vec<String>>,
    /// Rows that begin a group, by index: a rule is drawn above them.
    pub group_starts: Vec<usize>,
    /// Text above the table.
    pub caption: String,
}

impl Table {
    /// An empty table.
    #[must_use]
    pub fn new(columns: Vec<Column>) -> Self {
        Self {
            columns,
            ..Self::default()
        }
    }

    /// Begins a group with the next row.
    pub fn begin_group(&mut self) {
        self.group_starts.push(self.rows.len());
    }

    /// Adds a row.
    pub fn push(&mut self, row: Vec<String>) {
        debug_assert_eq!(row.len(), self.columns.len());
        self.rows.push(row);
    }

    /// As HTML; scrolls in its own box, with the headings staying in view.
    #[must_use]
    pub fn markup(&self) -> Markup {
        let class = |column: &Column| match (column.numeric, column.published) {
            (true, true) => "num paper",
            (true, false) => "num",
            (false, true) => "paper",
            (false, false) => "",
        };
        html! {
            div.scroll.tall {
                table {
                    @if !self.caption.is_empty() { caption { (self.caption) } }
                    thead { tr {
                        @for c in &self.columns {
                            th class=(class(c)) scope="col" {
                                (c.name)
                                @if !c.unit.is_empty() { small { (c.unit) } }
                            }
                        }
                    } }
                    tbody {
                        @for (i, row) in self.rows.iter().enumerate() {
                            tr class=(if i > 0 && self.group_starts.contains(&i) { "first" } else { "" }) {
                                @for (cell, c) in row.iter().zip(&self.columns) {
                                    td class=(class(c)) { (cell) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    /// As text for a terminal; never wrapped, so that it can be piped and compared.
    #[must_use]
    pub fn text(&self) -> String {
        let mut table = Terminal::new();
        table
            .load_style(presets::NOTHING)
            .set_content_arrangement(ContentArrangement::Disabled)
            .set_header(self.columns.iter().map(|c| {
                if c.unit.is_empty() {
                    c.name.clone()
                } else {
                    format!("{}\n{}", c.name, c.unit)
                }
            }));
        for (i, row) in self.rows.iter().enumerate() {
            if i > 0 && self.group_starts.contains(&i) {
                table.add_row(self.columns.iter().map(|_| ""));
            }
            table.add_row(row);
        }
        for (i, column) in self.columns.iter().enumerate() {
            if let Some(c) = table.column_mut(i) {
                c.set_padding((0, 2));
                if column.numeric {
                    c.set_cell_alignment(CellAlignment::Right);
                }
            }
        }
        let text = table.to_string();
        text.lines()
            .map(str::trim_end)
            .collect::<Vec<_>>()
            .join("\n")
            + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut t = Table::new(vec![
            Column::text("order"),
            Column::number("L1 miss", "%"),
            Column::published("paper", "%"),
        ]);
        t.begin_group();
        t.push(vec!["morton".into(), "16.14".into(), "16.14".into()]);
        t.begin_group();
        t.push(vec!["z2-sta".into(), "9.81".into(), "".into()]);
        t
    }

    #[test]
    fn text_has_units_and_right_aligned_numbers() {
        assert_eq!(
            table().text(),
            "order   L1 miss  paper\n              %      %\nmorton    16.14  16.14\n\nz2-sta     9.81\n"
        );
    }

    #[test]
    fn markup_marks_numbers_and_published_figures() {
        let markup = table().markup().into_string();
        assert!(markup.contains("<td class=\"num\">9.81</td>"));
        assert!(markup.contains("<td class=\"num paper\">16.14</td>"));
        assert!(markup.contains("<small>%</small>"));
    }
}
