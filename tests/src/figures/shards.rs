//! Tables of docs/use/many-machines.md.

use super::view::{Results, markdown};

/// Time and memory of a sweep on one machine and in shards.
pub fn table(results: &Results) -> String {
    let headings = [
        "step",
        "processor time",
        "peak memory",
        "files in `points/`",
    ];
    let rows = results.rows.iter().map(|row| {
        vec![
            row["step"].clone(),
            format!("{} s", row["processor_seconds"]),
            format!("{} MB", row["peak_mb"]),
            row["files_in_points"].clone(),
        ]
    });
    markdown(&headings, rows)
}
