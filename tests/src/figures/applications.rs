//! Tables of docs/results/applications.md.

use super::view::{Results, Row, markdown};

fn columns(results: &Results, columns: &[&str]) -> String {
    let rows = results.rows.iter();
    let rows = rows.map(|row| columns.iter().map(|name| row[*name].clone()).collect());
    markdown(columns, rows)
}

/// Records compared with occlusion queries.
pub fn records(results: &Results) -> String {
    columns(
        results,
        &[
            "program",
            "eyes by",
            "pixels per eye",
            "fragments",
            "draws equal to their query",
            "draws that differ",
            "draws not compared",
            "pictures",
            "left out",
        ],
    )
}

/// Time per frame.
pub fn times(results: &Results) -> String {
    columns(
        results,
        &[
            "program",
            "plain ms per earlier frame",
            "with the layer, not recorded",
            "plain ms per frame",
            "recorded",
            "not recorded over plain",
            "recorded over plain",
            "plain peak MB",
            "recorded peak MB",
        ],
    )
}

/// Savings by tile order.
pub fn orders(results: &Results) -> String {
    columns(
        results,
        &[
            "program",
            "texture MB, Morton",
            "Z2 LRTA saves %",
            "Z2 STA saves %",
        ],
    )
}

/// Compile times by program.
pub fn compiling(results: &Results) -> String {
    const RATIO: &str = "recorded over plain";
    let number = |row: &Row, column: &str| row[column].parse::<f64>().expect("a number");
    let rows = results.values("program").into_iter().map(|program| {
        let mut all: Vec<&Row> = (results.rows.iter())
            .filter(|row| row["program"] == program)
            .collect();
        all.sort_by(|a, b| number(a, RATIO).total_cmp(&number(b, RATIO)));
        let sum = |column| all.iter().map(|row| number(row, column)).sum::<f64>();
        let (median, worst) = (all[all.len() / 2], all[all.len() - 1]);
        let of_worst = ["plain ms", "recorded ms"].map(|of| format!("{:.0}", number(worst, of)));
        vec![
            program,
            all.len().to_string(),
            format!("{:.2}", sum("recorded ms") / sum("plain ms")),
            median[RATIO].clone(),
            worst[RATIO].clone(),
            worst["texture reads"].clone(),
            of_worst.join(" → "),
        ]
    });
    markdown(
        &[
            "program",
            "shaders",
            "all recorded over all plain",
            "median",
            "worst",
            "texture reads of the worst",
            "its ms, plain → recorded",
        ],
        rows,
    )
}
