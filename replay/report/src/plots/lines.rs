//! Line and scatter charts. Lines differ in dashes and symbols as well as in colour. Their names stand in a
//! column to the right of the axes, moved apart if they would overlap; a grey dotted leader joins a name to
//! the height of its line's end. Point clouds are named in rows below the heading.

use super::axis::draw_axes;
pub use super::axis::{Axis, Doublings};
use super::frame::{AXIS_PX, Frame, LegendEntry, Symbol, text_style};
use super::marks::{Shape, dash};
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::style::text_anchor::HPos;

/// How a series' points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A thin line through the points, labelled at its end.
    Line,
    /// A cloud of symbols.
    Dots,
}

/// One series.
#[derive(Clone, Debug, PartialEq)]
pub struct LineSeries {
    /// Name and colour.
    pub style: SeriesStyle,
    /// Points, in drawing order.
    pub points: Vec<(f64, f64)>,
    /// Line or symbols.
    pub mark: Mark,
}

impl LineSeries {
    /// A line through points.
    pub fn line(style: SeriesStyle, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            style,
            points: points.into_iter().collect(),
            mark: Mark::Line,
        }
    }

    /// A cloud of points.
    pub fn dots(style: SeriesStyle, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            mark: Mark::Dots,
            ..Self::line(style, points)
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

const PLOT_PX: (f64, f64) = (430.0, 260.0);
const LABEL_GAP_PX: f64 = 15.0;
/// Leader and sample of the line, between the axes and the names.
const LEADER_PX: i32 = 16;
const SAMPLE_PX: i32 = 26;
/// A line with more points than this has symbols at some of them only.
const MOST_SYMBOLS: usize = 14;

impl LineChart {
    /// Refuses points that are not finite.
    fn check(&self) -> Result<(), PlotError> {
        for series in &self.series {
            let is_finite =
                |&(x, y): &(f64, f64)| self.x.place(x).is_finite() && self.y.place(y).is_finite();
            if let Some((x, y)) = series.points.iter().find(|point| !is_finite(point)) {
                let name = &series.style.name;
                let problem = format!("series `{name}` has a point at ({x}, {y})");
                return Err(PlotError::new(&self.title, problem));
            }
        }
        Ok(())
    }

    /// The chart as SVG.
    ///
    /// # Errors
    /// A point that is not finite.
    pub fn svg(&self) -> Result<String, PlotError> {
        self.check()?;
        let place = |&(x, y): &(f64, f64)| (self.x.place(x), self.y.place(y));
        let points = || self.series.iter().flat_map(|s| s.points.iter().map(place));
        let x = self.x.fit(points().map(|p| p.0));
        let y = self.y.fit(points().map(|p| p.1));
        let (x, y) = (self.x.ticked(x).thinned(PLOT_PX.0), self.y.ticked(y));
        let names: Vec<&str> = self.series.iter().map(|s| s.style.name.as_str()).collect();
        let names = theme::distinct(&names, 34);
        let styled = || self.series.iter().zip(&names).enumerate();
        let is_named = |(_, (s, _)): &(usize, (&LineSeries, &String)), mark| {
            s.mark == mark && !s.style.name.is_empty() && !s.points.is_empty()
        };
        let lines: Vec<_> = styled().filter(|s| is_named(s, Mark::Line)).collect();
        let names_px = lines
            .iter()
            .map(|(_, (_, name))| theme::text_width_px(name, theme::LABEL_PX))
            .fold(0.0, f64::max);
        let legend = styled().filter(|s| is_named(s, Mark::Dots));
        let legend = legend.map(|(index, (s, name))| LegendEntry {
            name,
            color: s.style.color,
            symbol: Symbol::Point(Shape::nth(index), true),
        });
        let beside_names = LEADER_PX + SAMPLE_PX + 16;
        let right = if lines.is_empty() { 24 } else { beside_names };
        // More names than the axes are high need a higher chart.
        let height = PLOT_PX.1.max(LABEL_GAP_PX * lines.len() as f64);
        let frame = Frame {
            title: &self.title,
            value_label: &self.y.label,
            legend: legend.collect(),
            plot_px: (PLOT_PX.0, height),
            around_px: [
                72,
                right as u32 + names_px.ceil() as u32,
                AXIS_PX,
                58.max(y.widest_px() as u32 + 16),
            ],
        };
        frame.draw(|root, mut builder, marks| {
            let mut chart = builder.build_cartesian_2d(x.clone(), y.clone())?;
            draw_axes(&mut chart, &self.x.label, [&x, &y])?;
            let at_px = |point: &(f64, f64)| chart.backend_coord(&place(point));
            for (index, (series, name)) in styled() {
                #[rustfmt::skip]
                let LineSeries { style, points, mark } = series;
                let shape = Shape::nth(index);
                let title = |(x, y): (f64, f64)| title(name, x, y);
                if *mark == Mark::Line {
                    let line: Vec<(i32, i32)> = points.iter().map(at_px).collect();
                    // A wider first line stays visible under others.
                    let is_under_others = index == 0 && lines.len() > 1;
                    let width = if is_under_others { 2.5 } else { 1.5 };
                    marks.line(&line, style.color, (width, dash(index)));
                }
                // Lines without names are references. Symbols of merged lines alternate.
                let every = match mark {
                    Mark::Line if name.is_empty() => continue,
                    Mark::Line => points.len().div_ceil(MOST_SYMBOLS),
                    Mark::Dots => 1,
                };
                for (number, point) in points.iter().enumerate() {
                    if number % every == index % every {
                        let filled = *mark == Mark::Dots;
                        marks.symbol(shape, at_px(point), (style.color, filled), &title(*point));
                    }
                }
            }
            let (across, down) = chart.plotting_area().get_pixel_range();
            let last = |s: &LineSeries| s.points.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0));
            let ends: Vec<f64> = lines
                .iter()
                .filter_map(|(_, (s, _))| Some(f64::from(at_px(&last(s)?).1)))
                .collect();
            let (top, bottom) = (f64::from(down.start), f64::from(down.end));
            let placed = theme::spread(&ends, LABEL_GAP_PX, top, bottom);
            for ((&(index, (series, name)), end), y) in lines.iter().zip(ends).zip(placed) {
                let (edge, y) = (across.end + 2, y.round() as i32);
                let end = (end as i32).clamp(down.start, down.end);
                marks.leader(&[(edge, end), (edge + LEADER_PX, y)]);
                let (from, to) = (edge + LEADER_PX, edge + LEADER_PX + SAMPLE_PX);
                let color = series.style.color;
                marks.line(&[(from, y), (to, y)], color, (1.5, dash(index)));
                let middle = (i32::midpoint(from, to), y);
                marks.symbol(Shape::nth(index), middle, (color, false), "");
                let style = text_style(theme::LABEL_PX, theme::INK, HPos::Left);
                root.draw_text(name, &style, (to + 5, y))?;
            }
            Ok(())
        })
    }
}

