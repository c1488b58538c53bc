//! The experiment's tables, for the terminal and the page.

use super::model::{Average, PaperReport};
use crate::columns::{Column, Row, pick};
use crate::errors::{self, Of};
use crate::table::{Style, Table};
use sim::result::Part;
use std::fmt::Write as _;
use studies::experiment::ResultRow;

/// Table 2 of the paper with measured figures, and the paper's figures on the right for scenes that stand
/// for one of its own.
pub fn table_2(report: &PaperReport) -> Table {
    let columns = pick::<ResultRow>(&[
        "label",
        "caches",
        "order",
        "l1_footprint_miss_pct",
        "l2_line_miss_pct",
        "tmu_util_pct",
        "tmu_ratio",
        "external_mb_per_frame",
        "reduction_pct",
        "bound_mb_per_frame",
        "paper.l1_footprint_miss_pct",
        "paper.l2_line_miss_pct",
        "paper.tmu_util_pct",
        "paper.tmu_ratio",
        "paper.reduction_pct",
    ]);
    let table = Table::new(&columns, &report.rows).grouped_by(2);
    table.without_empty_columns()
}

/// Results of the `--preset z2-paper` machine next to those of Table 2; `None` if it was not replayed.
pub fn as_the_paper_counts(report: &PaperReport) -> Option<Table> {
    let columns = pick::<ResultRow>(&[
        "label",
        "caches",
        "order",
        "z2_paper.l1_footprint_miss_pct",
        "z2_paper.l2_line_miss_pct",
        "z2_paper.tmu_util_pct",
        "z2_paper.product_reduction_pct",
        "paper.l1_footprint_miss_pct",
        "paper.l2_line_miss_pct",
        "paper.tmu_util_pct",
        "paper.reduction_pct",
        "z2_paper.closed_form_deviation_points",
        "z2_paper.primary_l1_footprint_miss_pct",
        "z2_paper.primary_l2_line_miss_pct",
        "z2_paper.external_mb_per_frame",
        "z2_paper.reduction_pct",
    ]);
    let rows = report.rows.iter().filter(|row| row.z2_paper.is_some());
    let table = Table::new(&columns, rows).grouped_by(2);
    (!table.rows.is_empty()).then(|| table.without_empty_columns())
}

/// Means by scene and over all scenes.
pub fn averages(averages: &[Average]) -> Table {
    let table = Table::new(&Average::columns(), averages).grouped_by(1);
    table.without_empty_columns()
}

/// Functional mode against timed mode; `None` if functional mode was not replayed.
pub fn modes(report: &PaperReport) -> Option<Table> {
    let columns = pick::<ResultRow>(&[
        "label",
        "caches",
        "order",
        "l1_footprint_miss_pct",
        "functional.l1_footprint_miss_pct",
        "l2_line_miss_pct",
        "functional.l2_line_miss_pct",
        "external_mb_per_frame",
        "functional.external_mb_per_frame",
        "functional.external_difference_pct",
    ]);
    let rows = report.rows.iter().filter(|r| r.functional.is_some());
    let table = Table::new(&columns, rows).grouped_by(1);
    (!table.rows.is_empty()).then_some(table)
}

/// External traffic and that of an infinite cache.
pub fn bounds(report: &PaperReport) -> Table {
    let columns = pick::<ResultRow>(&[
        "label",
        "caches",
        "order",
        "external_mb_per_frame",
        "bound_mb_per_frame",
        "over_bound",
    ]);
    Table::new(&columns, &report.rows).grouped_by(2)
}

/// The parts of a scene with the most external traffic. Each part has one column per order of `details`.
pub fn parts<'a>(
    details: &'a [&ResultRow],
    what: &'static str,
    parts_of: fn(&ResultRow<'a>) -> &'a [Part],
    most: usize,
) -> Table {
    let Some(first) = details.first().map(|d| parts_of(d)) else {
        return Table::default();
    };
    let at = |column: Column<'static, Part>, parts: &'a [Part], name: String| {
        let h = &column.heading;
        Column::new(h.key.clone(), name, h.unit, h.show, move |&i: &usize| {
            parts.get(i).map(|part| column.value(part))
        })
    };
    let shared = pick::<Part>(&["name", "footprints"]).into_iter();
    let mut columns: Vec<Column<usize>> = shared
        .zip([what, "footprints"])
        .map(|(column, name)| at(column, first, name.to_owned()))
        .collect();
    for detail in details {
        for column in pick::<Part>(&[
            "l1_footprint_miss_pct",
            "l2_line_miss_pct",
            "external_lines",
        ]) {
            let order = detail.point.config.order.title();
            let name = column.heading.name.to_string();
            columns.push(at(column, parts_of(detail), name).group(order));
        }
    }
    Table::new(&columns, &busiest(first, most))
}

