//! How far headline figures are from the truth, as `replay accuracy` has measured it on the scenes
//! that the table names. What nobody has measured is not in the table.

use super::columns::{Column, Row};
use super::table::Table;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// A part of a figure's error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnownError {
    /// Key of the figure.
    pub figure: String,
    /// Its name.
    pub name: String,
    /// What the error comes from: `timing`, `lod`, `calibration`, `model`.
    pub contribution: String,
    /// Mean absolute error.
    pub mean: f64,
    /// Largest absolute error.
    pub largest: f64,
    /// Unit of both.
    pub unit: String,
    /// Scenes that it was measured on.
    pub scenes: String,
    /// How.
    pub command: String,
}

static ERRORS: LazyLock<Vec<KnownError>> = LazyLock::new(|| parse(include_str!("measured.csv")));

/// Lines that do not parse are left out; a test holds that there are none.
fn parse(text: &str) -> Vec<KnownError> {
    let mut lines = csv::Reader::from_reader(text.as_bytes());
    lines.deserialize().filter_map(Result::ok).collect()
}

/// All that was measured.
#[must_use]
pub fn known() -> &'static [KnownError] {
    &ERRORS
}

impl Row for KnownError {
    #[rustfmt::skip]
    fn columns() -> Vec<Column<'static, Self>> {
        vec![
            Column::text("name", "figure", |e: &Self| e.name.clone()),
            Column::text("contribution", "error from", |e: &Self| e.contribution.clone()),
            Column::real("mean", "mean", "absolute", 2, |e: &Self| e.mean),
            Column::real("largest", "largest", "absolute", 2, |e: &Self| e.largest),
            Column::text("unit", "", |e: &Self| e.unit.clone()),
        ]
    }
}

/// The table for a terminal and for the page.
#[must_use]
pub fn table() -> Table {
    Table::new(&KnownError::columns(), known()).grouped_by(1)
}

/// How and on what the errors were measured; none where nothing was.
#[must_use]
pub fn source() -> Option<String> {
    let first = known().first()?;
    Some(format!("{} on {}", first.command, first.scenes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::ERROR_FIGURES;

    #[test]
    fn every_line_reads_and_names_a_figure_its_source_and_a_unit() {
        let lines = include_str!("measured.csv").lines().count();
        assert_eq!(known().len(), lines - 1);
        for error in known() {
            let figure = ERROR_FIGURES.iter().find(|figure| figure.0 == error.figure);
            let (_, name, unit) = figure.expect("a headline figure");
            assert_eq!((*name, *unit), (error.name.as_str(), error.unit.as_str()));
            assert!(error.command.starts_with("replay "), "{error:?}");
            assert!(!error.scenes.is_empty() && error.mean <= error.largest);
        }
    }
}
