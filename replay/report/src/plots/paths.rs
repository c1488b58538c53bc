//! A tile order as its path over both eyes' tiles (the Z2 paper's Figs. 2 and 3).

use super::PlotError;
use super::frame::{Area, Drawn, Frame, text_style, themed};
use super::heatmap::{HeatMap, Panel};
use crate::theme;
use plotters::chart::ChartBuilder;
use plotters::prelude::{Color, PathElement, Rectangle};
use plotters::style::text_anchor::HPos;
use sim::order::WorkItem;

/// A stop of the path: the eye (0 left, 1 right), column and row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// 0 left, 1 right.
    pub eye: u32,
    /// Tile column.
    pub x: u32,
    /// Tile row.
    pub y: u32,
    /// Whether it is rendered together with the stop before it, on the same core.
    pub paired: bool,
}

/// The stops of an order's items over grids of this many columns and rows; the pass of a tile is its eye.
pub(crate) fn stops(items: &[WorkItem], [columns, _]: [u32; 2]) -> Vec<Stop> {
    let mut stops = Vec::new();
    for item in items {
        for (number, at) in item.tiles().enumerate() {
            stops.push(Stop {
                eye: at.pass,
                x: at.tile % columns.max(1),
                y: at.tile / columns.max(1),
                paired: number > 0,
            });
        }
    }
    stops
}

/// An order's path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathPlot {
    /// Heading: the order's name.
    pub title: String,
    /// Line under the heading.
    pub note: String,
    /// Columns and rows of each eye's tiles.
    pub tiles: [u32; 2],
    /// Stops in order of traversal.
    pub stops: Vec<Stop>,
}

const TOP_PX: f64 = 62.0;
const GAP_PX: f64 = 26.0;

impl PathPlot {
    /// The path as SVG: a line through numbered tiles. Use [`PathPlot::steps`] for grids that are too fine
    /// for numbers.
    ///
    /// # Errors
    /// A stop outside the grid.
    pub fn svg(&self) -> Result<String, PlotError> {
        let [columns, rows] = self.tiles;
        if let Some(bad) = self
            .stops
            .iter()
            .find(|s| s.x >= columns || s.y >= rows || s.eye > 1)
        {
            let problem = format!("{bad:?} is outside of 2 x {columns}x{rows} tiles");
            return Err(PlotError::new(&self.title, problem));
        }
        // Numbers of neighbours stay apart.
        let widest_px = theme::text_width_px(&self.stops.len().to_string(), theme::TICK_PX);
        let cell = (240.0 / f64::from(columns.max(rows).max(1)))
            .clamp(8.0, 30.0)
            .max(widest_px + 8.0)
            .floor();
        let (w, h) = (cell * f64::from(columns), cell * f64::from(rows));
        let frame = Frame {
            title: &self.title,
            value_label: &self.note,
            legend: Vec::new(),
            plot_px: (2.0 * w + GAP_PX, h),
            around_px: [TOP_PX as u32, 10, 10, 8],
        };
        frame.draw(|root, _, _| {
            for (eye, name, x) in [(0, "left eye", 8.0), (1, "right eye", 8.0 + w + GAP_PX)] {
                let style = text_style(theme::LABEL_PX, theme::MUTED, HPos::Center);
                let middle = (x + w / 2.0) as i32;
                root.draw_text(name, &style, (middle, TOP_PX as i32 - 11))?;
                // One pixel more for the last line of the grid.
                self.numbered(&root.clone().shrink((x, TOP_PX), (w + 1.0, h + 1.0)), eye)?;
            }
            Ok(())
        })
    }

