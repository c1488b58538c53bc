//! Known errors of headline figures, measured by `replay accuracy` on the scenes that the table names.
//! Errors that were not measured are not in the table.

use super::columns::{Column, Columns, columns_of};
use super::html::Section;
use super::lists::unique;
use super::table::{Style, Table};
use maud::html;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use studies::accuracy::{Contribution, REUSE};

/// A contribution to a figure's error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct KnownError {
    /// Key of the figure.
    pub figure: String,
    /// Its name.
    pub name: String,
    /// Source of the error: `capture`, `lod`, `timing`, `calibration`, `model`.
    pub contribution: String,
    /// Mean absolute error.
    pub mean: f64,
    /// Largest absolute error.
    pub largest: f64,
    /// Unit of both.
    pub unit: String,
    /// Scenes of the measurement.
    pub scenes: String,
    /// Command of the measurement.
    pub command: String,
}

static ERRORS: LazyLock<Vec<KnownError>> = LazyLock::new(|| parse(include_str!("measured.csv")));

/// Skips lines that do not parse; a test checks that there are none.
fn parse(text: &str) -> Vec<KnownError> {
    let mut lines = csv::Reader::from_reader(text.as_bytes());
    lines.deserialize().filter_map(Result::ok).collect()
}

/// Kind of trace that the figures are computed from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// A texture trace.
    Textures,
    /// A ray trace.
    Rays,
}

/// The largest errors of a figure, one for each source, together.
pub(super) fn sum_of_largest(figure: &str) -> f64 {
    let errors = ERRORS.iter().filter(|error| error.figure == figure);
    errors.map(|error| error.largest).sum()
}

/// The measured errors of these figures.
pub fn known(of: Of) -> Vec<&'static KnownError> {
    let rays = |error: &&KnownError| error.figure == REUSE.key;
    let wanted = ERRORS
        .iter()
        .filter(|error| rays(error) == (of == Of::Rays));
    wanted.collect()
}

/// A figure and its measured errors.
struct MeasuredFigure {
    first: &'static KnownError,
    /// By [`Contribution::ALL`].
    errors: [Option<&'static KnownError>; 5],
}

/// The figures with measured errors, in the table's order.
fn by_figure(of: Of) -> Vec<MeasuredFigure> {
    let mut figures: Vec<MeasuredFigure> = Vec::new();
    for error in known(of) {
        if !figures.iter().any(|f| f.first.figure == error.figure) {
            figures.push(MeasuredFigure {
                first: error,
                errors: [None; 5],
            });
        }
        let mut contributions = Contribution::ALL.iter();
        let at = contributions.position(|c| c.name() == error.contribution);
        let figure = figures.iter_mut().find(|f| f.first.figure == error.figure);
        if let Some((figure, at)) = figure.zip(at) {
            figure.errors[at] = Some(error);
        }
    }
    figures
}

/// The table: one row per figure, with the maximum error of each source.
pub fn table(of: Of) -> Table {
    let mut columns = columns_of::<MeasuredFigure>()
        .text("name", "largest error of", |f| f.first.name.clone())
        .text("unit", "", |f| f.first.unit.clone());
    for (index, contribution) in Contribution::ALL.into_iter().enumerate() {
        let (key, name) = (contribution.name(), contribution.title());
        let largest = move |f: &MeasuredFigure| Some(f.errors[index]?.largest);
        columns.push(Column::real(key, name, "", 3, largest));
    }
    Table::new(&columns, &by_figure(of)).without_empty_columns()
}

/// The table with its heading, for a terminal; empty if nothing was measured.
pub fn text(of: Of, style: Style) -> String {
    source(of).map_or_else(String::new, |source| {
        format!(
            "\nError of the figures ({source})\n{}",
            table(of).styled(style)
        )
    })
}

/// The table as a section of a page; `None` if nothing was measured.
pub fn section(of: Of) -> Option<Section> {
    let source = source(of)?;
    Some(Section::new(
        "Error of the figures",
        html! {
            p { "The largest error of each figure by its source, measured by " (source) ". Other scenes may have other errors. Empty cells were not measured." }
            (table(of).markup())
        },
    ))
}

/// The commands and scenes of the measurements; `None` if nothing was measured.
fn source(of: Of) -> Option<String> {
    let known = known(of);
    let command = &known.first()?.command;
    let scenes = unique(known.iter().flat_map(|e| e.scenes.split(", ")));
    Some(format!("{command} on {}", scenes.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::Value;
    use studies::accuracy::headline_figures;

    #[test]
    fn every_line_is_valid_and_has_a_figure_a_source_and_a_unit() {
        let lines = include_str!("measured.csv").lines().count();
        assert_eq!(ERRORS.len(), lines - 1);
        for error in ERRORS.iter() {
            let figure = headline_figures().find(|figure| figure.key == error.figure);
            let figure = figure.expect("a headline figure");
            let found = (error.name.as_str(), error.unit.as_str());
            assert_eq!((figure.name, figure.unit), found);
            let mut contributions = Contribution::ALL.iter().map(|c| c.name());
            assert!(contributions.any(|name| name == error.contribution));
            assert!(error.command.starts_with("replay "), "{error:?}");
            assert!(!error.scenes.is_empty() && error.mean <= error.largest);
        }
    }

    #[test]
    fn every_headline_figure_has_its_own_error_and_the_table_lists_all_of_them() {
        let tables = [Of::Textures, Of::Rays].map(table);
        let rows = || tables.iter().flat_map(|table| &table.rows);
        assert_eq!(rows().count(), headline_figures().count());
        let cells = rows().flat_map(|row| &row[2..]);
        let filled = cells.filter(|cell| **cell != Value::None);
        assert_eq!(filled.count(), ERRORS.len());
    }
}
