//! The experiment's tables: the same cells for the terminal and the page.

use super::model::{Average, Detail, PaperReport, Row};
use crate::report::csv::Csv;
use crate::report::html::table::{Column, Table};
use crate::result::Part;

/// `8/128`, both in KiB.
#[must_use]
pub fn caches_title((l1_kib, l2_kib): (f64, f64)) -> String {
    format!("{l1_kib}/{l2_kib}")
}

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(String::new, |v| {
        format!("{:.decimals$}", if v == 0.0 { 0.0 } else { v })
    })
}

/// Table 2 of the paper with our figures, and the paper's to the right where a scene has a twin.
#[must_use]
pub fn table_2(report: &PaperReport) -> Table {
    let mut table = Table::new(vec![
        Column::text("scene"),
        Column::number("L1/L2", "KiB"),
        Column::text("order"),
        Column::number("L1 miss", "%"),
        Column::number("L2 miss", "%"),
        Column::number("TMU", "%"),
        Column::number("TMU", "\u{d7} Morton"),
        Column::number("external", "MB/frame"),
        Column::number("saved", "%"),
        Column::number("bound", "MB/frame"),
        Column::number("TMU \u{2212} fit", "points"),
        Column::published("paper L1", "%"),
        Column::published("paper L2", "%"),
        Column::published("paper TMU", "%"),
        Column::published("paper TMU", "\u{d7} Morton"),
        Column::published("paper saved", "%"),
    ]);
    let mut group = None;
    for row in &report.rows {
        let this = (&row.scene, row.l1_kib, row.l2_kib);
        if group != Some(this) {
            table.begin_group();
            group = Some(this);
        }
        let paper = row.paper.as_ref();
        table.push(vec![
            row.scene.clone(),
            caches_title((row.l1_kib, row.l2_kib)),
            row.order.title().to_owned(),
            number(Some(row.figures.l1_miss_pct), 2),
            number(Some(row.figures.l2_miss_pct), 2),
            number(row.figures.tmu_util_pct, 2),
            number(row.figures.tmu_ratio, 3),
            number(Some(row.external_mb_per_frame), 2),
            number(row.figures.reduction_pct, 1),
            number(Some(row.bound_mb_per_frame), 2),
            number(row.closed_form_deviation_points, 2),
            number(paper.map(|p| p.l1_miss_pct), 2),
            number(paper.map(|p| p.l2_miss_pct), 2),
            number(paper.and_then(|p| p.tmu_util_pct), 2),
            number(paper.and_then(|p| p.tmu_ratio), 3),
            number(paper.and_then(|p| p.reduction_pct), 1),
        ]);
    }
    table
}

/// Means by scene and over all scenes.
#[must_use]
pub fn averages(averages: &[Average]) -> Table {
    let mut table = Table::new(vec![
        Column::text("mean over cache sizes"),
        Column::text("order"),
        Column::number("saved", "%"),
        Column::number("TMU", "\u{d7} Morton"),
        Column::published("paper saved", "%"),
        Column::published("paper TMU", "\u{d7} Morton"),
    ]);
    let mut scene = None;
    for average in averages {
        if scene != Some(&average.scene) {
            table.begin_group();
            scene = Some(&average.scene);
        }
        table.push(vec![
            average.scene.clone(),
            average.order.title().to_owned(),
            number(Some(average.reduction_pct), 1),
            number(average.tmu_ratio, 3),
            number(average.paper_reduction_pct, 1),
            number(average.paper_tmu_ratio, 3),
        ]);
    }
    table
}

/// Functional mode against timed mode; empty where functional mode was not run.
#[must_use]
pub fn modes(rows: &[Row]) -> Table {
    let mut table = Table::new(vec![
        Column::text("scene"),
        Column::number("L1/L2", "KiB"),
        Column::text("order"),
        Column::number("L1 miss timed", "%"),
        Column::number("functional", "%"),
        Column::number("L2 miss timed", "%"),
        Column::number("functional", "%"),
        Column::number("external timed", "MB/frame"),
        Column::number("functional", "MB/frame"),
        Column::number("difference", "%"),
    ]);
    let mut group = None;
    for row in rows {
        let Some(functional) = row.functional else {
            continue;
        };
        if group != Some(&row.scene) {
            table.begin_group();
            group = Some(&row.scene);
        }
        table.push(vec![
            row.scene.clone(),
            caches_title((row.l1_kib, row.l2_kib)),
            row.order.title().to_owned(),
            number(Some(row.figures.l1_miss_pct), 2),
            number(Some(functional.l1_miss_pct), 2),
            number(Some(row.figures.l2_miss_pct), 2),
            number(Some(functional.l2_miss_pct), 2),
            number(Some(row.external_mb_per_frame), 2),
            number(Some(functional.external_mb_per_frame), 2),
            number(Some(functional.external_difference_pct), 2),
        ]);
    }
    table
}

