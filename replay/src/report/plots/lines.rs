//! Line and scatter charts. Lines are labelled at their last point, with labels moved apart if they
//! overlap. Point clouds are named in a row below the heading.

use super::frame::{AXIS_PX, DOT_PX, Frame, LegendEntry, Symbol, text_style, themed, tick_format};
use super::{PlotError, SeriesStyle};
use crate::report::theme;
use crate::size::format_bytes;
use plotters::prelude::{Circle, Color, PathElement};
use plotters::style::text_anchor::HPos;
use std::ops::Range;

/// How a series' points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A thin line through the points, labelled at its end.
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

/// Unit of an axis of doublings, for its ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doublings {
    /// Sizes, with binary units.
    Bytes,
    /// Numbers.
    Numbers,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// Ends of the axis; `None` takes them from the data.
    pub range: Option<(f64, f64)>,
    /// The axis is logarithmic to base 2 with ticks in this unit; `None` for a linear axis.
    pub doublings: Option<Doublings>,
}

impl Axis {
    /// A linear axis that fits its data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            ..Self::default()
        }
    }

    /// An axis of doublings, for positive values.
    pub fn doublings(label: impl Into<String>, of: Doublings) -> Self {
        Self {
            label: label.into(),
            doublings: Some(of),
            ..Self::default()
        }
    }

    /// The coordinate of a value on the axis.
    fn place(&self, value: f64) -> f64 {
        match self.doublings {
            Some(_) => value.log2(),
            None => value,
        }
    }

    /// Formats ticks. On an axis of doublings, only doublings have labels, unless the axis has few of them.
    fn tick(&self, range: &Range<f64>) -> Box<dyn Fn(&f64) -> String> {
        match self.doublings {
            None => Box::new(tick_format(range)),
            Some(Doublings::Numbers) if range.end - range.start < 3.0 => {
                Box::new(|place| theme::group_thousands(&format!("{:.1}", place.exp2())))
            }
            Some(of) => Box::new(move |place| {
                let whole = place.round();
                let value = whole.exp2();
                match of {
                    _ if (place - whole).abs() > 1e-6 => String::new(),
                    Doublings::Bytes => format_bytes(value as u64),
                    Doublings::Numbers => theme::group_thousands(&value.to_string()),
                }
            }),
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

const LEFT_PX: u32 = 58;
const TOP_PX: u32 = 72;
const PLOT_PX: (f64, f64) = (430.0, 260.0);
const LABEL_GAP_PX: f64 = 15.0;
/// Distance from the plotting area to the labels at the lines' ends.
const NAMES_PX: i32 = 22;

impl LineChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A point that is not finite.
    pub fn svg(&self) -> Result<String, PlotError> {
        for series in &self.series {
            for &(x, y) in &series.points {
                if !self.x.place(x).is_finite() || !self.y.place(y).is_finite() {
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
        let place = |&(x, y): &(f64, f64)| (self.x.place(x), self.y.place(y));
        let points = || self.series.iter().flat_map(|s| s.points.iter().map(place));
        let x = self.x.fit(points().map(|p| p.0));
        let y = self.y.fit(points().map(|p| p.1));
        let named = |mark| {
            let series = self.series.iter();
            series.filter(move |s| s.mark == mark && !s.style.name.is_empty())
        };
        let names_px = named(Mark::Line)
            .map(|s| theme::text_width_px(&s.style.name, theme::LABEL_PX))
            .fold(0.0, f64::max);
        let legend = named(Mark::Dots).map(|s| LegendEntry {
            name: &s.style.name,
            color: s.style.color,
            symbol: Symbol::Dot,
        });
        let frame = Frame {
            title: &self.title,
            value_label: &self.y.label,
            legend: legend.collect(),
            plot_px: PLOT_PX,
            around_px: [
                TOP_PX,
                NAMES_PX as u32 + 10 + names_px as u32,
                AXIS_PX,
                LEFT_PX,
            ],
        };
        frame.draw(|root, mut builder| {
            let mut chart = builder.build_cartesian_2d(x.clone(), y.clone())?;
            themed(&mut chart.configure_mesh())
                .disable_x_mesh()
                .x_desc(&self.x.label)
                .x_label_formatter(&self.x.tick(&x))
                .y_label_formatter(&self.y.tick(&y))
                .draw()?;
            for LineSeries {
                style,
                points,
                mark,
            } in &self.series
            {
                match mark {
                    Mark::Line => {
                        let line: Vec<_> = points.iter().map(place).collect();
                        let line = PathElement::new(line, style.color);
                        chart.plotting_area().draw(&line)?;
                    }
                    Mark::Dots => {
                        let dot = |at| Circle::new(place(at), DOT_PX, style.color.filled());
                        chart.draw_series(points.iter().map(dot))?;
                    }
                }
            }
            let last = |s: &LineSeries| s.points.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0));
            let ends: Vec<(&SeriesStyle, (i32, i32))> = named(Mark::Line)
                .filter_map(|s| Some((&s.style, chart.backend_coord(&place(&last(s)?)))))
                .collect();
            let wishes: Vec<f64> = ends.iter().map(|(_, (_, y))| f64::from(*y)).collect();
            let top = f64::from(TOP_PX);
            let placed = theme::spread(&wishes, LABEL_GAP_PX, top, top + PLOT_PX.1);
            let x = LEFT_PX as i32 + PLOT_PX.0 as i32 + NAMES_PX;
            for ((style, end), y) in ends.into_iter().zip(placed) {
                let y = y.round() as i32;
                let leader = [end, (x - 12, y), (x - 4, y)];
                root.draw(&PathElement::new(leader, style.color))?;
                let name = text_style(theme::LABEL_PX, theme::INK, HPos::Left);
                root.draw_text(&style.name, &name, (x, y))?;
            }
            Ok(())
        })
    }
}

impl Axis {
    /// The ends of the axis for these values.
    pub(super) fn fit(&self, values: impl Iterator<Item = f64>) -> Range<f64> {
        if let Some((low, high)) = self.range {
            return low..high;
        }
        let (low, high) = values
            .fold(None, |range: Option<(f64, f64)>, v| {
                Some(range.map_or((v, v), |(l, h)| (l.min(v), h.max(v))))
            })
            .unwrap_or((0.0, 1.0));
        // Points keep a distance from the edges; an axis that comes near zero starts at zero.
        let room = match 0.04 * (high - low) {
            0.0 => (0.04 * high.abs()).max(0.5),
            room => room,
        };
        let from_zero = self.doublings.is_none() && low >= 0.0 && low < 0.35 * high;
        (if from_zero { 0.0 } else { low - room })..high + room
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::text_at;
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
    fn labels_of_series_that_end_together_do_not_overlap() {
        let svg = chart().svg().unwrap();
        let mut at = ["Morton", "Z2 LRTA", "Z2 STA"].map(|name| text_at(&svg, name).1);
        at.sort_by(f64::total_cmp);
        assert!(
            at.windows(2).all(|w| w[1] - w[0] >= LABEL_GAP_PX - 1.0),
            "{at:?}"
        );
    }

    #[test]
    fn both_axes_show_their_units() {
        let svg = chart().svg().unwrap();
        assert!(svg.contains("L1 size, KiB") && svg.contains("L1 miss rate, %"));
        assert!(svg.contains("\n16\n") && svg.contains("\n20\n"), "ticks");
    }

    #[test]
    fn an_axis_of_doublings_is_logarithmic() {
        let mut chart = chart();
        chart.x = Axis::doublings("L1 size", Doublings::Bytes);
        chart.series[0].points = vec![(8.0, 1.0), (16.0, 1.0), (32.0, 1.0), (2048.0, 1.0)];
        let svg = chart.svg().unwrap();
        let at = ["16 B", "64 B", "256 B"].map(|tick| text_at(&svg, tick).0);
        assert!((at[1] - at[0] - (at[2] - at[1])).abs() <= 1.0, "{at:?}");
        chart.series[0].points[0].0 = 0.0;
        assert!(chart.svg().unwrap_err().to_string().contains("(0, 1)"));
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
