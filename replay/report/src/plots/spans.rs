//! Spans of time in rows: when each row works, and on what.

use super::bands::{RowBands, boxes};
use super::frame::text_style;
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::prelude::{Color, Rectangle};
use plotters::style::text_anchor::HPos;
use std::ops::Range;

/// A chart of spans.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SpanChart {
    /// Heading.
    pub title: String,
    /// What the axis shows, with its unit.
    pub value_label: String,
    /// Kinds of spans.
    pub kinds: Vec<SeriesStyle>,
    /// Names of the rows and their spans.
    pub rows: Vec<(String, Vec<Span>)>,
    /// Range of the axis; spans are cut at its ends.
    pub range: Range<f64>,
}

/// A span of a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// Start and end.
    pub range: Range<f64>,
    /// Indices of its kinds; with two, the first one colours the upper half.
    pub kinds: Vec<usize>,
    /// Text drawn inside if it fits.
    pub label: String,
}

const ROW_PX: i32 = 26;
const GAP_PX: i32 = 4;

impl SpanChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// An empty range.
    pub fn svg(&self) -> Result<String, PlotError> {
        let Range { start, end } = self.range;
        if !(start.is_finite() && end.is_finite() && start < end) {
            let problem = format!("from {start} to {end}");
            return Err(PlotError::new(&self.title, problem));
        }
        let axis = RowBands {
            title: &self.title,
            value_label: &self.value_label,
            legend: boxes(&self.kinds),
            names: self.rows.iter().map(|(name, _)| name.clone()).collect(),
            row_px: ROW_PX,
            width_px: 860.0,
            around_px: [66, 22, 26],
            x_label: "",
            values: self.range.clone(),
        };
        axis.draw(|root, axes, _| {
            let label_style = text_style(theme::TICK_PX, theme::PAPER, HPos::Center);
            for (row, (_, spans)) in (0..).zip(&self.rows) {
                let top = ROW_PX * row + GAP_PX / 2;
                let height = ROW_PX - GAP_PX;
                for span in spans {
                    let (left, right) = (span.range.start.max(start), span.range.end.min(end));
                    if left >= right {
                        continue;
                    }
                    let parts = span.kinds.len().max(1) as i32;
                    for (part, kind) in (0..).zip(&span.kinds) {
                        let y = top + height * part / parts;
                        let corners = [(left, y), (right, top + height * (part + 1) / parts)];
                        let color = self.kinds[*kind].color;
                        let area = axes.plotting_area();
                        area.draw(&Rectangle::new(corners, color.filled()))?;
                        area.draw(&Rectangle::new(corners, theme::PAPER.stroke_width(1)))?;
                    }
                    let [(from, _), (to, y)] =
                        [left, right].map(|x| axes.backend_coord(&(x, top + height / 2)));
                    if f64::from(to - from)
                        > theme::text_width_px(&span.label, theme::TICK_PX) + 4.0
                    {
                        root.draw_text(&span.label, &label_style, ((from + to) / 2, y))?;
                    }
                }
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> SpanChart {
        let span = |range: Range<f64>, kinds: &[usize], label: &str| Span {
            range,
            kinds: kinds.to_vec(),
            label: label.to_owned(),
        };
        SpanChart {
            title: "cores".into(),
            value_label: "cycles".into(),
            kinds: vec![SeriesStyle::nth("left", 0), SeriesStyle::nth("right", 1)],
            rows: vec![
                (
                    "core 0".into(),
                    vec![span(0.0..40.0, &[0], "12"), span(41.0..41.1, &[0], "cut")],
                ),
                (
                    "core 1".into(),
                    vec![
                        span(0.0..50.0, &[0, 1], "13"),
                        span(200.0..300.0, &[1], "out"),
                    ],
                ),
            ],
            range: 0.0..100.0,
        }
    }

    #[test]
    fn spans_have_labels_where_these_fit_and_end_with_the_axis() {
        let svg = chart().svg().unwrap();
        assert_eq!(svg, chart().svg().unwrap());
        for text in ["\n12\n", "\n13\n", "\ncore 1\n"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("\ncut\n") && !svg.contains("\nout\n"));
    }

    #[test]
    fn an_empty_axis_is_refused() {
        let empty = SpanChart {
            range: 5.0..5.0,
            ..chart()
        };
        assert_eq!(
            empty.svg().unwrap_err().to_string(),
            "plot `cores`: from 5 to 5"
        );
    }
}
