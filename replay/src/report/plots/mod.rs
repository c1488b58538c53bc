//! Charts as SVG text by plotters: a pure function of the numbers, byte for byte.

pub mod bars;
pub mod contours;
pub mod data_uri;
pub mod hbars;
pub mod heatmap;
pub mod lines;
pub mod paths;

use super::theme;
use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::drawing::DrawingArea;
use plotters::prelude::{
    Circle, Color, IntoDrawingArea, IntoFont, IntoTextStyle, PathElement, RGBColor, Rectangle,
    ShapeStyle,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// The drawing area of a chart in pixels.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A chart could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("plot `{title}`: {problem}")]
pub struct PlotError {
    /// The chart's title.
    pub title: String,
    /// What plotters or the data said.
    pub problem: String,
}

/// Where text stands relative to its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The point is the left end.
    Start,
    /// The point is the middle.
    Middle,
    /// The point is the right end.
    End,
}

/// A named, coloured series.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesStyle {
    /// Name as printed.
    pub name: String,
    /// Colour.
    pub color: RGBColor,
}

impl SeriesStyle {
    /// A series with the `index`-th colour of the theme.
    pub fn nth(name: impl Into<String>, index: usize) -> Self {
        Self {
            name: name.into(),
            color: theme::SERIES[index % theme::SERIES.len()],
        }
    }
}

/// Draws on a fresh SVG of the given size in pixels and returns its text.
///
/// The alternative text (for screen readers) is the title.
pub fn draw(
    title: &str,
    size_px: (u32, u32),
    paint: impl FnOnce(&Area) -> Result<(), String>,
) -> Result<String, PlotError> {
    let fail = |problem: String| PlotError {
        title: title.to_owned(),
        problem,
    };
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size_px).into_drawing_area();
        paint(&root).map_err(fail)?;
        root.present().map_err(|e| fail(e.to_string()))?;
    }
    let label = format!("<svg role=\"img\" aria-label=\"{}\" ", escape(title));
    Ok(svg.replacen("<svg ", &label, 1))
}

/// Escapes text for an XML attribute or body.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Writes one line of text, vertically centred on `y`.
pub fn text(
    area: &Area,
    (x, y): (f64, f64),
    content: &str,
    size_px: u32,
    color: RGBColor,
    anchor: Anchor,
) -> Result<(), String> {
    let h = match anchor {
        Anchor::Start => HPos::Left,
        Anchor::Middle => HPos::Center,
        Anchor::End => HPos::Right,
    };
    // The SVG backend divides by 1.24 to turn plotters' line height into a font size.
    let style = (theme::FONT, f64::from(size_px) * 1.24)
        .into_font()
        .color(&color)
        .into_text_style(area)
        .pos(Pos::new(h, VPos::Center));
    area.draw_text(content, &style, pixel(x, y))
        .map_err(|e| e.to_string())
}

/// Draws a polyline.
pub fn stroke(
    area: &Area,
    points: &[(f64, f64)],
    color: RGBColor,
    width_px: u32,
) -> Result<(), String> {
    let points: Vec<(i32, i32)> = points.iter().map(|&(x, y)| pixel(x, y)).collect();
    area.draw(&PathElement::new(points, color.stroke_width(width_px)))
        .map_err(|e| e.to_string())
}

/// Fills a rectangle given by two corners.
pub fn fill(area: &Area, a: (f64, f64), b: (f64, f64), color: RGBColor) -> Result<(), String> {
    area.draw(&Rectangle::new(
        [pixel(a.0, a.1), pixel(b.0, b.1)],
        color.filled(),
    ))
    .map_err(|e| e.to_string())
}

fn pixel(x: f64, y: f64) -> (i32, i32) {
    (x.round() as i32, y.round() as i32)
}

/// A linear or logarithmic map from values to pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    low: f64,
    high: f64,
    from_px: f64,
    to_px: f64,
    log: bool,
}

impl Scale {
    /// Maps `low..high` linearly on `from_px..to_px`.
    #[must_use]
    pub fn linear(low: f64, high: f64, from_px: f64, to_px: f64) -> Self {
        let high = if high > low { high } else { low + 1.0 };
        Self {
            low,
            high,
            from_px,
            to_px,
            log: false,
        }
    }