    /// Each tile's step as a heat map, for grids of any size.
    pub fn steps(&self) -> HeatMap {
        let [columns, rows] = self.tiles;
        let mut panels = ["left eye", "right eye"].map(|name| Panel {
            name: name.to_owned(),
            tiles: self.tiles,
            values: vec![0.0; columns as usize * rows as usize],
        });
        for (step, stop) in self.numbering() {
            let cell = panels
                .get_mut(stop.eye as usize)
                .and_then(|p| p.values.get_mut((stop.y * columns + stop.x) as usize));
            if let Some(cell) = cell {
                *cell = step as f64;
            }
        }
        HeatMap {
            title: self.title.clone(),
            value_label: format!("step, counted in tiles; {}", self.note),
            panels: panels.into(),
            high: None,
        }
    }

    /// Draws one eye's path. The numbers show when the order changes eyes; lines between the eyes would
    /// hide both curves.
    fn numbered(&self, area: &Area, eye: u32) -> Drawn {
        let [columns, rows] = self.tiles;
        let mut builder = ChartBuilder::on(area);
        let mut chart =
            builder.build_cartesian_2d(0.0..f64::from(columns), f64::from(rows)..0.0)?;
        themed(&mut chart.configure_mesh())
            .x_labels(columns as usize + 1)
            .y_labels(rows as usize + 1)
            .draw()?;
        let centre = |s: &Stop| (f64::from(s.x) + 0.5, f64::from(s.y) + 0.5);
        let own = self.stops.iter().filter(|s| s.eye == eye);
        let color = theme::SERIES[if eye == 0 { 1 } else { 0 }];
        let path = PathElement::new(
            own.map(centre).collect::<Vec<_>>(),
            color.stroke_width(theme::LINE_PX),
        );
        chart.plotting_area().draw(&path)?;
        let number = text_style(theme::TICK_PX, theme::INK, HPos::Center);
        let pixels = chart.plotting_area().strip_coord_spec();
        let (left, top) = pixels.get_base_pixel();
        for (step, stop) in self.numbering() {
            if stop.eye != eye {
                continue;
            }
            let step = step.to_string();
            let (x, y) = chart.backend_coord(&centre(stop));
            let (x, y) = (x - left, y - top);
            let half = (theme::text_width_px(&step, theme::TICK_PX) / 2.0) as i32 + 1;
            let behind = [(x - half, y - 6), (x + half, y + 6)];
            pixels.draw(&Rectangle::new(behind, theme::PAPER.filled()))?;
            pixels.draw_text(&step, &number, (x, y))?;
        }
        Ok(())
    }

    /// Step numbers from 1; the two tiles of a pair share a number.
    fn numbering(&self) -> Vec<(usize, &Stop)> {
        let mut step = 0;
        self.stops
            .iter()
            .map(|stop| {
                if !stop.paired {
                    step += 1;
                }
                (step, stop)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot() -> PathPlot {
        let stop = |eye, x, y, paired| Stop { eye, x, y, paired };
        PathPlot {
            title: "Z2 STA".into(),
            note: "both tiles of a step on one core".into(),
            tiles: [2, 1],
            stops: vec![
                stop(0, 0, 0, false),
                stop(1, 0, 0, true),
                stop(0, 1, 0, false),
                stop(1, 1, 0, true),
            ],
        }
    }

    #[test]
    fn the_two_tiles_of_a_pair_share_a_number() {
        let plot = plot();
        let steps: Vec<usize> = plot.numbering().iter().map(|(s, _)| *s).collect();
        assert_eq!(steps, [1, 1, 2, 2]);
    }

    #[test]
    fn the_map_of_steps_numbers_every_tile() {
        let map = plot().steps();
        assert_eq!(map.panels[0].values, [1.0, 2.0]);
        assert_eq!(map.panels[1].values, [1.0, 2.0]);
    }

    #[test]
    fn the_same_path_gives_the_same_bytes() {
        assert_eq!(plot().svg().unwrap(), plot().svg().unwrap());
    }

    #[test]
    fn a_stop_outside_the_grid_is_refused() {
        let mut bad = plot();
        bad.stops[0].x = 2;
        assert!(
            bad.svg()
                .unwrap_err()
                .to_string()
                .contains("outside of 2 x 2x1 tiles")
        );
    }
}
