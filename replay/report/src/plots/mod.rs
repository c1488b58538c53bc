//! Charts as SVG text, drawn by plotters. Equal numbers give equal bytes.

pub mod axis;
mod bands;
pub mod bars;
pub mod boxes;
pub mod contours;
pub mod data_uri;
mod frame;
pub mod hbars;
pub mod heatmap;
pub mod lines;
mod marks;
pub mod paths;
pub mod scatter;
pub mod spans;
pub mod stacked;
#[cfg(test)]
pub(crate) mod testing;

use super::theme;
use plotters::prelude::RGBColor;

/// Error for a chart that cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("plot `{title}`: {problem}")]
pub struct PlotError {
    /// The chart's title.
    pub title: String,
    /// Message from plotters or from the check of the data.
    pub problem: String,
}

impl PlotError {
    fn new(title: &str, problem: impl Into<String>) -> Self {
        Self {
            title: title.to_owned(),
            problem: problem.into(),
        }
    }
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
    /// Series with these names and numbers of colours.
    pub fn list(named: &[(&str, usize)]) -> Vec<Self> {
        let series = named.iter();
        series
            .map(|(name, index)| Self::nth(*name, *index))
            .collect()
    }

    /// A series with the `index`-th colour of the theme.
    pub fn nth(name: impl Into<String>, index: usize) -> Self {
        Self {
            name: name.into(),
            color: theme::SERIES[index % theme::SERIES.len()],
        }
    }
}

/// Escapes text for an XML attribute or body.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