    /// Maps `low..high` (both above 0) logarithmically.
    #[must_use]
    pub fn log(low: f64, high: f64, from_px: f64, to_px: f64) -> Self {
        let low = low.max(f64::MIN_POSITIVE);
        let high = if high > low { high } else { low * 2.0 };
        Self {
            low,
            high,
            from_px,
            to_px,
            log: true,
        }
    }

    /// The pixel of a value; values outside run past the ends.
    #[must_use]
    pub fn at(&self, value: f64) -> f64 {
        let t = if self.log {
            (value.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.from_px + t * (self.to_px - self.from_px)
    }
}

/// Draws horizontal grid lines with tick labels left of them. Returns nothing but errors.
pub(crate) fn horizontal_grid(
    area: &Area,
    scale: &Scale,
    at: &[(f64, String)],
    (left, right): (f64, f64),
    zero_line: Option<f64>,
) -> Result<(), String> {
    for (value, label) in at {
        let y = scale.at(*value);
        let color = if zero_line == Some(*value) {
            theme::AXIS
        } else {
            theme::GRID
        };
        stroke(area, &[(left, y), (right, y)], color, 1)?;
        text(
            area,
            (left - 6.0, y),
            label,
            theme::TICK_PX,
            theme::MUTED,
            Anchor::End,
        )?;
    }
    Ok(())
}

/// Writes title and, below it, the value axis' label with its unit, both flush left.
pub(crate) fn heading(area: &Area, title: &str, value_label: &str) -> Result<(), String> {
    text(
        area,
        (8.0, 14.0),
        title,
        theme::TITLE_PX,
        theme::INK,
        Anchor::Start,
    )?;
    text(
        area,
        (8.0, 33.0),
        value_label,
        theme::LABEL_PX,
        theme::MUTED,
        Anchor::Start,
    )
}

/// One name in a row under a heading.
pub(crate) struct LegendEntry<'a> {
    pub name: &'a str,
    pub color: RGBColor,
    pub symbol: Symbol,
}

/// What stands before a name in a legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Symbol {
    Box,
    Stroke,
    Dot,
    Ring,
}

const LEGEND_SYMBOL_PX: f64 = 17.0;
const LEGEND_GAP_PX: f64 = 17.0;

/// Width of a legend row.
pub(crate) fn legend_width_px(entries: &[LegendEntry]) -> f64 {
    entries
        .iter()
        .map(|e| LEGEND_SYMBOL_PX + theme::text_width_px(e.name, theme::LABEL_PX) + LEGEND_GAP_PX)
        .sum()
}

/// Writes names in a row: bars and clouds of points have no end to write a name at.
pub(crate) fn legend(
    area: &Area,
    (x, y): (f64, f64),
    entries: &[LegendEntry],
) -> Result<(), String> {
    let mut x = x;
    for entry in entries {
        let color = entry.color;
        match entry.symbol {
            Symbol::Box => fill(area, (x, y - 5.0), (x + 12.0, y + 5.0), color)?,
            Symbol::Stroke => stroke(area, &[(x, y), (x + 12.0, y)], color, theme::LINE_PX)?,
            Symbol::Dot => dot(area, (x + 6.0, y), color.filled())?,
            Symbol::Ring => dot(area, (x + 6.0, y), color.stroke_width(1))?,
        }
        let at = (x + LEGEND_SYMBOL_PX, y);
        text(
            area,
            at,
            entry.name,
            theme::LABEL_PX,
            theme::INK,
            Anchor::Start,
        )?;
        x += LEGEND_SYMBOL_PX + theme::text_width_px(entry.name, theme::LABEL_PX) + LEGEND_GAP_PX;
    }
    Ok(())
}

/// Draws a point of a scatter chart.
pub(crate) fn dot(area: &Area, (x, y): (f64, f64), style: ShapeStyle) -> Result<(), String> {
    area.draw(&Circle::new(pixel(x, y), 4, style))
        .map_err(|e| e.to_string())
}

/// Breaks a label at spaces, hyphens or slashes into lines no wider than `width_px`.
#[must_use]
pub fn wrap(label: &str, width_px: f64, size_px: u32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    for word in label.split_inclusive([' ', '-', '/']) {
        let longer = format!("{line}{word}");
        if !line.is_empty() && theme::text_width_px(longer.trim_end(), size_px) > width_px {
            lines.push(line.trim_end().to_owned());
            line = word.to_owned();
        } else {
            line = longer;
        }
    }
    lines.push(line.trim_end().to_owned());
    lines
}
