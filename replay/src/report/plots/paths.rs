//! A tile order as its path over both eyes' tiles (the Z2 paper's Figs. 2 and 3).

use super::heatmap::{HeatMap, Panel};
use super::{Anchor, Area, PlotError, draw, fill, stroke, text};
use crate::report::theme;

/// A stop of the path: the eye (0 left, 1 right), column and row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// 0 left, 1 right.
    pub eye: u32,
    /// Tile column.
    pub x: u32,
    /// Tile row.
    pub y: u32,
    /// Taken together with the stop before it, on the same core.
    pub paired: bool,
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
    /// The path as SVG: a line through numbered tiles. For grids that are too fine to number see
    /// [`PathPlot::steps`].
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
            return Err(PlotError {
                title: self.title.clone(),
                problem: format!("{bad:?} is outside of 2 x {columns}x{rows} tiles"),
            });
        }
        let cell = (240.0 / f64::from(columns.max(rows).max(1)))
            .clamp(8.0, 30.0)
            .floor();
        let (w, h) = (cell * f64::from(columns), cell * f64::from(rows));
        let left = |eye: u32| 8.0 + f64::from(eye) * (w + GAP_PX);
        let width = (left(1) + w + 10.0)
            .max(theme::text_width_px(&self.title, theme::TITLE_PX) + 16.0)
            .max(theme::text_width_px(&self.note, theme::LABEL_PX) + 16.0);
        let size = (width.ceil() as u32, (TOP_PX + h + 10.0) as u32);
        draw(&self.title, size, |area| {
            super::heading(area, &self.title, &self.note)?;
            for (eye, name) in [(0, "left eye"), (1, "right eye")] {
                let at = (left(eye) + w / 2.0, TOP_PX - 11.0);
                text(
                    area,
                    at,
                    name,
                    theme::LABEL_PX,
                    theme::MUTED,
                    Anchor::Middle,
                )?;
            }
            self.numbered(area, cell, &left)
        })
    }

    /// Each tile's step as a heat map, for grids of any size.
    #[must_use]
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

    fn numbered(&self, area: &Area, cell: f64, left: &impl Fn(u32) -> f64) -> Result<(), String> {
        let [columns, rows] = self.tiles;
        let centre = |s: &Stop| {
            (
                left(s.eye) + cell * (f64::from(s.x) + 0.5),
                TOP_PX + cell * (f64::from(s.y) + 0.5),
            )
        };
        for eye in 0..2 {
            let (x0, x1) = (left(eye), left(eye) + cell * f64::from(columns));
            for i in 0..=columns {
                let x = x0 + cell * f64::from(i);
                stroke(
                    area,
                    &[(x, TOP_PX), (x, TOP_PX + cell * f64::from(rows))],
                    theme::GRID,
                    1,
                )?;
            }
            for i in 0..=rows {
                let y = TOP_PX + cell * f64::from(i);
                stroke(area, &[(x0, y), (x1, y)], theme::GRID, 1)?;
            }
        }
        // Within an eye the stops of that eye are joined; a line between the eyes at every other
        // step would hide both curves, so the numbers tell the turn.
        for eye in 0..2 {
            let points: Vec<(f64, f64)> = self
                .stops
                .iter()
                .filter(|s| s.eye == eye)
                .map(centre)
                .collect();
            stroke(
                area,
                &points,
                theme::SERIES[if eye == 0 { 1 } else { 0 }],
                theme::LINE_PX,
            )?;
        }
        for (step, stop) in self.numbering() {
            let (x, y) = centre(stop);
            let half = theme::text_width_px(&step.to_string(), theme::TICK_PX) / 2.0 + 1.0;
            fill(area, (x - half, y - 6.0), (x + half, y + 6.0), theme::PAPER)?;
            text(
                area,
                centre(stop),
                &step.to_string(),
                theme::TICK_PX,
                theme::INK,
                Anchor::Middle,
            )?;
        }
        Ok(())
    }

    /// Steps from 1; the two tiles of a pair share one.
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