/// Indices of the `most` parts with the most external traffic, or all parts in their own order if there are
/// no more.
pub(crate) fn busiest(parts: &[Part], most: usize) -> Vec<usize> {
    let mut index: Vec<usize> = (0..parts.len()).collect();
    if parts.len() > most {
        index.sort_by_key(|&i| (std::cmp::Reverse(parts[i].l2.line_misses), i));
        index.truncate(most);
    }
    index
}

/// Columns of Table 2 that fit a terminal.
const TERMINAL: [&str; 8] = [
    "label",
    "caches",
    "order",
    "external_mb_per_frame",
    "bound_mb_per_frame",
    "reduction_pct",
    "tmu_ratio",
    "paper.reduction_pct",
];

/// The main columns of Table 2, and the comparison of modes if it was asked for.
pub(super) fn text(report: &PaperReport, style: Style) -> String {
    let table = table_2(report).picked(TERMINAL).grouped_by(2);
    let modes = modes(report).map(|table| format!("\n{}", table.styled(style)));
    table.styled(style) + &modes.unwrap_or_default()
}

/// All columns of Table 2, means, counts as in the paper, and known errors.
pub(super) fn details(report: &PaperReport, style: Style) -> String {
    let mut text = table_2(report).styled(style);
    let _ = write!(text, "\n{}", averages(&report.averages).styled(style));
    if let Some(table) = as_the_paper_counts(report) {
        let _ = write!(
            text,
            "\nCounted as in the paper (--preset z2-paper): first look-ups, with merged requests; memory traffic is in the columns on the right\n{}",
            table.styled(style)
        );
    }
    let fit = &report.closed_form;
    if fit.rows > 0 {
        let _ = write!(
            text,
            "\nTMU utilisation against the paper's surface, at first look-ups: mean absolute deviation {:.2} points, maximum {:.2}, over {} rows\n",
            fit.mean_absolute_points, fit.largest_points, fit.rows
        );
    }
    text += &errors::text(Of::Textures, style);
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

#[cfg(test)]
mod tests {
    use super::super::testing::with_report;
    use super::*;
    use crate::document::Document;

    #[test]
    fn table_2_of_fixed_inputs_matches_the_papers_layout() {
        with_report(|report| {
            let text = table_2(report).text();
            let lines: Vec<&str> = text.lines().collect();
            let cells: Vec<&str> = lines[4].split_whitespace().collect();
            assert_eq!(
                cells.join(" "),
                "crytek-sponza 8/128 Z2 STA 15.81 48.41 68.56 1.037 24.49 22.6 6.40 \
                 15.81 48.41 68.56 1.037 22.6"
            );
            // Two heading lines, 24 rows, 7 rules between 8 groups.
            assert_eq!(lines.len(), 2 + 24 + 7);
        });
    }

    #[test]
    fn csv_and_table_agree() {
        with_report(|report| {
            let (table, text) = (table_2(report), report.csv());
            let mut csv = csv::Reader::from_reader(text.as_bytes());
            let names = csv.headers().unwrap().clone();
            let column = |name: &str| names.iter().position(|n| n == name).unwrap();
            let lines: Vec<_> = csv.records().map(Result::unwrap).collect();
            assert_eq!(lines.len(), table.rows.len());
            for (cells, line) in table.cells().iter().zip(&lines) {
                for (cell, heading) in cells.iter().zip(&table.headings).skip(3) {
                    let value = &line[column(&heading.key.replace('.', "_"))];
                    let value = value
                        .parse()
                        .map_or_else(|_| value.into(), |x: f64| x.into());
                    assert_eq!(*cell, heading.show.write(&value), "{}", heading.key);
                }
            }
        });
    }

    #[test]
    fn parts_are_sorted_by_traffic_unless_they_are_few() {
        with_report(|report| {
            let result = report.rows[0].result;
            assert_eq!(busiest(&result.by_texture, 20).len(), 20);
            assert_eq!(busiest(&result.by_texture, 20)[0], 0);
            assert_eq!(busiest(&result.by_level, 20), [0, 1, 2, 3, 4]);
        });
    }
}
