//! Distributions as horizontal boxes, one per row: whiskers, quartiles and median.

use super::axis::Axis;
use super::bands::RowBands;
use super::frame::{AXIS_PX, text_style};
use super::lines::exact;
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::prelude::{Color, PathElement};
use plotters::style::text_anchor::HPos;

/// A chart of boxes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BoxChart {
    /// Heading.
    pub title: String,
    /// Definition of whiskers, boxes and marks.
    pub note: String,
    /// The values, with their unit.
    pub x: Axis,
    /// RowBands from the top.
    pub rows: Vec<BoxRow>,
    /// A value to compare with, as a vertical line.
    pub reference: Option<f64>,
    /// Decimals of the medians, which are printed at the right edge.
    pub decimals: usize,
}

/// One distribution.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BoxRow {
    /// Name and colour.
    pub style: SeriesStyle,
    /// Lower whisker, lower quartile, median, upper quartile, upper whisker.
    pub values: [f64; 5],
}

const ROW_PX: i32 = 20;
const BOX_PX: i32 = 10;

impl BoxChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// Values that are not finite or not ascending.
    pub fn svg(&self) -> Result<String, PlotError> {
        for row in &self.rows {
            if !row.values.iter().all(|v| v.is_finite()) || !row.values.is_sorted() {
                let problem = format!("row `{}` holds {:?}", row.style.name, row.values);
                return Err(PlotError::new(&self.title, problem));
            }
        }
        let all = self.rows.iter().flat_map(|row| row.values);
        let values = self.x.fit(all.chain(self.reference));
        let end = values.end;
        let names = self.rows.iter().map(|row| row.style.name.as_str());
        let names: Vec<&str> = names.collect();
        let axis = RowBands {
            title: &self.title,
            value_label: &self.note,
            legend: Vec::new(),
            names: theme::distinct(&names, 48),
            row_px: ROW_PX,
            width_px: 420.0,
            around_px: [50, 52, AXIS_PX],
            x_label: &self.x.label,
            values,
        };
        let height_px = axis.height_px();
        axis.draw(|root, axes, marks| {
            let area = axes.plotting_area();
            if let Some(value) = self.reference {
                let line = [(value, 0), (value, height_px)];
                area.draw(&PathElement::new(line, theme::AXIS.stroke_width(1)))?;
            }
            let number = text_style(theme::TICK_PX, theme::INK, HPos::Left);
            for (row, BoxRow { style, values }) in (0..).zip(&self.rows) {
                let [low, q1, median, q3, high] = *values;
                let y = ROW_PX * row + ROW_PX / 2;
                let whiskers = [(low, y), (high, y)];
                area.draw(&PathElement::new(whiskers, style.color.stroke_width(1)))?;
                let corners = [(q1, y - BOX_PX / 2), (q3, y + BOX_PX / 2)];
                let corners = corners.map(|at| axes.backend_coord(&at));
                let [low, q1, middle, q3, high] = values.map(exact);
                let title = format!("{}: {low}, {q1}, {middle}, {q3}, {high}", style.name);
                marks.rect(corners, style.color, &title);
                let mark = [(median, y - BOX_PX / 2 - 2), (median, y + BOX_PX / 2 + 2)];
                let mark = mark.map(|at| axes.backend_coord(&at));
                marks.line(&mark, theme::INK, (f64::from(theme::LINE_PX), ""));
                let (right, y) = axes.backend_coord(&(end, y));
                let text = format!("{median:.0$}", self.decimals);
                root.draw_text(&text, &number, (right + 6, y))?;
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::text_at;
    use super::*;

    fn chart(values: [f64; 5]) -> BoxChart {
        BoxChart {
            title: "Frame time".into(),
            note: "quartiles".into(),
            x: Axis::linear("over the baseline"),
            rows: vec![
                BoxRow {
                    style: SeriesStyle::nth("conical", 0),
                    values,
                },
                BoxRow {
                    style: SeriesStyle::nth("occlusion", 1),
                    values,
                },
            ],
            reference: Some(1.0),
            decimals: 2,
        }
    }

    #[test]
    fn rows_do_not_overlap_and_medians_are_printed() {
        let svg = chart([0.7, 0.8, 0.875, 0.9, 1.3]).svg().unwrap();
        assert!(text_at(&svg, "occlusion").1 - text_at(&svg, "conical").1 >= 15.0);
        assert!(svg.contains("\n0.88\n") && svg.contains("over the baseline"));
    }

    #[test]
    fn values_out_of_order_are_refused() {
        let error = chart([0.7, 0.6, 0.8, 0.9, 1.0]).svg().unwrap_err();
        assert!(error.to_string().contains("row `conical`"), "{error}");
    }
}
