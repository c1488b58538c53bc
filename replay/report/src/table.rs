//! A table: as text for a terminal, as HTML, and as CSV.

use super::columns::{Column, Heading, Kind, Show, Value};
use formats::text::{csv_cell, printable};
use maud::{Markup, html};
use std::borrow::Cow;

/// Longer texts are wrapped on pages.
const LONGEST_LINE_CHARS: usize = 60;

/// How a text has its tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Aligned columns.
    Terminal,
    /// Tables of GitHub's Markdown.
    Markdown,
}

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
    pub(super) fn grouped_by(mut self, cells: usize) -> Self {
        self.groups = cells;
        self
    }

    /// The columns with these keys, in the order of `keys`. Skips unknown keys.
    pub(super) fn picked<'k>(&self, keys: impl IntoIterator<Item = &'k str>) -> Self {
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
    pub(super) fn without_empty_columns(mut self) -> Self {
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

    /// The columns of files: one with figures is followed by their ends, under its key with `_low` and `_high`.
    pub(super) fn with_ends(&self) -> Cow<'_, Self> {
        let mut table = Cow::Borrowed(self);
        for column in (0..self.headings.len()).rev() {
            if !self.rows.iter().any(|row| row[column].figure().is_some()) {
                continue;
            }
            let table = table.to_mut();
            for (end, name) in ["low", "high"].iter().enumerate().rev() {
                let mut heading = self.headings[column].clone();
                heading.key = format!("{}_{name}", heading.key).into();
                heading.kind = Kind::Real;
                table.headings.insert(column + 1, heading);
                for row in &mut table.rows {
                    let cell = row[column].figure().map(|f| [f.low, f.high][end]);
                    row.insert(column + 1, cell.into());
                }
            }
        }
        table
    }

    /// The cells as text.
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

    /// As text in a style.
    pub fn styled(&self, style: Style) -> String {
        match style {
            Style::Terminal => self.text(),
            Style::Markdown => self.markdown(),
        }
    }

    /// As a table of GitHub's Markdown between empty lines. Units stand behind the headings.
    fn markdown(&self) -> String {
        let line = |cells: Vec<String>| {
            let cells = cells.iter().map(|cell| cell.replace('|', "\\|"));
            format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
        };
        let heading = |h: &Heading| match h.unit {
            "" => printable(&h.name).into_owned(),
            unit => format!("{}, {unit}", printable(&h.name)),
        };
        let side = |h: &Heading| match h.show {
            Show::Text => "---".to_owned(),
            _ => "---:".to_owned(),
        };
        let mut out = "\n".to_owned();
        out += &line(self.headings.iter().map(heading).collect());
        out += &line(self.headings.iter().map(side).collect());
        for cells in self.cells() {
            out += &line(cells);
        }
        out + "\n"
    }

    /// As text for a terminal. Lines are not wrapped, so the output can be piped and compared.
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

    /// Groups of columns: those that share the group of their headings, or the part of their keys before
    /// the dot. A group of one column has no name.
    fn column_groups(&self) -> Vec<(String, std::ops::Range<usize>)> {
        let mut start = 0;
        let group = |run: &[Heading]| {
            let range = start..start + run.len();
            start = range.end;
            let name = if run.len() > 1 {
                run[0].group_name()
            } else {
                String::new()
            };
            (name, range)
        };
        let same = |a: &Heading, b: &Heading| a.group_name() == b.group_name();
        self.headings.chunk_by(same).map(group).collect()
    }

    /// The columns with their units and meanings, as a list.
    pub fn meanings(&self) -> Markup {
        html! {
            dl.note {
                @for h in self.headings.iter().filter(|h| !h.about.is_empty()) {
                    dt { (h.name) @if !h.unit.is_empty() { ", " (h.unit) } } dd { (h.about) }
                }
            }
        }
    }

    /// The same in a collapsible element.
    pub(super) fn folded_meanings(&self) -> Markup {
        html! { details { summary { "definitions of the columns" } (self.meanings()) } }
    }

    /// As HTML in a scrolling box with fixed headings and a fixed first column. The page's script adds
    /// sorting, filtering and a choice of columns.
    pub(super) fn markup(&self) -> Markup {
        let class = |heading: &Heading| match (heading.show == Show::Text, heading.published) {
            (false, true) => "num paper",
            (false, false) => "num",
            (true, true) => "paper",
            (true, false) => "",
        };
        let cells = self.cells();
        // Long texts wrap.
        let wide: Vec<bool> = (0..self.headings.len())
            .map(|column| {
                let longest = cells.iter().map(|row| row[column].chars().count()).max();
                self.headings[column].show == Show::Text && longest > Some(LONGEST_LINE_CHARS)
            })
            .collect();
        let groups = self.column_groups();
        let is_grouped = groups.iter().any(|(name, _)| !name.is_empty());
        let starts = |column: usize| {
            let of = groups.iter().find(|(_, range)| range.start == column);
            is_grouped && column > 0 && of.is_some()
        };
        let class = |column: usize| {
            let wide = if wide[column] { " wide" } else { "" };
            let from = if starts(column) { " from" } else { "" };
            format!("{}{wide}{from}", class(&self.headings[column]))
                .trim()
                .to_owned()
        };
        let class = |column: usize| {
            let class = class(column);
            (!class.is_empty()).then_some(class)
        };
        html! {
            div.table { div.scroll.tall tabindex="0" role="region" aria-label=(if self.caption.is_empty() { "table" } else { self.caption }) {
                table {
                    @if !self.caption.is_empty() { caption { (self.caption) } }
                    thead {
                    @if is_grouped { tr {
                        @for (name, range) in &groups {
                            th.group scope="colgroup" colspan=(range.len()) data-from=(range.start) data-to=(range.end) { (name) }
                        }
                    } }
                    tr {
                        @for (column, h) in self.headings.iter().enumerate() {
                            th class=[class(column)] scope="col" title=[(!h.about.is_empty()).then_some(h.about)] {
                                (h.name)
                                @if !h.unit.is_empty() { small { (h.unit) } }
                            }
                        }
                    } }
                    tbody {
                        @for (i, row) in cells.iter().enumerate() {
                            tr class=[self.begins_group(i).then_some("first")] {
                                @for (column, cell) in row.iter().enumerate() {
                                    @if column == 0 { th scope="row" class=[class(0)] { (cell) } }
                                    @else { td class=[class(column)] { (cell) } }
                                }
                            }
                        }
                    }
                }
            } }
        }
    }

    /// As CSV (RFC 4180) in full precision, with the columns' keys as headings. Names are no formulas.
    pub fn csv(&self) -> String {
        let mut csv = csv::Writer::from_writer(Vec::new());
        let table = self.with_ends();
        let keys = table.headings.iter().map(Heading::flat_key);
        let cell = |value: &Value| csv_cell(&value.exact()).into_owned();
        let rows = table.rows.iter().map(|row| row.iter().map(cell));
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
    fn markdown_has_units_in_headings_and_escapes_bars() {
        assert_eq!(
            table(&[("a|b", 9.814, None)]).styled(Style::Markdown),
            "\n| order | L1 miss, % | paper, % |\n| --- | ---: | ---: |\n| a\\|b | 9.81 |  |\n\n"
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
    fn names_in_csv_are_no_formulas_and_negative_numbers_stay_numbers() {
        assert_eq!(
            table(&[("=HYPERLINK(\"x\")", -9.5, None), ("-1+1", 0.0, Some(-1.0))]).csv(),
            "order,l1_footprint_miss_pct,paper_l1_footprint_miss_pct\n\"'=HYPERLINK(\"\"x\"\")\",-9.5,\n'-1+1,0,-1\n"
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
