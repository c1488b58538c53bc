//! Table of docs/results/scene-files.md: the files of published packages.

use super::view::{Results, Row, markdown};

const OUTCOMES: [&str; 3] = ["drawn", "refused", "failed"];

/// Counts of outcomes by package, and why files are refused.
pub fn table(results: &Results) -> String {
    let headings = [
        "package",
        "from",
        "files",
        "drawn",
        "refused",
        "failed",
        "refused because of",
    ];
    let mut rows: Vec<Vec<String>> = (results.values("package").iter())
        .map(|package| {
            let of_package = |row: &&Row| row["package"] == *package;
            let files: Vec<&Row> = results.rows.iter().filter(of_package).collect();
            let name = format!("{package} {}", files[0]["version"]);
            line([&name, &files[0]["registry"]], &files)
        })
        .collect();
    rows.push(line(["all", ""], &results.rows.iter().collect::<Vec<_>>()));
    markdown(&headings, rows)
}

fn line(names: [&str; 2], files: &[&Row]) -> Vec<String> {
    let count = |outcome| files.iter().filter(|row| row["outcome"] == outcome).count();
    let mut reasons: Vec<(&str, usize)> = Vec::new();
    for row in files.iter().filter(|row| row["outcome"] == "refused") {
        match reasons
            .iter_mut()
            .find(|(reason, _)| *reason == row["reason"])
        {
            Some((_, count)) => *count += 1,
            None => reasons.push((&row["reason"], 1)),
        }
    }
    reasons.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let reasons = reasons.iter().map(|(reason, count)| match count {
        1 => (*reason).to_owned(),
        _ => format!("{reason} ({count})"),
    });
    let reasons = reasons.collect::<Vec<_>>().join(", ");
    let mut cells = names.map(str::to_owned).to_vec();
    cells.push(files.len().to_string());
    cells.extend(OUTCOMES.map(|outcome| count(outcome).to_string()));
    cells.push(reasons);
    cells
}
