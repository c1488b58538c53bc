//! Horizontal grouped bars, for long names.

use super::frame::{Frame, LegendEntry, Symbol, text_style, themed, tick_format};
use super::lines::exact;
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::prelude::BindKeyPoints;
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

const TOP_PX: u32 = 66;
const BAR_PX: i32 = 6;
/// Height of a bar with a number: a line of text.
const NUMBERED_BAR_PX: i32 = 12;
const ROW_GAP_PX: i32 = 7;
const PLOT_WIDTH_PX: f64 = 300.0;
const LONGEST_NAME_CHARS: usize = 34;

impl HBarChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A value that is not finite or negative.
    pub fn svg(&self) -> Result<String, PlotError> {
        for (name, values) in &self.rows {
            if let Some(bad) = values
                .iter()
                .flatten()
                .find(|v| !(v.is_finite() && **v >= 0.0))
            {
                return Err(PlotError {
                    title: self.title.clone(),
                    problem: format!("row `{name}` holds {bad}"),
                });
            }
        }
        let names: Vec<&str> = self.rows.iter().map(|(name, _)| name.as_str()).collect();
        let names = theme::distinct(&names, LONGEST_NAME_CHARS);
        let name_px = names
            .iter()
            .map(|n| theme::text_width_px(n, theme::TICK_PX))
            .fold(40.0, f64::max);
        let (bar_px, right_px) = match self.decimals {
            Some(_) => (NUMBERED_BAR_PX, 60),
            None => (BAR_PX, 22),
        };
        let row_px = bar_px * self.series.len().max(1) as i32 + ROW_GAP_PX;
        let height_px = row_px * names.len().max(1) as i32;
        let largest = self
            .rows
            .iter()
            .flat_map(|(_, v)| v.iter().flatten().copied())
            .fold(0.0, f64::max);
        let values = 0.0..if largest > 0.0 { largest * 1.02 } else { 1.0 };
        let legend = self.series.iter().map(|s| LegendEntry {
            name: &s.name,
            color: s.color,
            symbol: Symbol::Box,
        });
        let frame = Frame {
            title: &self.title,
            value_label: &self.value_label,
            legend: legend.collect(),
            plot_px: (PLOT_WIDTH_PX, f64::from(height_px)),
            around_px: [TOP_PX, right_px, 26, name_px as u32 + 16],
        };
        frame.draw(|root, mut builder, marks| {
            // Positions are in pixels from the top, because numbers next to bars need a line of text.
            let middles: Vec<i32> = (0..names.len() as i32)
                .map(|row| row_px * row + row_px / 2)
                .collect();
            let rows = (height_px..0).with_key_points(middles);
            let mut chart = builder.build_cartesian_2d(values.clone(), rows)?;
            let name = |y: &i32| names.get((y / row_px) as usize).cloned();
            themed(&mut chart.configure_mesh())
                .disable_y_mesh()
                .y_label_style(text_style(theme::TICK_PX, theme::INK, HPos::Right))
                .x_label_formatter(&tick_format(&values))
                .y_label_formatter(&|y| name(y).unwrap_or_default())
                .draw()?;
            let number = text_style(theme::TICK_PX, theme::INK, HPos::Left);
            for (row, (name, values)) in (0..).zip(&self.rows) {
                for (bar, (value, style)) in (0..).zip(values.iter().zip(&self.series)) {
                    let Some(value) = *value else { continue };
                    let y = row_px * row + ROW_GAP_PX / 2 + bar_px * bar;
                    let corners = [(0.0, y), (value, y + bar_px - 1)];
                    let corners = corners.map(|at| chart.backend_coord(&at));
                    let title = format!("{name}, {}: {}", style.name, exact(value));
                    marks.rect(corners, style.color, &title);
                    if let Some(decimals) = self.decimals {
                        let (x, y) = chart.backend_coord(&(value, y + bar_px / 2));
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