/// What a point shows when the pointer is over it.
fn title(name: &str, x: f64, y: f64) -> String {
    let separator = if name.is_empty() { "" } else { ": " };
    format!("{name}{separator}{} at {}", exact(y), exact(x))
}

/// A figure with enough digits to tell neighbours apart.
pub(super) fn exact(value: f64) -> String {
    let decimals = match value.abs() {
        _ if value.fract() == 0.0 => 0,
        size if size >= 1000.0 => 1,
        size if size >= 1.0 => 3,
        _ => 5,
    };
    theme::group_thousands(&format!("{value:.decimals$}"))
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

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config::with_cases(200))]
        #[test]
        fn texts_do_not_overlap_and_leaders_stay_outside_the_axes(
            names in proptest::collection::vec("[a-z]{0,3}|[a-zA-Z ]{20,60}|same", 1..20),
            count in 1_usize..30,
            kind in 0..6,
            seed in 0_u32..1000,
            log in 0..3,
        ) {
            let value = |series: usize, point: usize| {
                let noise = f64::from((seed + 31 * series as u32 + 17 * point as u32) * 7919 % 1009) / 1009.0;
                match kind {
                    0 => 0.0,
                    1 => 42.0,
                    2 => -100.0 * noise,
                    3 => 10_f64.powf(24.0 * noise - 12.0),
                    4 => 123_456.0 + 1e-3 * noise,
                    _ => noise,
                }
            };
            let series = names.iter().enumerate().map(|(s, name)| LineSeries {
                style: SeriesStyle::nth(name, s),
                points: (0..count).map(|p| ((p + 1) as f64 * 64.0, value(s, p))).collect(),
                mark: Mark::Line,
            });
            let series: Vec<LineSeries> = series.collect();
            let all = || series.iter().flat_map(|s| s.points.iter().map(|p| p.1));
            let y = match log {
                1 if all().all(|v| v > 0.0) => Axis::doublings("misses, %", Doublings::Numbers),
                2 => Axis::from_zero("misses, %", all()),
                _ => Axis::linear("misses, %"),
            };
            let x = if seed % 2 == 0 { Axis::doublings("size", Doublings::Bytes) } else { Axis::linear("frame") };
            let svg = LineChart { title: "T".into(), x, y, series }.svg().unwrap();
            super::super::testing::check_geometry(&svg)?;
        }
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
