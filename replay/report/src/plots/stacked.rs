//! Stacked bars: the parts of several totals.

use super::bars::wrap;
use super::frame::{Frame, LegendEntry, Symbol, text_style, themed, tick_format};
use super::lines::exact;
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::style::text_anchor::HPos;

/// A chart of stacked bars.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct StackedChart {
    /// Heading.
    pub title: String,
    /// What the bars show, with its unit.
    pub value_label: String,
    /// What the bars are, with the unit if they have one.
    pub bar_label: String,
    /// Parts, from bottom to top.
    pub series: Vec<SeriesStyle>,
    /// Name under each bar, which may be empty, and its parts.
    pub bars: Vec<(String, Vec<f64>)>,
    /// Width of a bar, px.
    pub bar_px: f64,
    /// Top of the axis; `None` takes it from the data.
    pub highest: Option<f64>,
    /// Decimals of the sums written over the bars; `None` writes none.
    pub decimals: Option<usize>,
}

const LEFT_PX: u32 = 58;
const TOP_PX: u32 = 66;
const PLOT_HEIGHT_PX: f64 = 216.0;
const LINE_HEIGHT_PX: i32 = 15;
/// Free share of the width of each bar's place.
const GAP: f64 = 0.16;

impl StackedChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A part that is not finite or negative, or a bar whose parts do not match the series.
    pub fn svg(&self) -> Result<String, PlotError> {
        for (name, parts) in &self.bars {
            let bad = parts
                .iter()
                .find(|part| !(part.is_finite() && **part >= 0.0));
            let problem = match bad {
                Some(bad) => format!("bar `{name}` holds {bad}"),
                None if parts.len() != self.series.len() => format!(
                    "bar `{name}` has {} parts for {} series",
                    parts.len(),
                    self.series.len()
                ),
                None => continue,
            };
            return Err(PlotError {
                title: self.title.clone(),
                problem,
            });
        }
        let sums = self.bars.iter().map(|(_, parts)| parts.iter().sum::<f64>());
        let largest = sums.clone().fold(0.0, f64::max);
        let highest = match self.highest {
            Some(highest) => highest,
            None if largest > 0.0 => 1.08 * largest,
            None => 1.0,
        };
        let names: Vec<Vec<String>> = self
            .bars
            .iter()
            .map(|(name, _)| wrap(name, self.bar_px * 1.1, theme::TICK_PX))
            .collect();
        let name_lines = names.iter().map(Vec::len).max().unwrap_or(1) as u32;
        let axis_title_px = if self.bar_label.is_empty() { 0 } else { 18 };
        let count = self.bars.len().max(1) as f64;
        let values = 0.0..highest;
        let frame = Frame {
            title: &self.title,
            value_label: &self.value_label,
            legend: self.legend(),
            plot_px: ((self.bar_px * count).max(120.0), PLOT_HEIGHT_PX),
            around_px: [
                TOP_PX,
                14,
                10 + LINE_HEIGHT_PX as u32 * name_lines + axis_title_px,
                LEFT_PX,
            ],
        };
        frame.draw(|root, mut builder, marks| {
            let mut chart = builder.build_cartesian_2d(0.0..count, values.clone())?;
            let mut mesh = chart.configure_mesh();
            themed(&mut mesh)
                .disable_x_mesh()
                .x_labels(0)
                .x_desc(&self.bar_label)
                .y_label_formatter(&tick_format(&values))
                .draw()?;
            let name_style = text_style(theme::TICK_PX, theme::INK, HPos::Center);
            for (index, (((name, parts), lines), sum)) in
                self.bars.iter().zip(&names).zip(sums).enumerate()
            {
                let (left, right) = (index as f64 + GAP / 2.0, index as f64 + 1.0 - GAP / 2.0);
                let mut below = 0.0;
                for (part, style) in parts.iter().zip(&self.series) {
                    let corners = [(left, below), (right, below + part)];
                    let corners = corners.map(|at| chart.backend_coord(&at));
                    let title = format!("{name}, {}: {}", style.name, exact(*part));
                    if *part > 0.0 {
                        marks.rect(corners, style.color, &title);
                    }
                    below += part;
                }
                if let Some(decimals) = self.decimals {
                    let (x, y) = chart.backend_coord(&((left + right) / 2.0, sum));
                    root.draw_text(&format!("{sum:.decimals$}"), &name_style, (x, y - 8))?;
                }
                for (number, line) in (0..).zip(lines) {
                    let (x, y) = chart.backend_coord(&((left + right) / 2.0, 0.0));
                    let at = (x, y + 13 + LINE_HEIGHT_PX * number);
                    root.draw_text(line, &name_style, at)?;
                }
            }
            Ok(())
        })
    }

    fn legend(&self) -> Vec<LegendEntry<'_>> {
        let series = self.series.iter();
        series
            .map(|style| LegendEntry {
                name: &style.name,
                color: style.color,
                symbol: Symbol::Box,
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> StackedChart {
        StackedChart {
            title: "Misses".into(),
            value_label: "% of accesses".into(),
            series: vec![
                SeriesStyle::nth("capacity", 0),
                SeriesStyle::nth("conflict", 1),
            ],
            bars: vec![
                ("Morton".into(), vec![3.0, 1.0]),
                ("Z2 STA".into(), vec![2.0, 0.5]),
            ],
            bar_px: 60.0,
            decimals: Some(1),
            ..StackedChart::default()
        }
    }

    #[test]
    fn parts_are_stacked_with_the_sum_above_them() {
        let svg = chart().svg().unwrap();
        assert_eq!(svg, chart().svg().unwrap());
        assert!(svg.contains("\n4.0\n") && svg.contains("\n2.5\n"), "sums");
    }

    #[test]
    fn invalid_parts_are_refused() {
        let mut bad = chart();
        bad.bars[1].1[0] = -1.0;
        let error = bad.svg().unwrap_err().to_string();
        assert_eq!(error, "plot `Misses`: bar `Z2 STA` holds -1");
        bad.bars[1].1 = vec![1.0];
        let error = bad.svg().unwrap_err().to_string();
        assert!(error.contains("1 parts for 2 series"), "{error}");
    }
}
