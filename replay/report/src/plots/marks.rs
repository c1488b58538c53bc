//! Marks that carry their exact figures: SVG elements with a `<title>`, which browsers show on hover and
//! the page's script reads out. They are drawn above what plotters draws.

use super::escape;
use crate::theme;
use plotters::prelude::RGBColor;
use std::fmt::Write as _;

/// Symbols of points, in the order of series.
const SHAPES: [Shape; 8] = [
    Shape::Circle,
    Shape::Square,
    Shape::Triangle,
    Shape::Diamond,
    Shape::Cross,
    Shape::Down,
    Shape::Plus,
    Shape::Bar,
];

/// Dash patterns of lines, in the order of series. Five patterns and eight symbols make forty pairs.
const DASHES: [&str; 5] = ["", "7 3", "2 3", "9 3 2 3", "14 4"];

/// A symbol of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
    Down,
    Plus,
    Bar,
}

impl Shape {
    /// The symbol of a series.
    pub fn nth(index: usize) -> Self {
        SHAPES[index % SHAPES.len()]
    }

    /// Outline around a point, px.
    fn path(self, (x, y): (i32, i32)) -> String {
        match self {
            Self::Circle => format!("M{} {y}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z", x - 4),
            Self::Square => format!("M{} {}h7v7h-7z", x - 3, y - 3),
            Self::Triangle => format!("M{x} {}l4 8h-8z", y - 5),
            Self::Down => format!("M{x} {}l4 -8h-8z", y + 5),
            Self::Diamond => format!("M{x} {}l5 5l-5 5l-5 -5z", y - 5),
            Self::Cross => format!("M{} {}l8 8m0 -8l-8 8", x - 4, y - 4),
            Self::Plus => format!("M{} {y}h10m-5 -5v10", x - 5),
            Self::Bar => format!("M{x} {}v10", y - 5),
        }
    }

    fn is_open(self) -> bool {
        matches!(self, Self::Cross | Self::Plus | Self::Bar)
    }
}

/// The dash pattern of a series.
pub(super) fn dash(index: usize) -> &'static str {
    DASHES[index % DASHES.len()]
}

/// Elements to add to a chart.
#[derive(Debug, Default)]
pub(super) struct Marks(String);

fn hex(color: RGBColor) -> String {
    let RGBColor(r, g, b) = color;
    format!("#{r:02X}{g:02X}{b:02X}")
}

impl Marks {
    fn close(&mut self, element: &str, title: &str) {
        let _ = match title {
            "" => writeln!(self.0, "/>"),
            title => writeln!(self.0, "><title>{}</title></{element}>", escape(title)),
        };
    }

    /// A filled rectangle between two corners.
    pub fn rect(&mut self, corners: [(i32, i32); 2], color: RGBColor, title: &str) {
        let [(x0, y0), (x1, y1)] = corners;
        let _ = write!(
            self.0,
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"",
            x0.min(x1),
            y0.min(y1),
            (x1 - x0).abs(),
            (y1 - y0).abs(),
            hex(color)
        );
        self.close("rect", title);
    }

    /// A straight or broken line; `dash` is empty for a solid one.
    pub fn line(&mut self, points: &[(i32, i32)], color: RGBColor, (width, dash): (f64, &str)) {
        let points: Vec<String> = points.iter().map(|(x, y)| format!("{x},{y}")).collect();
        let _ = write!(
            self.0,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\"",
            points.join(" "),
            hex(color)
        );
        if !dash.is_empty() {
            let _ = write!(self.0, " stroke-dasharray=\"{dash}\"");
        }
        self.close("polyline", "");
    }

    /// A grey dotted line from a mark to its label.
    pub fn leader(&mut self, points: &[(i32, i32)]) {
        let points: Vec<String> = points.iter().map(|(x, y)| format!("{x},{y}")).collect();
        let _ = writeln!(
            self.0,
            "<polyline class=\"leader\" points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-dasharray=\"1 2\"/>",
            points.join(" "),
            hex(theme::AXIS)
        );
    }

    /// A symbol at a point, filled or hollow.
    pub fn symbol(
        &mut self,
        shape: Shape,
        at: (i32, i32),
        (color, filled): (RGBColor, bool),
        title: &str,
    ) {
        let fill = match (filled, shape.is_open()) {
            (_, true) => "none".to_owned(),
            (true, false) => hex(color),
            (false, false) => hex(theme::PAPER),
        };
        let _ = write!(
            self.0,
            "<path d=\"{}\" fill=\"{fill}\" stroke=\"{}\" stroke-width=\"1.5\"",
            shape.path(at),
            hex(color)
        );
        self.close("path", title);
    }

    /// The chart with its marks. They come after the grid and before the texts that are drawn over it.
    pub fn onto(self, mut svg: String) -> String {
        let after_grid = svg.rfind(&format!("stroke=\"{}\"", hex(theme::GRID)));
        let after_grid = after_grid.and_then(|at| Some(at + svg[at..].find("/>")? + 2));
        let at = after_grid
            .or_else(|| svg.find("<text"))
            .or_else(|| svg.rfind("</svg>"));
        let at = at.unwrap_or(svg.len());
        svg.insert_str(at, &self.0);
        svg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forty_series_differ_in_symbol_or_dash() {
        let pair = |index| (format!("{:?}", Shape::nth(index)), dash(index));
        for index in 0..40 {
            for other in 0..index {
                assert_ne!(pair(index), pair(other), "{other} {index}");
            }
        }
    }

    #[test]
    fn a_mark_has_its_figure_as_a_title() {
        let mut marks = Marks::default();
        marks.rect([(1, 9), (5, 2)], theme::INK, "a < b: 3 %");
        let svg = "<svg><text>tick</text><line stroke=\"#DDE1E6\"/><text>t</text></svg>";
        let svg = marks.onto(svg.to_owned());
        assert!(
            svg.contains("x=\"1\" y=\"2\" width=\"4\" height=\"7\""),
            "{svg}"
        );
        assert!(svg.contains("<title>a &lt; b: 3 %</title></rect>"), "{svg}");
        let place = |part: &str| svg.find(part).expect("the part is drawn");
        assert!(
            place("<line") < place("<rect") && place("<rect") < place(">t<"),
            "{svg}"
        );
    }
}
