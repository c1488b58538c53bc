//! The frame of every chart: heading, legend, axes and grid in the theme's style.

use super::marks::{Marks, Shape};
use super::{PlotError, SeriesStyle, escape};
use crate::theme;
use plotters::chart::{ChartBuilder, MeshStyle};
use plotters::coord::Shift;
use plotters::coord::ranged1d::Ranged;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind};
use plotters::prelude::{
    DrawingBackend, IntoDrawingArea, IntoFont, RGBColor, SVGBackend, TextStyle,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;

/// The drawing area of a chart in pixels.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Result of drawing.
pub(super) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// Radius of a point of a scatter chart, px.
pub(super) const DOT_PX: i32 = 4;
/// Room for tick labels and an axis name below a plotting area, px.
pub(super) const AXIS_PX: u32 = 44;
pub(super) const MOST_TICKS: usize = 7;
/// Height of a row of legend entries after the first, px.
const LEGEND_ROW_PX: f64 = 18.0;
/// A legend of several rows is at least this wide, px.
const LEGEND_WIDTH_PX: f64 = 480.0;
const LEGEND_SYMBOL_PX: f64 = 17.0;
const LEGEND_GAP_PX: f64 = 17.0;

/// A chart without its data.
pub(super) struct Frame<'a> {
    pub title: &'a str,
    /// Name and unit of the values, below the title.
    pub value_label: &'a str,
    /// Names in rows below the heading, for bars and point clouds, which have no line end to label.
    pub legend: Vec<LegendEntry<'a>>,
    /// Width and height of the plotting area.
    pub plot_px: (f64, f64),
    /// Space above (with a legend of one row), right of, below and left of the plotting area.
    pub around_px: [u32; 4],
}

/// One entry of a legend.
pub(super) struct LegendEntry<'a> {
    pub name: &'a str,
    pub color: RGBColor,
    pub symbol: Symbol,
}

/// Symbol of a legend entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Symbol {
    Box,
    Stroke,
    /// A symbol of points, filled or hollow.
    Point(Shape, bool),
}

impl<'a> LegendEntry<'a> {
    /// A filled box in the colour of a series.
    pub(super) fn filled(series: &'a SeriesStyle) -> Self {
        Self {
            name: &series.name,
            color: series.color,
            symbol: Symbol::Box,
        }
    }

    fn width_px(&self) -> f64 {
        LEGEND_SYMBOL_PX + theme::text_width_px(self.name, theme::LABEL_PX) + LEGEND_GAP_PX
    }
}

impl Frame<'_> {
    /// Draws the frame on a new SVG, then calls `paint` with the whole picture and the plotting area.
    /// Returns the SVG's text, with the title as alternative text for screen readers.
    pub(super) fn draw(
        &self,
        paint: impl FnOnce(&Area, ChartBuilder<SVGBackend>, &mut Marks) -> Drawn,
    ) -> Result<String, PlotError> {
        let [top, right, below, left] = self.around_px;
        let plain_width = f64::from(left + right) + self.plot_px.0;
        let room = (plain_width - f64::from(left)).max(LEGEND_WIDTH_PX);
        let legend = self.legend_places(room);
        let (legend_px, rows) = legend
            .iter()
            .zip(&self.legend)
            .fold((0.0, 0), |most, (at, entry)| {
                (f64::max(most.0, at.0 + entry.width_px()), most.1.max(at.1))
            });
        let top = top + (LEGEND_ROW_PX * f64::from(rows)) as u32;
        let width = plain_width
            .max(f64::from(left) + legend_px)
            .max(theme::text_width_px(self.title, theme::TITLE_PX) + 16.0)
            .max(theme::text_width_px(self.value_label, theme::LABEL_PX) + 16.0)
            .ceil() as u32;
        let height = top + self.plot_px.1.ceil() as u32 + below;
        let (mut svg, mut marks) = (String::new(), Marks::default());
        {
            let root = SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area();
            let mut chart = ChartBuilder::on(&root);
            chart
                .margin_top(top)
                .margin_right(f64::from(width - left) - self.plot_px.0)
                .x_label_area_size(below)
                .y_label_area_size(left);
            // Marks come before the first text, so the heading is drawn after the grid.
            paint(&root, chart, &mut marks)
                .and_then(|()| self.heading(&root, &legend, &mut marks))
                .and_then(|()| root.present())
                .map_err(|e| PlotError::new(self.title, e.to_string()))?;
        }
        // The font is the same for all texts, and opacity 1 is the default.
        let family = format!("font-family=\"{}\" ", theme::FONT);
        svg = svg.replace(&family, "").replace(" opacity=\"1\"", "");
        let label = format!(
            "<svg role=\"img\" aria-label=\"{}\" {family}",
            escape(self.title)
        );
        Ok(marks.onto(svg.replacen("<svg ", &label, 1)))
    }

    /// Distance of each legend entry from the left, and its row, in rows of at most `room` pixels.
    fn legend_places(&self, room: f64) -> Vec<(f64, u32)> {
        let (mut left, mut row) = (0.0, 0);
        let place = |entry: &LegendEntry| {
            if left > 0.0 && left + entry.width_px() > room {
                (left, row) = (0.0, row + 1);
            }
            let at = (left, row);
            left += entry.width_px();
            at
        };
        self.legend.iter().map(place).collect()
    }

    fn heading(&self, root: &Area, legend: &[(f64, u32)], marks: &mut Marks) -> Drawn {
        let title = text_style(theme::TITLE_PX, theme::INK, HPos::Left);
        root.draw_text(self.title, &title, (8, 14))?;
        let value_label = text_style(theme::LABEL_PX, theme::MUTED, HPos::Left);
        root.draw_text(self.value_label, &value_label, (8, 33))?;
        for (entry, (left, row)) in self.legend.iter().zip(legend) {
            let x = (f64::from(self.around_px[3]) + left) as i32;
            let y = 54 + (LEGEND_ROW_PX * f64::from(*row)) as i32;
            match entry.symbol {
                Symbol::Box => marks.rect([(x, y - 5), (x + 12, y + 5)], entry.color, ""),
                Symbol::Stroke => {
                    let width = f64::from(theme::LINE_PX);
                    marks.line(&[(x, y), (x + 12, y)], entry.color, (width, ""));
                }
                Symbol::Point(shape, filled) => {
                    marks.symbol(shape, (x + 6, y), (entry.color, filled), "");
                }
            }
            let name = text_style(theme::LABEL_PX, theme::INK, HPos::Left);
            root.draw_text(entry.name, &name, (x + LEGEND_SYMBOL_PX as i32, y))?;
        }
        Ok(())
    }
}

