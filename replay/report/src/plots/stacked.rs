//! Stacked bars: the parts of several totals.

use super::bands::{ColumnBands, boxes, check_bars, end_above};
use super::bars::wrap;
use super::frame::text_style;
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

/// Free share of the width of each bar's place.
const GAP: f64 = 0.16;

impl StackedChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A part that is not finite or negative, or a bar whose parts do not match the series.
    pub fn svg(&self) -> Result<String, PlotError> {
        for (name, parts) in &self.bars {
            check_bars(&self.title, ("bar", name), parts.iter())?;
            let (parts, series) = (parts.len(), self.series.len());
            if parts != series {
                let problem = format!("bar `{name}` has {parts} parts for {series} series");
                return Err(PlotError::new(&self.title, problem));
            }
        }
        let sum = |(_, parts): &(String, Vec<f64>)| parts.iter().sum::<f64>();
        let names = self.bars.iter();
        let names = names.map(|(name, _)| wrap(name, self.bar_px * 1.1, theme::TICK_PX));
        let axis = ColumnBands {
            title: &self.title,
            value_label: &self.value_label,
            legend: boxes(&self.series),
            names: names.collect(),
            name_px: (theme::TICK_PX, 13),
            width_px: (self.bar_px * self.bars.len().max(1) as f64).max(120.0),
            x_label: &self.bar_label,
            highest: self
                .highest
                .unwrap_or_else(|| end_above(self.bars.iter().map(sum), 1.08)),
            reference: None,
        };
        let number = text_style(theme::TICK_PX, theme::INK, HPos::Center);
        axis.draw(|index, root, axes, marks| {
            let bar @ (name, parts) = &self.bars[index];
            let (left, right) = (index as f64 + GAP / 2.0, index as f64 + 1.0 - GAP / 2.0);
            let mut below = 0.0;
            for (part, style) in parts.iter().zip(&self.series) {
                let corners = [(left, below), (right, below + part)];
                let corners = corners.map(|at| axes.backend_coord(&at));
                let title = format!("{name}, {}: {}", style.name, exact(*part));
                if *part > 0.0 {
                    marks.rect(corners, style.color, &title);
                }
                below += part;
            }
            if let Some(decimals) = self.decimals {
                let (x, y) = axes.backend_coord(&((left + right) / 2.0, sum(bar)));
                root.draw_text(&format!("{:.decimals$}", sum(bar)), &number, (x, y - 8))?;
            }
            Ok(())
        })
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
