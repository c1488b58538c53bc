//! Charts as SVG text by plotters: a pure function of the numbers, byte for byte.

pub mod bars;
pub mod boxes;
pub mod contours;
pub mod data_uri;
mod frame;
pub mod hbars;
pub mod heatmap;
pub mod lines;
pub mod paths;
pub mod scatter;
pub mod spans;
pub mod stacked;
#[cfg(test)]
pub(crate) mod testing;

use super::theme;
use plotters::prelude::RGBColor;

/// A chart could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("plot `{title}`: {problem}")]
pub struct PlotError {
    /// The chart's title.
    pub title: String,
    /// What plotters or the data said.
    pub problem: String,
}

/// A named, coloured series.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesStyle {
    /// Name as printed.
    pub name: String,
    /// Colour.
    pub color: RGBColor,
}

impl SeriesStyle {
    /// A series with the `index`-th colour of the theme.
    pub fn nth(name: impl Into<String>, index: usize) -> Self {
        Self {
            name: name.into(),
            color: theme::SERIES[index % theme::SERIES.len()],
        }
    }
}

/// Escapes text for an XML attribute or body.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
