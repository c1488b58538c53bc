//! A function of two miss rates as contour lines, with measured points over it.

use super::{
    Anchor, LegendEntry, PlotError, Scale, SeriesStyle, Symbol, dot, draw, heading,
    horizontal_grid, legend, legend_width_px, stroke, text,
};
use crate::report::theme;
use plotters::prelude::Color;

/// Points of one series.
#[derive(Clone, Debug, PartialEq)]
pub struct PointSeries {
    /// Name and colour.
    pub style: SeriesStyle,
    /// Points.
    pub points: Vec<(f64, f64)>,
    /// Rings instead of dots (published values).
    pub hollow: bool,
}

/// A contour chart over `x` (logarithmic to base 2) and `y` (0 to 100), both in percent.
pub struct ContourChart<'a> {
    /// Heading.
    pub title: String,
    /// Horizontal axis with its unit.
    pub x_label: String,
    /// Vertical axis with its unit.
    pub y_label: String,
    /// Ends of the horizontal axis.
    pub x_range: (f64, f64),
    /// The function; falls as `y` grows.
    pub surface: &'a dyn Fn(f64, f64) -> f64,
    /// Values at which a line is drawn, and their unit.
    pub levels: (Vec<f64>, &'a str),
    /// Points over the lines.
    pub series: Vec<PointSeries>,
}

const LEFT_PX: f64 = 58.0;
const TOP_PX: f64 = 92.0;
const SIZE_PX: (f64, f64) = (430.0, 260.0);

impl ContourChart<'_> {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A range that is not above 0, or a point that is not finite.
    pub fn svg(&self) -> Result<String, PlotError> {
        let fail = |problem: String| PlotError {
            title: self.title.clone(),
            problem,
        };
        let (low, high) = self.x_range;
        if !(low > 0.0 && high > low) {
            return Err(fail(format!("horizontal range {low} to {high}")));
        }
        for series in &self.series {
            if let Some(bad) = series
                .points
                .iter()
                .find(|p| !(p.0.is_finite() && p.1.is_finite()))
            {
                return Err(fail(format!(
                    "series `{}` has a point at {bad:?}",
                    series.style.name
                )));
            }
        }
        let (right, bottom) = (LEFT_PX + SIZE_PX.0, TOP_PX + SIZE_PX.1);
        let x = Scale::log(low, high, LEFT_PX, right);
        let y = Scale::linear(0.0, 100.0, bottom, TOP_PX);
        let ticks: Vec<(f64, String)> = theme::ticks(0.0, 100.0, 20.0)
            .into_iter()
            .map(|v| (v, theme::tick_label(v, 20.0)))
            .collect();
        let width = (right + 26.0).max(LEFT_PX + legend_width_px(&self.legend()));
        let size = (width.ceil() as u32, (bottom + 44.0) as u32);
        draw(&self.title, size, |area| {
            heading(area, &self.title, &self.y_label)?;
            legend(area, (LEFT_PX, 54.0), &self.legend())?;
            horizontal_grid(area, &y, &ticks, (LEFT_PX, right), Some(0.0))?;
            let mut tick = low.log2().ceil().exp2();
            while tick <= high * 1.0001 {
                let at = x.at(tick);
                stroke(area, &[(at, bottom), (at, bottom + 4.0)], theme::AXIS, 1)?;
                let label = theme::tick_label(tick, tick.min(1.0));
                text(
                    area,
                    (at, bottom + 13.0),
                    &label,
                    theme::TICK_PX,
                    theme::MUTED,
                    Anchor::Middle,
                )?;
                tick *= 2.0;
            }
            let below = (LEFT_PX + SIZE_PX.0 / 2.0, bottom + 33.0);
            text(
                area,
                below,
                &self.x_label,
                theme::LABEL_PX,
                theme::MUTED,
                Anchor::Middle,
            )?;
            self.contours(area, &x, &y)?;
            for series in &self.series {
                let style = if series.hollow {
                    series.style.color.stroke_width(1)
                } else {
                    series.style.color.filled()
                };
                for &(px, py) in &series.points {
                    dot(area, (x.at(px.clamp(low, high)), y.at(py)), style)?;
                }
            }
            Ok(())
        })
    }

    fn contours(&self, area: &super::Area, x: &Scale, y: &Scale) -> Result<(), String> {
        let (low, high) = self.x_range;
        let (levels, unit) = &self.levels;
        let mut ends = Vec::new();
        for &level in levels {
            let line: Vec<(f64, f64)> = (0..=96)
                .map(|i| low * (high / low).powf(f64::from(i) / 96.0))
                .filter_map(|at| Some((at, self.solve(at, level)?)))
                .map(|(at, value)| (x.at(at), y.at(value)))
                .collect();
            if let Some(&first) = line.first() {
                stroke(area, &line, theme::AXIS, 1)?;
                ends.push((level, first));
            }
        }
        // Lines end at the top edge (from there on the level is out of reach); names stand above.
        let wishes: Vec<f64> = ends.iter().map(|(_, (x, _))| *x).collect();
        let at = theme::spread(&wishes, 34.0, LEFT_PX, LEFT_PX + SIZE_PX.0);
        for ((level, _), at) in ends.iter().zip(at) {
            let label = format!("{level}{unit}");
            text(
                area,
                (at, TOP_PX - 9.0),
                &label,
                theme::TICK_PX,
                theme::MUTED,
                Anchor::Middle,
            )?;
        }
        Ok(())
    }

    /// The `y` from 0 to 100 at which the surface has this level, by bisection.
    fn solve(&self, x: f64, level: f64) -> Option<f64> {
        let (mut low, mut high) = (0.0, 100.0);
        if (self.surface)(x, low) < level || (self.surface)(x, high) > level {
            return None;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if (self.surface)(x, middle) >= level {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(0.5 * (low + high))
    }

    fn legend(&self) -> Vec<LegendEntry<'_>> {
        self.series
            .iter()
            .map(|s| LegendEntry {
                name: &s.style.name,
                color: s.style.color,
                symbol: if s.hollow { Symbol::Ring } else { Symbol::Dot },
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contour_lies_on_its_level() {
        let surface = |x: f64, y: f64| 100.0 - x * y / 100.0;
        let chart = ContourChart {
            title: "t".into(),
            x_label: "L1 miss rate, %".into(),
            y_label: "L2 miss rate, %".into(),
            x_range: (1.0, 64.0),
            surface: &surface,
            levels: (vec![90.0], " %"),
            series: Vec::new(),
        };
        let y = chart.solve(20.0, 90.0).unwrap();
        assert!((surface(20.0, y) - 90.0).abs() < 1e-6);
        assert_eq!(chart.solve(1.0, 90.0), None);
        assert!(chart.svg().unwrap().contains("L1 miss rate, %"));
        assert_eq!(chart.svg().unwrap(), chart.svg().unwrap());
    }
}
