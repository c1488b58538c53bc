//! Figures within sentences, from results files.

use super::Results;
use std::path::Path;

const BEGIN: &str = "<!-- = ";

/// The document with every marked figure computed again from the results in `folder`, and the number of
/// marks.
///
/// A mark follows its figure: `47<!-- = max; ray-orders; STA saves %; rays=primary -->`. Its parts are `min`,
/// `max` or `one` (exactly one row), the results file, the column, and filters `COLUMN=VALUE|VALUE`.
/// `COLUMN@1` is the second number of each cell. The figure keeps its number of decimals, and has a sign
/// only if it is typed with a minus.
///
/// # Errors
/// A mark without its end, an unknown part, or no number.
pub fn with_inline_figures(document: &str, folder: &Path) -> Result<(String, usize), String> {
    let (mut text, mut marks, mut rest) = (String::new(), 0, document);
    while let Some((before, after)) = rest.split_once(BEGIN) {
        let (formula, after) = after
            .split_once(" -->")
            .ok_or("a figure's mark without its end")?;
        let sentence =
            before.trim_end_matches(|c: char| c.is_ascii_digit() || matches!(c, '.' | '-'));
        let typed = &before[sentence.len()..];
        let decimals = typed.split_once('.').map_or(0, |(_, after)| after.len());
        let figure = compute(formula, folder).map_err(|error| format!("{formula}: {error}"))?;
        let figure = if typed.starts_with('-') {
            figure
        } else {
            figure.abs()
        };
        text += &format!("{sentence}{figure:.decimals$}{BEGIN}{formula} -->");
        (marks, rest) = (marks + 1, after);
    }
    Ok((text + rest, marks))
}

fn compute(formula: &str, folder: &Path) -> Result<f64, String> {
    let parts: Vec<&str> = formula.split("; ").collect();
    let [function, file, column, filters @ ..] = &parts[..] else {
        return Err("expected FUNCTION; FILE; COLUMN; FILTERS".to_owned());
    };
    let results = Results::read(&folder.join(file).with_extension("csv"))?;
    let (column, at) = match column.rsplit_once('@') {
        Some((column, at)) => (column, at.parse().map_err(|_| "expected a number after @")?),
        None => (*column, 0),
    };
    let mut rows: Vec<_> = results.rows.iter().collect();
    for filter in filters {
        let (key, values) = filter.rsplit_once('=').ok_or("expected COLUMN=VALUE")?;
        if !results.columns.iter().any(|known| known == key) {
            return Err(format!("no column '{key}'"));
        }
        rows.retain(|row| values.split('|').any(|value| row[key] == value));
    }
    let cells = rows.iter().map(|row| {
        let cell = row.get(column).ok_or(format!("no column '{column}'"))?;
        number(cell, at).ok_or(format!("no number in '{cell}'"))
    });
    let numbers = cells.collect::<Result<Vec<f64>, String>>()?;
    match (*function, &numbers[..]) {
        (_, []) => Err("no row".to_owned()),
        ("min", all) => Ok(all.iter().copied().fold(f64::INFINITY, f64::min)),
        ("max", all) => Ok(all.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        ("one", [one]) => Ok(*one),
        ("one", all) => Err(format!("expected one row, found {}", all.len())),
        _ => Err("expected min, max or one".to_owned()),
    }
}

/// The number at this place among a cell's words, as in `-10.0 [-31.3 to 16.4]`.
fn number(cell: &str, at: usize) -> Option<f64> {
    let words = cell.split([' ', '[', ']']);
    words.filter_map(|word| word.parse().ok()).nth(at)
}
