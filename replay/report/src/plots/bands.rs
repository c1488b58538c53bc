//! Axes of bands, which have a name each: rows with their names at the left, or columns with their names below. The
//! other axis shows values.

use super::frame::{Area, Drawn, Frame, LegendEntry, text_style, themed, tick_format};
use super::marks::Marks;
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::chart::ChartContext;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::combinators::{BindKeyPoints, WithKeyPoints};
use plotters::coord::types::{RangedCoordf64, RangedCoordi32};
use plotters::prelude::SVGBackend;
use plotters::style::text_anchor::HPos;
use std::ops::Range;

/// The axes of rows: values, and pixels from the top, because a number needs the height of a line of text.
pub(super) type RowAxes<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, WithKeyPoints<RangedCoordi32>>>;

/// The axes of columns: column `n` spans `n` to `n + 1`; values.
pub(super) type ColumnAxes<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// RowBands over an axis of values.
pub(super) struct RowBands<'a> {
    pub title: &'a str,
    pub value_label: &'a str,
    pub legend: Vec<LegendEntry<'a>>,
    pub names: Vec<String>,
    pub row_px: i32,
    pub width_px: f64,
    /// Space above (with a legend of one row), right of and below the plotting area.
    pub around_px: [u32; 3],
    /// Name of the axis of values; may be empty.
    pub x_label: &'a str,
    pub values: Range<f64>,
}

impl RowBands<'_> {
    /// Height of all rows.
    pub fn height_px(&self) -> i32 {
        self.row_px * self.names.len().max(1) as i32
    }

    /// Draws the axes, then calls `paint`.
    pub fn draw(
        self,
        paint: impl FnOnce(&Area, &RowAxes, &mut Marks) -> Drawn,
    ) -> Result<String, PlotError> {
        let (height_px, row_px) = (self.height_px(), self.row_px);
        let name_px = theme::widest_px(&self.names, theme::TICK_PX).max(40.0);
        let [above, right, below] = self.around_px;
        let (names, values) = (self.names, self.values);
        let frame = Frame {
            title: self.title,
            value_label: self.value_label,
            legend: self.legend,
            plot_px: (self.width_px, f64::from(height_px)),
            around_px: [above, right, below, name_px as u32 + 16],
        };
        frame.draw(|root, mut builder, marks| {
            let middles = (0..names.len() as i32).map(|row| row_px * row + row_px / 2);
            let rows = (height_px..0).with_key_points(middles.collect());
            let mut axes = builder.build_cartesian_2d(values.clone(), rows)?;
            let ticks = tick_format(&values);
            let name = |y: &i32| {
                names
                    .get((y / row_px) as usize)
                    .cloned()
                    .unwrap_or_default()
            };
            let mut mesh = axes.configure_mesh();
            themed(&mut mesh)
                .disable_y_mesh()
                .y_label_style(text_style(theme::TICK_PX, theme::INK, HPos::Right))
                .x_label_formatter(&ticks)
                .y_label_formatter(&name);
            if !self.x_label.is_empty() {
                mesh.x_desc(self.x_label);
            }
            mesh.draw()?;
            paint(root, &axes, marks)
        })
    }
}

const LEFT_PX: u32 = 58;
const TOP_PX: u32 = 66;
const PLOT_HEIGHT_PX: f64 = 216.0;
const LINE_HEIGHT_PX: i32 = 15;

/// ColumnBands under an axis of values, which begins at zero.
pub(super) struct ColumnBands<'a> {
    pub title: &'a str,
    pub value_label: &'a str,
    pub legend: Vec<LegendEntry<'a>>,
    /// The lines of each column's name.
    pub names: Vec<Vec<String>>,
    /// Size of the names, and the distance of their first line below the axis, px.
    pub name_px: (u32, i32),
    pub width_px: f64,
    /// What the columns are; may be empty.
    pub x_label: &'a str,
    pub highest: f64,
    /// A value to compare with, as a dashed line.
    pub reference: Option<f64>,
}

impl ColumnBands<'_> {
    /// Draws the axes, then calls `paint` with the number of each column.
    pub fn draw(
        self,
        mut paint: impl FnMut(usize, &Area, &ColumnAxes, &mut Marks) -> Drawn,
    ) -> Result<String, PlotError> {
        let name_lines = self.names.iter().map(Vec::len).max().unwrap_or(1) as u32;
        let axis_title_px = if self.x_label.is_empty() { 0 } else { 18 };
        let below_px = 10 + LINE_HEIGHT_PX as u32 * name_lines + axis_title_px;
        let count = self.names.len().max(1) as f64;
        let values = 0.0..self.highest;
        let frame = Frame {
            title: self.title,
            value_label: self.value_label,
            legend: self.legend,
            plot_px: (self.width_px, PLOT_HEIGHT_PX),
            around_px: [TOP_PX, 14, below_px, LEFT_PX],
        };
        frame.draw(|root, mut builder, marks| {
            let mut axes = builder.build_cartesian_2d(0.0..count, values.clone())?;
            themed(&mut axes.configure_mesh())
                .disable_x_mesh()
                .x_labels(0)
                .x_desc(self.x_label)
                .y_label_formatter(&tick_format(&values))
                .draw()?;
            let (size_px, gap_px) = self.name_px;
            let style = text_style(size_px, theme::INK, HPos::Center);
            for (column, lines) in self.names.iter().enumerate() {
                paint(column, root, &axes, marks)?;
                let (x, y) = axes.backend_coord(&(column as f64 + 0.5, 0.0));
                for (number, line) in (0..).zip(lines) {
                    root.draw_text(line, &style, (x, y + gap_px + LINE_HEIGHT_PX * number))?;
                }
            }
            if let Some(value) = self.reference {
                let line = [(0.0, value), (count, value)].map(|at| axes.backend_coord(&at));
                marks.line(&line, theme::AXIS, (1.0, "4 2"));
            }
            Ok(())
        })
    }
}

/// Legend entries of filled boxes.
pub(super) fn boxes(series: &[SeriesStyle]) -> Vec<LegendEntry<'_>> {
    series.iter().map(LegendEntry::filled).collect()
}

/// Refuses a value that a bar cannot show.
pub(super) fn check_bars<'v>(
    title: &str,
    (what, name): (&str, &str),
    mut values: impl Iterator<Item = &'v f64>,
) -> Result<(), PlotError> {
    match values.find(|value| !(value.is_finite() && **value >= 0.0)) {
        Some(bad) => Err(PlotError::new(
            title,
            format!("{what} `{name}` holds {bad}"),
        )),
        None => Ok(()),
    }
}

/// The largest value, times `headroom`; 1 if there is none above zero.
pub(super) fn end_above(values: impl Iterator<Item = f64>, headroom: f64) -> f64 {
    match values.fold(0.0, f64::max) {
        largest if largest > 0.0 => headroom * largest,
        _ => 1.0,
    }
}