/// External traffic over the infinite cache's, for each order side by side.
#[must_use]
pub fn bounds(report: &PaperReport) -> Table {
    let orders = report.orders();
    let mut columns = vec![
        Column::text("scene"),
        Column::number("L1/L2", "KiB"),
        Column::number("bound", "MB/frame"),
    ];
    columns.extend(
        orders
            .iter()
            .map(|o| Column::number(o.title(), "\u{d7} bound")),
    );
    let mut table = Table::new(columns);
    for info in &report.traces {
        table.begin_group();
        for caches in report.caches_kib() {
            let rows: Vec<Option<&Row>> = orders
                .iter()
                .map(|o| report.row(&info.label, caches, *o))
                .collect();
            let Some(bound) = rows.iter().flatten().next().map(|r| r.bound_mb_per_frame) else {
                continue;
            };
            let mut cells = vec![
                info.label.clone(),
                caches_title(caches),
                number(Some(bound), 2),
            ];
            let over = |r: &Row| (bound > 0.0).then(|| r.external_mb_per_frame / bound);
            cells.extend(rows.iter().map(|r| number(r.and_then(over), 2)));
            table.push(cells);
        }
    }
    table
}

/// The parts of a scene's traffic, the same parts under each of `details`' orders side by side.
#[must_use]
pub fn parts(
    details: &[&Detail],
    what: &str,
    pick: impl Fn(&Detail) -> &[Part],
    most: usize,
) -> Table {
    let mut columns = vec![Column::text(what), Column::number("footprints", "millions")];
    for detail in details {
        let order = detail.order.title();
        columns.push(Column::number(format!("L1 miss {order}"), "%"));
        columns.push(Column::number(format!("L2 miss {order}"), "%"));
        columns.push(Column::number(format!("external {order}"), "1000 lines"));
    }
    let mut table = Table::new(columns);
    let Some(first) = details.first() else {
        return table;
    };
    for index in busiest(pick(first), most) {
        let Some(part) = pick(first).get(index) else {
            continue;
        };
        let mut cells = vec![
            part.name.clone(),
            number(Some(part.l1.footprints as f64 / 1e6), 3),
        ];
        for detail in details {
            let part = pick(detail).get(index);
            cells.push(number(part.and_then(l1_miss_pct), 2));
            cells.push(number(part.and_then(l2_miss_pct), 2));
            cells.push(number(part.map(|p| p.l2.line_misses as f64 / 1e3), 1));
        }
        table.push(cells);
    }
    table
}

/// Indices of the parts with the most external traffic, or all of them in their own order when
/// they are not more than `most`.
#[must_use]
pub fn busiest(parts: &[Part], most: usize) -> Vec<usize> {
    let mut index: Vec<usize> = (0..parts.len()).collect();
    if parts.len() > most {
        index.sort_by_key(|&i| (std::cmp::Reverse(parts[i].l2.line_misses), i));
        index.truncate(most);
    }
    index
}

/// Footprints with any missing line over footprints, percent.
#[must_use]
pub fn l1_miss_pct(part: &Part) -> Option<f64> {
    (part.l1.footprints > 0)
        .then(|| 100.0 * part.l1.footprint_misses as f64 / part.l1.footprints as f64)
}

/// Line misses over line look-ups, percent.
#[must_use]
pub fn l2_miss_pct(part: &Part) -> Option<f64> {
    (part.l2.line_lookups > 0)
        .then(|| 100.0 * part.l2.line_misses as f64 / part.l2.line_lookups as f64)
}

