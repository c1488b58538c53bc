//! A table: as text for a terminal, as HTML, and as CSV.

use super::columns::{Column, Heading, Show, Value};
use formats::text::printable;
use maud::{Markup, html};

/// Cells under headings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Headings.
    pub headings: Vec<Heading>,
    /// Rows with one cell per heading.
    pub rows: Vec<Vec<Value>>,
    /// Text above the table on the page.
    pub caption: &'static str,
    /// Rows are separated by a line where one of this many leading cells changes.
    groups: usize,
}

impl Table {
    /// The cells of `rows` under `columns`.
    pub fn new<'r, R: 'r + ?Sized>(
        columns: &[Column<R>],
        rows: impl IntoIterator<Item = &'r R>,
    ) -> Self {
        Self {
            headings: columns.iter().map(|c| c.heading.clone()).collect(),
            rows: rows
                .into_iter()
                .map(|row| columns.iter().map(|c| c.value(row)).collect())
                .collect(),
            ..Self::default()
        }
    }

    /// Separates rows where one of the first `cells` cells changes.
    #[must_use]
    pub fn grouped_by(mut self, cells: usize) -> Self {
        self.groups = cells;
        self
    }

    /// The columns with these keys, in the order of `keys`. Skips unknown keys.
    #[must_use]
    pub fn picked<'k>(&self, keys: impl IntoIterator<Item = &'k str>) -> Self {
        let at = |key: &str| self.headings.iter().position(|h| h.key == key);
        let columns: Vec<usize> = keys.into_iter().filter_map(at).collect();
        let pick = |row: &Vec<Value>| columns.iter().map(|&c| row[c].clone()).collect();
        Self {
            headings: columns.iter().map(|&c| self.headings[c].clone()).collect(),
            rows: self.rows.iter().map(pick).collect(),
            caption: self.caption,
            groups: 0,
        }
    }

    /// The rows with this text in the cell under `key`.
    #[must_use]
    pub fn only(&self, key: &str, text: &str) -> Self {
        let column = self.headings.iter().position(|h| h.key == key);
        let same = |row: &&Vec<Value>| column.is_some_and(|c| row[c].exact() == text);
        Self {
            rows: self.rows.iter().filter(same).cloned().collect(),
            ..self.clone()
        }
    }

    /// Removes the columns without any value.
    #[must_use]
    pub fn without_empty_columns(mut self) -> Self {
        let used: Vec<bool> = (0..self.headings.len())
            .map(|i| self.rows.iter().any(|row| row[i] != Value::None))
            .collect();
        let mut keep = used.iter();
        self.headings.retain(|_| *keep.next().unwrap_or(&true));
        for row in &mut self.rows {
            let mut keep = used.iter();
            row.retain(|_| *keep.next().unwrap_or(&true));
        }
        self
    }

    /// The cells as text.
    #[must_use]
    pub fn cells(&self) -> Vec<Vec<String>> {
        let cell = |(value, heading): (&Value, &Heading)| {
            printable(&heading.show.write(value)).into_owned()
        };
        self.rows
            .iter()
            .map(|row| row.iter().zip(&self.headings).map(cell).collect())
            .collect()
    }

    fn begins_group(&self, row: usize) -> bool {
        row > 0 && self.rows[row - 1][..self.groups] != self.rows[row][..self.groups]
    }

    /// As text for a terminal. Lines are not wrapped, so the output can be piped and compared.
    #[must_use]
    pub fn text(&self) -> String {
        let names = self
            .headings
            .iter()
            .map(|h| printable(&h.name).into_owned())
            .collect();
        let mut lines: Vec<Vec<String>> = vec![names];
        if self.headings.iter().any(|h| !h.unit.is_empty()) {
            lines.push(self.headings.iter().map(|h| h.unit.to_owned()).collect());
        }
        for (i, cells) in self.cells().into_iter().enumerate() {
            if self.begins_group(i) {
                lines.push(vec![String::new(); cells.len()]);
            }
            lines.push(cells);
        }
        let width = |column: usize| lines.iter().map(|l| l[column].chars().count()).max();
        let widths: Vec<usize> = (0..self.headings.len()).filter_map(width).collect();
        let mut out = String::new();
        for line in &lines {
            let mut text = String::new();
            for ((cell, heading), &width) in line.iter().zip(&self.headings).zip(&widths) {
                text += &match heading.show {
                    Show::Text => format!("{cell:<width$}  "),
                    _ => format!("{cell:>width$}  "),
                };
            }
            out += text.trim_end();
            out.push('\n');
        }
        out
    }

    /// As HTML in a scrolling box with fixed headings.
    #[must_use]
    pub fn markup(&self) -> Markup {
        let class = |heading: &Heading| match (heading.show == Show::Text, heading.published) {
            (false, true) => "num paper",
            (false, false) => "num",
            (true, true) => "paper",
            (true, false) => "",
        };
        html! {
            div.scroll.tall {
                table {
                    @if !self.caption.is_empty() { caption { (self.caption) } }
                    thead { tr {
                        @for h in &self.headings {
                            th class=(class(h)) scope="col" title=[(!h.about.is_empty()).then_some(h.about)] {
                                (h.name)
                                @if !h.unit.is_empty() { small { (h.unit) } }
                            }
                        }
                    } }
                    tbody {
                        @for (i, row) in self.cells().iter().enumerate() {
                            tr class=(if self.begins_group(i) { "first" } else { "" }) {
                                @for (cell, h) in row.iter().zip(&self.headings) {
                                    td class=(class(h)) { (cell) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    /// As CSV (RFC 4180) in full precision, with the columns' keys as headings.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut csv = csv::Writer::from_writer(Vec::new());
        let keys = self.headings.iter().map(Heading::flat_key);
        let rows = self.rows.iter().map(|row| row.iter().map(Value::exact));
        // Writing to memory cannot fail, and every row has one cell per heading.
        let _ = csv.write_record(keys);
        for row in rows {
            let _ = csv.write_record(row);
        }
        let bytes = csv.into_inner().unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Cells = (&'static str, f64, Option<f64>);

    fn columns() -> Vec<Column<'static, Cells>> {
        vec![
            Column::text("order", "order", |r: &Cells| r.0),
            Column::real("l1_footprint_miss_pct", "L1 miss", "%", 2, |r: &Cells| r.1),
            Column::real(
                "paper.l1_footprint_miss_pct",
                "paper",
                "%",
                2,
                |r: &Cells| r.2,
            )
            .published(),
        ]
    }

    fn table(rows: &[Cells]) -> Table {
        Table::new(&columns(), rows).grouped_by(1)
    }

    const ROWS: [Cells; 2] = [("morton", 16.14, Some(16.14)), ("z2-sta", 9.814, None)];

    #[test]
    fn text_has_units_right_aligned_numbers_and_groups() {
        assert_eq!(
            table(&ROWS).text(),
            "order   L1 miss  paper\n              %      %\nmorton    16.14  16.14\n\nz2-sta     9.81\n"
        );
    }

    #[test]
    fn markup_marks_numbers_and_published_figures() {
        let markup = table(&ROWS).markup().into_string();
        assert!(markup.contains("<td class=\"num\">9.81</td>"));
        assert!(markup.contains("<td class=\"num paper\">16.14</td>"));
        assert!(markup.contains("<small>%</small>"));
    }

    #[test]
    fn csv_is_exact_and_quotes_what_it_must() {
        assert_eq!(
            table(&[("a, \"b\"", 9.814, None)]).csv(),
            "order,l1_footprint_miss_pct,paper_l1_footprint_miss_pct\n\"a, \"\"b\"\"\",9.814,\n"
        );
    }

    #[test]
    fn empty_columns_can_be_left_out() {
        let table = table(&[("a", 1.0, None)]).without_empty_columns();
        assert_eq!(table.cells(), [["a", "1.00"]]);
        assert_eq!(table.headings.len(), 2);
    }

    #[test]
    fn columns_and_rows_can_be_picked() {
        let table =
            table(&ROWS)
                .only("order", "z2-sta")
                .picked(["l1_footprint_miss_pct", "order", "none"]);
        assert_eq!(table.cells(), [["9.81", "z2-sta"]]);
    }

    #[test]
    fn control_characters_in_a_name_do_not_reach_the_terminal() {
        let text = table(&[("\u{1b}[31mred\u{7}", 1.0, None)]).text();
        assert!(text.contains("\\u{1b}[31mred\\u{7}"), "{text}");
        assert!(!text.contains('\u{1b}'));
    }
}
