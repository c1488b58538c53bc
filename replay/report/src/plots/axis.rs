//! Axes: linear, in doublings, or logarithmic with a place for zero; their ends and their ticks.

use super::frame::{MOST_TICKS, linear_ticks, themed, tick_format};
use crate::theme;
use plotters::chart::ChartContext;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::DrawingBackend;
use sim::size::format_bytes;
use std::ops::Range;

/// Unit of an axis of doublings, for its ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doublings {
    /// Sizes, with binary units.
    Bytes,
    /// Numbers.
    Numbers,
}

/// How values are placed along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Scale {
    #[default]
    Linear,
    Doublings(Doublings),
    /// Powers of ten from the first to the last; zero and smaller values have a place of their own below.
    Decades([i32; 2]),
}

/// Distance of the place of zero below the first decade, in decades.
const ZERO_BELOW: f64 = 0.6;
/// The same as a share of a long axis, so that the ticks do not touch.
const ZERO_BELOW_SHARE: f64 = 0.08;

/// The place of zero on an axis of these decades.
fn zero_place([first, last]: [i32; 2]) -> f64 {
    f64::from(first) - (ZERO_BELOW_SHARE * f64::from(last - first)).max(ZERO_BELOW)
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// Ends of the axis; `None` takes them from the data.
    range: Option<(f64, f64)>,
    scale: Scale,
}

impl Axis {
    /// A linear axis that fits its data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            ..Self::default()
        }
    }

    /// The same axis from `low` to `high`.
    #[must_use]
    pub fn between(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// An axis of doublings, for positive values.
    pub fn doublings(label: impl Into<String>, of: Doublings) -> Self {
        Self {
            label: label.into(),
            scale: Scale::Doublings(of),
            ..Self::default()
        }
    }

    /// An axis for values from zero on. It is logarithmic, with a place for zero, if a linear one would
    /// draw some positive values as zero.
    pub fn from_zero(label: impl Into<String>, values: impl Iterator<Item = f64>) -> Self {
        let label = label.into();
        let positive = values.filter(|v| *v > 0.0 && v.is_finite());
        let ends = positive.fold(None, |ends: Option<(f64, f64)>, v| {
            Some(ends.map_or((v, v), |(low, high)| (low.min(v), high.max(v))))
        });
        match ends {
            Some((low, high)) if low < high / 20.0 => Self {
                label: format!("{label}; logarithmic above 0"),
                scale: Scale::Decades([low, high].map(|end| end.log10().floor() as i32)),
                ..Self::default()
            },
            _ => Self::linear(label),
        }
    }

    /// The coordinate of a value on the axis.
    pub(super) fn place(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Doublings(_) => value.log2(),
            Scale::Linear => value,
            Scale::Decades(ends) if value <= 0.0 => zero_place(ends),
            Scale::Decades(_) => value.log10(),
        }
    }

    /// The ends of the axis for these coordinates.
    pub(super) fn fit(&self, places: impl Iterator<Item = f64>) -> Range<f64> {
        if let Some((low, high)) = self.range {
            return low..high;
        }
        let (low, high) = ends(places).unwrap_or((0.0, 1.0));
        // Points keep a distance from the edges; an axis that comes near zero starts at zero.
        let room = match 0.04 * (high - low) {
            room if room > 1e-9 * high.abs() => room,
            _ => (0.04 * high.abs()).max(if high == 0.0 { 0.5 } else { 0.0 }),
        };
        let from_zero = self.scale == Scale::Linear && low >= 0.0 && low < 0.35 * high;
        (if from_zero { 0.0 } else { low - room })..high + room
    }

    /// The axis with ticks, for these coordinates.
    pub(super) fn ticked(&self, range: Range<f64>) -> Ticked {
        Ticked {
            ticks: self.ticks(&range),
            range: range.into(),
        }
    }

    /// Coordinates of ticks inside `range`, with their texts.
    fn ticks(&self, range: &Range<f64>) -> Vec<(f64, String)> {
        match self.scale {
            Scale::Linear => {
                let write = tick_format(range);
                let ticks = linear_ticks(range, MOST_TICKS).into_iter();
                ticks.map(|tick| (tick, write(&tick))).collect()
            }
            Scale::Doublings(Doublings::Numbers) if range.end - range.start < 3.0 => {
                // Round numbers, because few doublings are in the range.
                let first = (range.start * 2_f64.log10()).floor() as i32;
                let steps = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0];
                let round = (first..first + 3)
                    .flat_map(|power| steps.map(|step| step * 10_f64.powi(power)));
                let ticks: Vec<f64> = round.map(f64::log2).filter(|t| range.contains(t)).collect();
                // A narrow range may hold none of them.
                let ticks = if ticks.len() < 2 {
                    linear_ticks(range, MOST_TICKS)
                } else {
                    ticks
                };
                ticks
                    .into_iter()
                    .map(|tick| (tick, short(tick.exp2())))
                    .collect()
            }
            Scale::Doublings(of) => {
                let whole = whole_numbers(range, MOST_TICKS + 2).into_iter();
                let text = |power: i32| match of {
                    Doublings::Bytes if (0..63).contains(&power) => format_bytes(1 << power),
                    Doublings::Bytes => format!("2^{power} B"),
                    Doublings::Numbers if (0..17).contains(&power) => {
                        theme::group_thousands(&(1_u64 << power).to_string())
                    }
                    Doublings::Numbers if (-6..0).contains(&power) => {
                        f64::from(power).exp2().to_string()
                    }
                    Doublings::Numbers => format!("2^{power}"),
                };
                whole.map(|power| (f64::from(power), text(power))).collect()
            }
            Scale::Decades([first, last]) => {
                let zero = zero_place([first, last]);
                let zero = range.contains(&zero).then(|| (zero, "0".to_owned()));
                let above = f64::from(first).max(range.start)..range.end;
                let decades = whole_numbers(&above, MOST_TICKS).into_iter();
                let text = |power: i32| match power {
                    -4..=4 => short(10_f64.powi(power)),
                    _ => format!("1e{power}"),
                };
                let decades = decades.map(|power| (f64::from(power), text(power)));
                zero.into_iter().chain(decades).collect()
            }
        }
    }
}

