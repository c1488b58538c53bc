//! Tables of docs/results/applications.md.

use super::view::{Results, markdown};

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
