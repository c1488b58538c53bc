//! Line and scatter charts. A line's name stands at its last point, moved apart where lines meet;
//! clouds of points are named in a row under the heading.

use super::{
    Anchor, LegendEntry, PlotError, Scale, SeriesStyle, Symbol, dot, draw, heading,
    horizontal_grid, legend, legend_width_px, stroke, text,
};
use crate::report::theme;
use plotters::prelude::Color;

/// How a series' points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A thin line through the points, named at its end.
    Line,
    /// A cloud of dots.
    Dots,
}

/// One series.
#[derive(Clone, Debug, PartialEq)]
pub struct LineSeries {
    /// Name and colour.
    pub style: SeriesStyle,
    /// Points, in drawing order.
    pub points: Vec<(f64, f64)>,
    /// Line or dots.
    pub mark: Mark,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// Ends of the axis; `None` takes them from the data.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis that fits its data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            ..Self::default()
        }
    }
}

/// A line or scatter chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineChart {
    /// Heading.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series in drawing order.
    pub series: Vec<LineSeries>,
}

/// A name at a series' end: text, colour and centre in pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct EndLabel {
    /// Series name.
    pub name: String,
    /// Its colour.
    pub color: plotters::style::RGBColor,
    /// The series' last point, px; a leader line joins it to the name.
    pub from_px: (f64, f64),
    /// Left end of the text, px.
    pub x_px: f64,
    /// Vertical middle of the text, px.
    pub y_px: f64,
}

const LEFT_PX: f64 = 58.0;
const TOP_PX: f64 = 72.0;
const PLOT_PX: (f64, f64) = (430.0, 260.0);
const LABEL_GAP_PX: f64 = 15.0;

struct Layout {
    x: Scale,
    y: Scale,
    x_ticks: Vec<(f64, String)>,
    y_ticks: Vec<(f64, String)>,
}

impl LineChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A point that is not finite.
    pub fn svg(&self) -> Result<String, PlotError> {
        for series in &self.series {
            for &(x, y) in &series.points {
                if !x.is_finite() || !y.is_finite() {
                    return Err(PlotError {
                        title: self.title.clone(),
                        problem: format!(
                            "series `{}` has a point at ({x}, {y})",
                            series.style.name
                        ),
                    });
                }
            }
        }
        let layout = self.layout();
        let labels = self.end_labels(&layout);
        let label_width = labels
            .iter()
            .map(|l| theme::text_width_px(&l.name, theme::LABEL_PX))
            .fold(0.0, f64::max);
        let bottom = TOP_PX + PLOT_PX.1;
        let right = LEFT_PX + PLOT_PX.0;
        let width = (right + 24.0 + label_width + 8.0)
            .max(theme::text_width_px(&self.title, theme::TITLE_PX) + 16.0)
            .max(LEFT_PX + legend_width_px(&self.legend()));
        let height = bottom + 44.0;
        draw(&self.title, (width.ceil() as u32, height as u32), |area| {
            heading(area, &self.title, &self.y.label)?;
            legend(area, (LEFT_PX, 54.0), &self.legend())?;
            horizontal_grid(area, &layout.y, &layout.y_ticks, (LEFT_PX, right), None)?;
            stroke(area, &[(LEFT_PX, bottom), (right, bottom)], theme::AXIS, 1)?;
            for (value, label) in &layout.x_ticks {
                let x = layout.x.at(*value);
                stroke(area, &[(x, bottom), (x, bottom + 4.0)], theme::AXIS, 1)?;
                text(
                    area,
                    (x, bottom + 13.0),
                    label,
                    theme::TICK_PX,
                    theme::MUTED,
                    Anchor::Middle,
                )?;
            }
            let axis_at = (LEFT_PX + PLOT_PX.0 / 2.0, bottom + 33.0);
            text(
                area,
                axis_at,
                &self.x.label,
                theme::LABEL_PX,
                theme::MUTED,
                Anchor::Middle,
            )?;
            for series in &self.series {
                paint(area, series, &layout)?;
            }
            for label in &labels {
                let at = (label.x_px, label.y_px);
                let leader = [
                    label.from_px,
                    (label.x_px - 12.0, label.y_px),
                    (label.x_px - 4.0, label.y_px),
                ];
                stroke(area, &leader, label.color, 1)?;
                text(
                    area,
                    at,
                    &label.name,
                    theme::LABEL_PX,
                    theme::INK,
                    Anchor::Start,
                )?;
            }
            Ok(())
        })
    }

    /// Where the names of the series stand; never nearer than a line's height to each other.
    #[must_use]
    pub fn label_positions(&self) -> Vec<EndLabel> {
        self.end_labels(&self.layout())
    }

    fn end_labels(&self, layout: &Layout) -> Vec<EndLabel> {
        let named: Vec<(&LineSeries, (f64, f64))> = self
            .series
            .iter()
            .filter(|s| !s.style.name.is_empty() && s.mark == Mark::Line)
            .filter_map(|s| {
                let end = s
                    .points
                    .iter()
                    .copied()
                    .max_by(|a, b| a.0.total_cmp(&b.0))?;
                Some((s, end))
            })
            .collect();
        let wishes: Vec<f64> = named.iter().map(|(_, (_, y))| layout.y.at(*y)).collect();
        let placed = theme::spread(&wishes, LABEL_GAP_PX, TOP_PX, TOP_PX + PLOT_PX.1);
        named
            .iter()
            .zip(placed)
            .map(|((series, end), y_px)| EndLabel {
                from_px: (layout.x.at(end.0), layout.y.at(end.1)),
                name: series.style.name.clone(),
                color: series.style.color,
                x_px: LEFT_PX + PLOT_PX.0 + 22.0,
                y_px,
            })
            .collect()
    }

    fn legend(&self) -> Vec<LegendEntry<'_>> {
        self.series
            .iter()
            .filter(|s| s.mark == Mark::Dots && !s.style.name.is_empty())
            .map(|s| LegendEntry {
                name: &s.style.name,
                color: s.style.color,
                symbol: Symbol::Dot,
            })
            .collect()
    }

    fn layout(&self) -> Layout {
        let bottom = TOP_PX + PLOT_PX.1;
        let (x, x_ticks) = fit(
            &self.x,
            self.series
                .iter()
                .flat_map(|s| s.points.iter().map(|p| p.0)),
            (LEFT_PX, LEFT_PX + PLOT_PX.0),
        );
        let (y, y_ticks) = fit(
            &self.y,
            self.series
                .iter()
                .flat_map(|s| s.points.iter().map(|p| p.1)),
            (bottom, TOP_PX),
        );
        Layout {
            x,
            y,
            x_ticks,
            y_ticks,
        }
    }
}

