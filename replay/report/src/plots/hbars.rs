//! Horizontal grouped bars, for long names.

use super::bands::{RowBands, boxes, check_bars, end_above};
use super::frame::text_style;
use super::lines::exact;
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::style::text_anchor::HPos;

/// A chart of horizontal bars, one group per row.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct HBarChart {
    /// Heading.
    pub title: String,
    /// What the bars show, with its unit.
    pub value_label: String,
    /// Series in drawing order.
    pub series: Vec<SeriesStyle>,
    /// Row names and values, one value per series.
    pub rows: Vec<(String, Vec<Option<f64>>)>,
    /// Decimals of the values written at the bars' ends; `None` writes none.
    pub decimals: Option<usize>,
}

const BAR_PX: i32 = 6;
/// Height of a bar with a number: a line of text.
const NUMBERED_BAR_PX: i32 = 12;
const ROW_GAP_PX: i32 = 7;

impl HBarChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A value that is not finite or negative.
    pub fn svg(&self) -> Result<String, PlotError> {
        for (name, values) in &self.rows {
            check_bars(&self.title, ("row", name), values.iter().flatten())?;
        }
        let names: Vec<&str> = self.rows.iter().map(|(name, _)| name.as_str()).collect();
        let (bar_px, right_px) = match self.decimals {
            Some(_) => (NUMBERED_BAR_PX, 60),
            None => (BAR_PX, 22),
        };
        // Where each row has one value at most, its bar stands at the row's name.
        let is_single = (self.rows.iter()).all(|(_, values)| values.iter().flatten().count() < 2);
        let bars = if is_single {
            1
        } else {
            self.series.len().max(1)
        };
        let row_px = bar_px * bars as i32 + ROW_GAP_PX;
        let all = self.rows.iter().flat_map(|(_, v)| v.iter().flatten());
        let axis = RowBands {
            title: &self.title,
            value_label: &self.value_label,
            legend: boxes(&self.series),
            names: theme::distinct(&names, 34),
            row_px,
            width_px: 300.0,
            around_px: [66, right_px, 26],
            x_label: "",
            values: 0.0..end_above(all.copied(), 1.02),
        };
        axis.draw(|root, axes, marks| {
            let number = text_style(theme::TICK_PX, theme::INK, HPos::Left);
            for (row, (name, values)) in (0..).zip(&self.rows) {
                for (bar, (value, style)) in (0..).zip(values.iter().zip(&self.series)) {
                    let Some(value) = *value else { continue };
                    let bar = if is_single { 0 } else { bar };
                    let y = row_px * row + ROW_GAP_PX / 2 + bar_px * bar;
                    let corners = [(0.0, y), (value, y + bar_px - 1)];
                    let corners = corners.map(|at| axes.backend_coord(&at));
                    let title = format!("{name}, {}: {}", style.name, exact(value));
                    marks.rect(corners, style.color, &title);
                    if let Some(decimals) = self.decimals {
                        let (x, y) = axes.backend_coord(&(value, y + bar_px / 2));
                        root.draw_text(&format!("{value:.decimals$}"), &number, (x + 4, y))?;
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

    #[test]
    fn the_same_numbers_give_the_same_bytes_and_the_unit_is_drawn() {
        let chart = HBarChart {
            title: "by texture".into(),
            value_label: "L1 miss rate, %".into(),
            series: vec![SeriesStyle::nth("Morton", 0)],
            rows: vec![
                ("a.png".into(), vec![Some(3.0)]),
                ("b.png".into(), vec![None]),
            ],
            decimals: Some(1),
        };
        assert_eq!(chart.svg().unwrap(), chart.svg().unwrap());
        for text in ["L1 miss rate, %", "\n3.0\n", "\nb.png\n"] {
            assert!(chart.svg().unwrap().contains(text), "{text}");
        }
    }
}
