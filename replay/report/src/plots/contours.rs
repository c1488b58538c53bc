//! A function of two miss rates as contour lines, with measured points.

use super::frame::{AXIS_PX, Frame, LegendEntry, Symbol, text_style, themed, tick_format};
use super::lines::exact;
use super::marks::Shape;
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::prelude::{IntoLogRange, PathElement};
use plotters::style::text_anchor::HPos;

/// Points of one series.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PointSeries {
    /// Name and colour.
    pub style: SeriesStyle,
    /// Points.
    pub points: Vec<(f64, f64)>,
    /// Rings instead of dots (published values).
    pub hollow: bool,
}

/// A contour chart over `x` (logarithmic to base 2) and `y` (0 to 100), both in percent.
pub(crate) struct ContourChart<'a> {
    /// Heading.
    pub title: String,
    /// Horizontal axis with its unit.
    pub x_label: String,
    /// Vertical axis with its unit.
    pub y_label: String,
    /// Ends of the horizontal axis.
    pub x_range: (f64, f64),
    /// The function; it falls as `y` grows.
    pub surface: &'a dyn Fn(f64, f64) -> f64,
    /// Values at which a line is drawn, and their unit.
    pub levels: (Vec<f64>, &'a str),
    /// Points over the lines.
    pub series: Vec<PointSeries>,
}

const LEFT_PX: u32 = 58;
const TOP_PX: u32 = 92;
const PLOT_PX: (f64, f64) = (430.0, 260.0);

impl ContourChart<'_> {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A range that is not above 0, or a point that is not finite.
    pub fn svg(&self) -> Result<String, PlotError> {
        let fail = |problem: String| PlotError::new(&self.title, problem);
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
        let legend = self
            .series
            .iter()
            .enumerate()
            .map(|(index, s)| LegendEntry {
                name: &s.style.name,
                color: s.style.color,
                symbol: Symbol::Point(Shape::nth(index), !s.hollow),
            });
        let frame = Frame {
            title: &self.title,
            value_label: &self.y_label,
            legend: legend.collect(),
            plot_px: PLOT_PX,
            around_px: [TOP_PX, 26, AXIS_PX, LEFT_PX],
        };
        frame.draw(|root, mut builder, marks| {
            let x = (low..high).log_scale().base(2.0);
            let mut chart = builder.build_cartesian_2d(x, 0.0..100.0)?;
            themed(&mut chart.configure_mesh())
                .disable_x_mesh()
                .x_desc(&self.x_label)
                .x_labels(12)
                .x_label_formatter(&|x| x.to_string())
                .y_label_formatter(&tick_format(&(0.0..100.0)))
                .draw()?;
            let (levels, unit) = &self.levels;
            let top = chart.plotting_area().get_pixel_range().1.start;
            let mut ends = Vec::new();
            for &level in levels {
                let line: Vec<(f64, f64)> = (0..=96)
                    .map(|i| low * (high / low).powf(f64::from(i) / 96.0))
                    .filter_map(|at| Some((at, self.solve(at, level)?)))
                    .collect();
                if let Some(first) = line.first() {
                    ends.push((level, f64::from(chart.backend_coord(first).0)));
                    chart
                        .plotting_area()
                        .draw(&PathElement::new(line, theme::AXIS))?;
                }
            }
            // Lines end at the top edge, beyond which the level does not occur. Their names stand above.
            let wishes: Vec<f64> = ends.iter().map(|(_, x)| *x).collect();
            let left = f64::from(LEFT_PX);
            let placed = theme::spread(&wishes, 34.0, left, left + PLOT_PX.0);
            let name = text_style(theme::TICK_PX, theme::MUTED, HPos::Center);
            for ((level, _), x) in ends.iter().zip(placed) {
                let at = (x.round() as i32, top - 9);
                root.draw_text(&format!("{level}{unit}"), &name, at)?;
            }
            for (index, series) in self.series.iter().enumerate() {
                for &(x, y) in &series.points {
                    let at = chart.backend_coord(&(x.clamp(low, high), y));
                    let title = format!("{}: {} % at {} %", series.style.name, exact(y), exact(x));
                    let style = (series.style.color, !series.hollow);
                    marks.symbol(Shape::nth(index), at, style, &title);
                }
            }
            Ok(())
        })
    }

    /// The `y` from 0 to 100 at which the surface has this level, found by bisection.
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
