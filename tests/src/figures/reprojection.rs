//! Tables of docs/results/reprojection.md.

use super::view::{Results, markdown, rounded};

/// What reprojection saves and costs, by scene and rule.
pub fn table(results: &Results) -> String {
    let columns = [
        ("reuse_pct", "reuse %", 2),
        ("wrong_object_pct", "wrong object %", 3),
        ("position_over_2px_pct", "off > 2 px %", 3),
        ("flip_mean", "FLIP", 4),
        ("psnr_db", "PSNR dB", 1),
        ("relative_performance", "performance", 2),
        ("tni_relative_performance", "units", 2),
        ("paper_relative_performance", "paper", 2),
        ("relative_energy", "energy", 2),
        ("paper_relative_energy", "paper", 2),
        (
            "whole_screen_relative_performance",
            "screen: performance",
            2,
        ),
        ("whole_screen_relative_energy", "energy", 2),
        ("primary_steps_pct", "primary %", 1),
    ];
    let mut headings = vec!["scene", "rule"];
    headings.extend(columns.map(|(_, heading, _)| heading));
    let rows = results.rows.iter().map(|row| {
        let cell = |(column, _, decimals): (&str, &str, usize)| match row[column].as_str() {
            "" => "-".to_owned(),
            number => rounded(number, decimals),
        };
        let rule = if row["run"] == "plain" {
            "plain"
        } else {
            "default"
        };
        [row["scene"].clone(), rule.to_owned()]
            .into_iter()
            .chain(columns.map(cell))
            .collect()
    });
    markdown(&headings, rows)
}