fn paint(area: &super::Area, series: &LineSeries, layout: &Layout) -> Result<(), String> {
    let points: Vec<(f64, f64)> = series
        .points
        .iter()
        .map(|&(x, y)| (layout.x.at(x), layout.y.at(y)))
        .collect();
    let color = series.style.color;
    match series.mark {
        Mark::Line => stroke(area, &points, color, 1),
        Mark::Dots => points
            .iter()
            .try_for_each(|&at| dot(area, at, color.filled())),
    }
}

/// The scale of an axis and its ticks.
fn fit(
    axis: &Axis,
    values: impl Iterator<Item = f64>,
    (from, to): (f64, f64),
) -> (Scale, Vec<(f64, String)>) {
    let (low, high) = axis.range.unwrap_or_else(|| {
        values
            .fold(None, |range: Option<(f64, f64)>, v| {
                Some(range.map_or((v, v), |(l, h)| (l.min(v), h.max(v))))
            })
            .unwrap_or((0.0, 1.0))
    });
    let mut step = theme::nice_step((high - low).max(high.abs() * 1e-3), 5);
    let (mut low, mut high) = (low, high);
    if axis.range.is_none() {
        if low >= 0.0 && low < 0.35 * high {
            low = 0.0;
            step = theme::nice_step(high, 5);
        }
        low = (low / step).floor() * step;
        high = ((high / step).ceil() * step).max(low + step);
    }
    let ticks = theme::ticks(low, high, step)
        .into_iter()
        .map(|v| (v, theme::tick_label(v, step)))
        .collect();
    (Scale::linear(low, high, from, to), ticks)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> LineChart {
        let series = |name: &str, i, end: f64| LineSeries {
            style: SeriesStyle::nth(name, i),
            points: vec![(8.0, 20.0), (16.0, end)],
            mark: Mark::Line,
        };
        LineChart {
            title: "Miss rate".into(),
            x: Axis::linear("L1 size, KiB"),
            y: Axis::linear("L1 miss rate, %"),
            series: vec![
                series("Morton", 0, 10.0),
                series("Z2 LRTA", 1, 9.9),
                series("Z2 STA", 2, 9.8),
            ],
        }
    }

    #[test]
    fn the_same_numbers_give_the_same_bytes() {
        assert_eq!(chart().svg().unwrap(), chart().svg().unwrap());
    }

    #[test]
    fn names_of_series_that_end_together_do_not_overlap() {
        let mut at: Vec<f64> = chart().label_positions().iter().map(|l| l.y_px).collect();
        at.sort_by(f64::total_cmp);
        assert!(
            at.windows(2).all(|w| w[1] - w[0] >= LABEL_GAP_PX - 1e-9),
            "{at:?}"
        );
    }

    #[test]
    fn both_axes_carry_their_units() {
        let svg = chart().svg().unwrap();
        assert!(svg.contains("L1 size, KiB") && svg.contains("L1 miss rate, %"));
    }

    #[test]
    fn a_point_that_is_not_finite_is_refused() {
        let mut bad = chart();
        bad.series[0].points[0].0 = f64::NAN;
        assert_eq!(
            bad.svg().unwrap_err().to_string(),
            "plot `Miss rate`: series `Morton` has a point at (NaN, 20)"
        );
    }
}
