//! The frame of every chart: heading, legend, axes and grid in the theme's style.

use super::{PlotError, escape};
use crate::report::theme;
use plotters::chart::{ChartBuilder, MeshStyle};
use plotters::coord::Shift;
use plotters::coord::ranged1d::Ranged;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind};
use plotters::prelude::{
    Circle, Color, DrawingBackend, IntoDrawingArea, IntoFont, PathElement, RGBColor, Rectangle,
    SVGBackend, ShapeStyle, TextStyle,
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
const MOST_TICKS: usize = 7;
const LEGEND_SYMBOL_PX: f64 = 17.0;
const LEGEND_GAP_PX: f64 = 17.0;

/// A chart without its data.
pub(super) struct Frame<'a> {
    pub title: &'a str,
    /// Name and unit of the values, below the title.
    pub value_label: &'a str,
    /// Names in a row below the heading, for bars and point clouds, which have no line end to label.
    pub legend: Vec<LegendEntry<'a>>,
    /// Width and height of the plotting area.
    pub plot_px: (f64, f64),
    /// Space above, right of, below and left of the plotting area.
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
    Dot,
    Ring,
}

impl LegendEntry<'_> {
    fn width_px(&self) -> f64 {
        LEGEND_SYMBOL_PX + theme::text_width_px(self.name, theme::LABEL_PX) + LEGEND_GAP_PX
    }
}

impl Frame<'_> {
    /// Draws the frame on a new SVG, then calls `paint` with the whole picture and the plotting area.
    /// Returns the SVG's text, with the title as alternative text for screen readers.
    pub(super) fn draw(
        &self,
        paint: impl FnOnce(&Area, ChartBuilder<SVGBackend>) -> Drawn,
    ) -> Result<String, PlotError> {
        let [top, right, below, left] = self.around_px;
        let legend_px: f64 = self.legend.iter().map(LegendEntry::width_px).sum();
        let width = (f64::from(left + right) + self.plot_px.0)
            .max(f64::from(left) + legend_px)
            .max(theme::text_width_px(self.title, theme::TITLE_PX) + 16.0)
            .max(theme::text_width_px(self.value_label, theme::LABEL_PX) + 16.0)
            .ceil() as u32;
        let height = top + self.plot_px.1.ceil() as u32 + below;
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area();
            let mut chart = ChartBuilder::on(&root);
            chart
                .margin_top(top)
                .margin_right(f64::from(width - left) - self.plot_px.0)
                .x_label_area_size(below)
                .y_label_area_size(left);
            self.heading(&root)
                .and_then(|()| paint(&root, chart))
                .and_then(|()| root.present())
                .map_err(|e| PlotError {
                    title: self.title.to_owned(),
                    problem: e.to_string(),
                })?;
        }
        let label = format!("<svg role=\"img\" aria-label=\"{}\" ", escape(self.title));
        Ok(svg.replacen("<svg ", &label, 1))
    }

    fn heading(&self, root: &Area) -> Drawn {
        let title = text_style(theme::TITLE_PX, theme::INK, HPos::Left);
        root.draw_text(self.title, &title, (8, 14))?;
        let value_label = text_style(theme::LABEL_PX, theme::MUTED, HPos::Left);
        root.draw_text(self.value_label, &value_label, (8, 33))?;
        let (mut left, y) = (f64::from(self.around_px[3]), 54);
        for entry in &self.legend {
            let (x, color) = (left as i32, entry.color);
            let dot = |style: ShapeStyle| root.draw(&Circle::new((x + 6, y), DOT_PX, style));
            match entry.symbol {
                Symbol::Box => {
                    let corners = [(x, y - 5), (x + 12, y + 5)];
                    root.draw(&Rectangle::new(corners, color.filled()))?;
                }
                Symbol::Stroke => {
                    let style = color.stroke_width(theme::LINE_PX);
                    root.draw(&PathElement::new([(x, y), (x + 12, y)], style))?;
                }
                Symbol::Dot => dot(color.filled())?,
                Symbol::Ring => dot(color.stroke_width(1))?,
            }
            let name = text_style(theme::LABEL_PX, theme::INK, HPos::Left);
            root.draw_text(entry.name, &name, (x + LEGEND_SYMBOL_PX as i32, y))?;
            left += entry.width_px();
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
    let ticks = RangedCoordf64::from(range.clone()).key_points(MOST_TICKS);
    let step = match ticks[..] {
        [first, second, ..] => second - first,
        _ => 1.0,
    };
    let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    // Adding zero removes the sign of negative zero.
    move |value| {
        let tick = (value / step).round() * step + 0.0;
        theme::group_thousands(&format!("{tick:.decimals$}"))
    }
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
    }
}
