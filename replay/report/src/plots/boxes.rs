//! Distributions as horizontal boxes, one per row: whiskers, quartiles and median.

use super::axis::Axis;
use super::frame::{AXIS_PX, Frame, text_style, themed, tick_format};
use super::lines::exact;
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::prelude::{BindKeyPoints, Color, PathElement};
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
    /// Rows from the top.
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

const TOP_PX: u32 = 50;
const ROW_PX: i32 = 20;
const BOX_PX: i32 = 10;
const PLOT_WIDTH_PX: f64 = 420.0;
const LONGEST_NAME_CHARS: usize = 48;

impl BoxChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// Values that are not finite or not ascending.
    pub fn svg(&self) -> Result<String, PlotError> {
        for row in &self.rows {
            if !row.values.iter().all(|v| v.is_finite()) || !row.values.is_sorted() {
                return Err(PlotError {
                    title: self.title.clone(),
                    problem: format!("row `{}` holds {:?}", row.style.name, row.values),
                });
            }
        }
        let all = self.rows.iter().flat_map(|row| row.values);
        let x = self.x.fit(all.chain(self.reference));
        let names: Vec<&str> = self
            .rows
            .iter()
            .map(|row| row.style.name.as_str())
            .collect();
        let names = theme::distinct(&names, LONGEST_NAME_CHARS);
        let name_px = names
            .iter()
            .map(|name| theme::text_width_px(name, theme::TICK_PX));
        let height_px = ROW_PX * self.rows.len().max(1) as i32;
        let frame = Frame {
            title: &self.title,
            value_label: &self.note,
            legend: Vec::new(),
            plot_px: (PLOT_WIDTH_PX, f64::from(height_px)),
            around_px: [
                TOP_PX,
                52,
                AXIS_PX,
                name_px.fold(40.0, f64::max) as u32 + 16,
            ],
        };
        frame.draw(|root, mut builder, marks| {
            let middles: Vec<i32> = (0..self.rows.len() as i32)
                .map(|row| ROW_PX * row + ROW_PX / 2)
                .collect();
            let rows = (height_px..0).with_key_points(middles);
            let mut chart = builder.build_cartesian_2d(x.clone(), rows)?;
            let name = |y: &i32| {
                names
                    .get((y / ROW_PX) as usize)
                    .cloned()
                    .unwrap_or_default()
            };
            themed(&mut chart.configure_mesh())
                .disable_y_mesh()
                .x_desc(&self.x.label)
                .y_label_style(text_style(theme::TICK_PX, theme::INK, HPos::Right))
                .x_label_formatter(&tick_format(&x))
                .y_label_formatter(&name)
                .draw()?;
            let area = chart.plotting_area();
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
                let corners = corners.map(|at| chart.backend_coord(&at));
                let [low, q1, middle, q3, high] = values.map(exact);
                let title = format!("{}: {low}, {q1}, {middle}, {q3}, {high}", style.name);
                marks.rect(corners, style.color, &title);
                let mark = [(median, y - BOX_PX / 2 - 2), (median, y + BOX_PX / 2 + 2)];
                let mark = mark.map(|at| chart.backend_coord(&at));
                marks.line(&mark, theme::INK, (f64::from(theme::LINE_PX), ""));
                let (right, y) = chart.backend_coord(&(x.end, y));
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