/// Text that is vertically centred on its point.
pub(super) fn text_style(size_px: u32, color: RGBColor, anchor: HPos) -> TextStyle<'static> {
    // The SVG backend divides by 1.24 to turn plotters' line height into a font size.
    (theme::FONT, f64::from(size_px) * 1.24)
        .into_font()
        .color(&color)
        .pos(Pos::new(anchor, VPos::Center))
}

/// Applies the theme to axes and grid.
pub(super) fn themed<'m, 'a, 'b, X: Ranged, Y: Ranged, DB: DrawingBackend>(
    mesh: &'m mut MeshStyle<'a, 'b, X, Y, DB>,
) -> &'m mut MeshStyle<'a, 'b, X, Y, DB> {
    mesh.max_light_lines(0)
        .bold_line_style(theme::GRID)
        .axis_style(theme::AXIS)
        .set_all_tick_mark_size(4)
        .x_labels(MOST_TICKS)
        .y_labels(MOST_TICKS)
        .label_style(text_style(theme::TICK_PX, theme::MUTED, HPos::Center))
        .axis_desc_style(text_style(theme::LABEL_PX, theme::MUTED, HPos::Center))
}

/// Formats ticks over `range` with as many decimals as their step needs.
pub(super) fn tick_format(range: &Range<f64>) -> impl Fn(&f64) -> String + use<> {
    let ticks = linear_ticks(range, MOST_TICKS);
    let step = match ticks[..] {
        [first, second, ..] => second - first,
        _ => 1.0,
    };
    let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    // Numbers of many digits would touch each other.
    let long = decimals > 5 || ticks.iter().any(|tick| tick.abs() >= 1e6);
    // Adding zero removes the sign of negative zero.
    move |value| {
        let tick = (value / step).round() * step + 0.0;
        if long {
            let digits = (tick.abs() / step).max(1.0).log10().ceil() as usize;
            let text = format!("{tick:.digits$e}", digits = digits.min(12));
            return match text.split_once('e') {
                Some((mantissa, _)) if tick == 0.0 || mantissa.is_empty() => "0".to_owned(),
                Some((mantissa, power)) if mantissa.contains('.') => {
                    let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
                    format!("{mantissa}e{power}")
                }
                _ => text,
            };
        }
        theme::group_thousands(&format!("{tick:.decimals$}"))
    }
}

/// Round numbers in `range`, at most `most`.
pub(super) fn linear_ticks(range: &Range<f64>, most: usize) -> Vec<f64> {
    RangedCoordf64::from(range.clone()).key_points(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_the_decimals_of_their_step() {
        assert_eq!(tick_format(&(0.0..0.45))(&0.2), "0.2");
        assert_eq!(tick_format(&(0.0..0.1))(&0.04), "0.04");
        assert_eq!(tick_format(&(-3.0..3.0))(&-1e-17), "0");
        assert_eq!(tick_format(&(0.0..50_000.0))(&20_000.0), "20\u{2009}000");
        assert_eq!(tick_format(&(0.0..4e9))(&2e9), "2e9");
    }
}