/// Draws two axes with their ticks, and the horizontal grid.
pub(super) fn draw_axes<DB: DrawingBackend>(
    chart: &mut ChartContext<'_, DB, Cartesian2d<Ticked, Ticked>>,
    x_label: &str,
    [x, y]: [&Ticked; 2],
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    themed(&mut chart.configure_mesh())
        .disable_x_mesh()
        .x_desc(x_label)
        .x_label_formatter(&|at| x.text(*at))
        .y_label_formatter(&|at| y.text(*at))
        .draw()
}

/// An axis with fixed ticks.
#[derive(Clone)]
pub(super) struct Ticked {
    range: RangedCoordf64,
    ticks: Vec<(f64, String)>,
}

impl Ticked {
    /// The text of a tick.
    pub fn text(&self, at: f64) -> String {
        let found = self.ticks.iter().find(|(tick, _)| *tick == at);
        found.map_or_else(String::new, |(_, text)| text.clone())
    }

    /// Width of the widest text, px.
    pub fn widest_px(&self) -> f64 {
        let texts: Vec<&str> = self.ticks.iter().map(|(_, text)| text.as_str()).collect();
        theme::widest_px(&texts, theme::TICK_PX)
    }

    /// Every n-th tick, so that their texts do not touch on an axis of this width.
    pub fn thinned(mut self, room_px: f64) -> Self {
        let most = ((room_px / (self.widest_px() + 10.0)) as usize).max(1);
        let every = self.ticks.len().div_ceil(most).max(1);
        self.ticks = self.ticks.into_iter().step_by(every).collect();
        self
    }
}

impl Ranged for Ticked {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.range.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.iter().map(|(tick, _)| *tick).collect()
    }

    fn range(&self) -> Range<f64> {
        self.range.range()
    }
}

/// The least and the greatest value.
pub(crate) fn ends(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .map(|v| (v, v))
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Ticks of a few digits.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-4..1e6).contains(&value.abs()) {
        let decimals = (2 - value.abs().max(1e-9).log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.decimals$}");
        let text = match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.'),
            false => &text,
        };
        return theme::group_thousands(text);
    }
    format!("{value:.1e}")
}

/// Whole numbers in a range, at most `most`, evenly apart.
fn whole_numbers(range: &Range<f64>, most: usize) -> Vec<i32> {
    let (first, last) = (range.start.ceil() as i32, range.end.floor() as i32);
    let step = (last - first + 1).max(1) as usize;
    let step = step.div_ceil(most) as i32;
    (first..=last).filter(|n| n.rem_euclid(step) == 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis, range: Range<f64>) -> Vec<String> {
        let ticks = axis.ticks(&range).into_iter();
        ticks.map(|(_, text)| text).collect()
    }

    #[test]
    fn values_including_zero_get_a_logarithmic_axis_with_a_place_for_zero() {
        let values = [0.0, 0.0, 0.0003, 0.002, 0.4];
        let axis = Axis::from_zero("error", values.into_iter());
        assert!(axis.label.contains("logarithmic"));
        let range = axis.fit(values.iter().map(|v| axis.place(*v)));
        assert_eq!(texts(&axis, range), ["0", "0.0001", "0.001", "0.01", "0.1"]);
        assert!(axis.place(0.0) < axis.place(0.0003));
        let even = Axis::from_zero("error", [0.0, 0.2, 0.4].into_iter());
        assert_eq!(even, Axis::linear("error"));
    }

    #[test]
    fn axes_of_doublings_show_units_and_long_ones_show_powers() {
        let axis = Axis::doublings("size", Doublings::Bytes);
        assert_eq!(
            texts(&axis, 9.5..13.0),
            ["1 KiB", "2 KiB", "4 KiB", "8 KiB"]
        );
        let axis = Axis::doublings("misses", Doublings::Numbers);
        assert_eq!(texts(&axis, 17.5..21.5), ["2^18", "2^19", "2^20", "2^21"]);
    }
}