/// Every row in full precision.
#[must_use]
pub fn csv(report: &PaperReport) -> String {
    let mut csv = Csv::new(&[
        "scene",
        "trace",
        "twin",
        "l1_kib",
        "l2_kib",
        "order",
        "l1_miss_pct",
        "l2_miss_pct",
        "tmu_util_pct",
        "tmu_ratio",
        "external_bytes",
        "external_mb_per_frame",
        "reduction_pct",
        "bound_mb_per_frame",
        "closed_form_util_pct",
        "closed_form_deviation_points",
        "cycles",
        "functional_l1_miss_pct",
        "functional_l2_miss_pct",
        "functional_external_mb_per_frame",
        "paper_l1_miss_pct",
        "paper_l2_miss_pct",
        "paper_tmu_util_pct",
        "paper_tmu_ratio",
        "paper_reduction_pct",
    ]);
    for row in &report.rows {
        let info = report.traces.iter().find(|t| t.label == row.scene);
        let paper = row.paper.as_ref();
        let functional = row.functional.as_ref();
        let _ended = csv
            .row()
            .text(&row.scene)
            .text(info.map_or("", |i| &i.trace.checksum))
            .text(info.and_then(|i| i.twin.as_deref()).unwrap_or(""))
            .value(row.l1_kib)
            .value(row.l2_kib)
            .text(row.order.name())
            .value(row.figures.l1_miss_pct)
            .value(row.figures.l2_miss_pct)
            .maybe(row.figures.tmu_util_pct)
            .maybe(row.figures.tmu_ratio)
            .value(row.external_bytes)
            .value(row.external_mb_per_frame)
            .maybe(row.figures.reduction_pct)
            .value(row.bound_mb_per_frame)
            .value(row.closed_form_util_pct)
            .maybe(row.closed_form_deviation_points)
            .maybe(row.cycles)
            .maybe(functional.map(|f| f.l1_miss_pct))
            .maybe(functional.map(|f| f.l2_miss_pct))
            .maybe(functional.map(|f| f.external_mb_per_frame))
            .maybe(paper.map(|p| p.l1_miss_pct))
            .maybe(paper.map(|p| p.l2_miss_pct))
            .maybe(paper.and_then(|p| p.tmu_util_pct))
            .maybe(paper.and_then(|p| p.tmu_ratio))
            .maybe(paper.and_then(|p| p.reduction_pct));
    }
    csv.finish()
}

#[cfg(test)]
mod tests {
    use super::super::testing::report;
    use super::*;

    #[test]
    fn table_2_of_fixed_inputs_reads_as_the_paper_has_it() {
        let text = table_2(&report()).text();
        let lines: Vec<&str> = text.lines().collect();
        let cells: Vec<&str> = lines[4].split_whitespace().collect();
        assert_eq!(
            cells,
            [
                "crytek-sponza",
                "8/128",
                "Z2",
                "STA",
                "15.81",
                "48.41",
                "68.56",
                "1.037",
                "24.49",
                "22.6",
                "6.40",
                "0.16",
                "15.81",
                "48.41",
                "68.56",
                "1.037",
                "22.6"
            ]
        );
        // Two heading lines, 24 rows, 7 rules between 8 groups.
        assert_eq!(lines.len(), 2 + 24 + 7);
    }

    #[test]
    fn csv_and_table_agree() {
        let report = report();
        let (table, csv) = (table_2(&report), csv(&report));
        let mut lines = csv.lines();
        let names: Vec<&str> = lines.next().unwrap().split(',').collect();
        let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
        for (cells, line) in table.rows.iter().zip(lines) {
            let values: Vec<&str> = line.split(',').collect();
            for (cell, name, decimals) in [
                (3, "l1_miss_pct", 2),
                (4, "l2_miss_pct", 2),
                (5, "tmu_util_pct", 2),
                (7, "external_mb_per_frame", 2),
                (15, "paper_reduction_pct", 1),
            ] {
                let value: f64 = values[column(name)].parse().unwrap();
                assert_eq!(cells[cell], number(Some(value), decimals), "{name}: {line}");
            }
        }
        assert_eq!(csv.lines().count(), 1 + table.rows.len());
    }

    #[test]
    fn the_busiest_parts_come_first_and_few_parts_keep_their_order() {
        let report = report();
        let parts = &report.details[0].by_texture;
        assert_eq!(busiest(parts, 20).len(), 20);
        assert_eq!(busiest(parts, 20)[0], 0);
        assert_eq!(busiest(&report.details[0].by_level, 20), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn a_negative_zero_prints_as_zero() {
        assert_eq!(number(Some(-0.0), 1), "0.0");
    }
}
