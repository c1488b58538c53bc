//! Per-tile heat maps of both eyes side by side, with a colour bar.
//!
//! The cells are a small embedded PNG (one pixel per tile, scaled without smoothing), which keeps a 60x68
//! map near two kilobytes. Everything else is vector graphics.

use super::frame::{Area, Drawn, Frame, text_style, themed, tick_format};
use super::{PlotError, escape};
use crate::theme;
use plotters::chart::ChartBuilder;
use plotters::prelude::{Color, Rectangle};
use plotters::style::RGBColor;
use plotters::style::text_anchor::HPos;
use std::fmt::Write as _;

/// One eye's cells, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Name over the panel.
    pub name: String,
    /// Columns and rows.
    pub tiles: [u32; 2],
    /// Values, one per tile.
    pub values: Vec<f64>,
}

/// Heat maps that share a scale.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    /// Heading.
    pub title: String,
    /// What a cell shows, with its unit: `external lines per tile`.
    pub value_label: String,
    /// Panels from left to right.
    pub panels: Vec<Panel>,
    /// End of the colour scale; `None` uses the largest value. Charts to be compared need the same end.
    pub high: Option<f64>,
}

const TOP_PX: f64 = 66.0;
const GAP_PX: f64 = 18.0;
const BAR_PX: f64 = 14.0;
/// Space for the colour bar's tick labels.
const TICKS_PX: f64 = 58.0;

impl HeatMap {
    /// The largest value of all panels.
    pub fn largest(&self) -> f64 {
        self.panels
            .iter()
            .flat_map(|p| p.values.iter().copied())
            .fold(0.0, f64::max)
    }

    /// The maps as SVG.
    ///
    /// # Errors
    /// A panel whose cells are not columns times rows, or a value that is not finite.
    pub fn svg(&self) -> Result<String, PlotError> {
        let fail = |problem: String| PlotError::new(&self.title, problem);
        for panel in &self.panels {
            let cells = panel.tiles[0] as usize * panel.tiles[1] as usize;
            if panel.values.len() != cells || cells == 0 {
                return Err(fail(format!(
                    "panel `{}`: {} values for {}x{} tiles",
                    panel.name,
                    panel.values.len(),
                    panel.tiles[0],
                    panel.tiles[1]
                )));
            }
            if let Some(bad) = panel.values.iter().find(|v| !v.is_finite()) {
                return Err(fail(format!("panel `{}` holds {bad}", panel.name)));
            }
        }
        let high = self.high.unwrap_or_else(|| self.largest());
        let high = if high > 0.0 { high } else { 1.0 };
        let mut x = 8.0;
        let places: Vec<(f64, f64, f64)> = self
            .panels
            .iter()
            .map(|p| {
                let cell = cell_px(p.tiles);
                let (w, h) = (f64::from(p.tiles[0] * cell), f64::from(p.tiles[1] * cell));
                let place = (x, w, h);
                x += w + GAP_PX;
                place
            })
            .collect();
        let height = places.iter().map(|p| p.2).fold(60.0, f64::max);
        let frame = Frame {
            title: &self.title,
            value_label: &self.value_label,
            legend: Vec::new(),
            plot_px: (x - 8.0 + BAR_PX + TICKS_PX, height),
            around_px: [TOP_PX as u32, 8, 12, 8],
        };
        let mut svg = frame.draw(|root, _, _| {
            let name = text_style(theme::LABEL_PX, theme::INK, HPos::Center);
            for (panel, (x, w, h)) in self.panels.iter().zip(&places) {
                root.draw_text(
                    &panel.name,
                    &name,
                    ((x + w / 2.0) as i32, TOP_PX as i32 - 11),
                )?;
                let corners = [(x - 1.0, TOP_PX - 1.0), (x + w, TOP_PX + h)];
                let corners = corners.map(|(x, y)| (x as i32, y as i32));
                root.draw(&Rectangle::new(corners, theme::AXIS))?;
            }
            color_bar(
                &root
                    .clone()
                    .shrink((x, TOP_PX), (BAR_PX + TICKS_PX, height)),
                high,
            )
        })?;

        let mut images = String::new();
        for (panel, (x, w, h)) in self.panels.iter().zip(&places) {
            let png = png_of(panel, high).map_err(&fail)?;
            let _ = writeln!(
                images,
                "<image x=\"{x}\" y=\"{TOP_PX}\" width=\"{w}\" height=\"{h}\" preserveAspectRatio=\"none\" \
                 style=\"image-rendering:pixelated\" href=\"{}\"><title>{}</title></image>",
                super::data_uri::png(&png),
                escape(&format!("{}: {}", self.title, panel.name)),
            );
        }
        let end = svg
            .rfind("</svg>")
            .ok_or_else(|| fail("no end of drawing".to_owned()))?;
        svg.insert_str(end, &images);
        Ok(svg)
    }
}

/// Cell size; small grids have larger cells.
fn cell_px(tiles: [u32; 2]) -> u32 {
    (240 / tiles[0].max(tiles[1]).max(1)).clamp(1, 24)
}

/// Draws the colours from 0 to `high` with an axis on the right.
fn color_bar(area: &Area, high: f64) -> Drawn {
    let mut builder = ChartBuilder::on(area);
    let builder = builder.right_y_label_area_size(TICKS_PX);
    let mut chart = builder.build_cartesian_2d(0.0..1.0, 0.0..high)?;
    chart.draw_series((0..64).map(|step| {
        let [low, middle, top] = [0.0, 0.5, 1.0].map(|part| (f64::from(step) + part) / 64.0);
        let corners = [(0.0, low * high), (1.0, top * high)];
        Rectangle::new(corners, color(middle).filled())
    }))?;
    themed(&mut chart.configure_mesh())
        .disable_mesh()
        .y_label_formatter(&tick_format(&(0.0..high)))
        .draw()
}

fn png_of(panel: &Panel, high: f64) -> Result<Vec<u8>, String> {
    let [width, height] = panel.tiles;
    let mut pixels = image::RgbImage::new(width, height);
    for (pixel, value) in pixels.pixels_mut().zip(&panel.values) {
        let RGBColor(r, g, b) = color(value / high);
        *pixel = image::Rgb([r, g, b]);
    }
    let mut png = std::io::Cursor::new(Vec::new());
    pixels
        .write_to(&mut png, image::ImageFormat::Png)
        .map_err(|e| e.to_string())?;
    Ok(png.into_inner())
}

/// Viridis (van der Walt and Smith, 2015) at nine equidistant points, linear in between: perceptually
/// uniform and readable in grey.
const VIRIDIS: [[u8; 3]; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2C, 0x7A],
    [0x3B, 0x51, 0x8B],
    [0x2C, 0x71, 0x8E],
    [0x21, 0x90, 0x8D],
    [0x27, 0xAD, 0x81],
    [0x5C, 0xC8, 0x63],
    [0xAA, 0xDC, 0x32],
    [0xFD, 0xE7, 0x25],
];

/// The colour of a value from 0 to 1.
pub fn color(t: f64) -> RGBColor {
    let t = t.clamp(0.0, 1.0);
    let at = t * (VIRIDIS.len() - 1) as f64;
    let i = (at as usize).min(VIRIDIS.len() - 2);
    let f = at - i as f64;
    let mix = |c: usize| {
        let (a, b) = (f64::from(VIRIDIS[i][c]), f64::from(VIRIDIS[i + 1][c]));
        (a + f * (b - a)).round() as u8
    };
    RGBColor(mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> HeatMap {
        let panel = |name: &str| Panel {
            name: name.into(),
            tiles: [3, 2],
            values: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
        };
        HeatMap {
            title: "Crytek: L2 misses".into(),
            value_label: "external lines per tile".into(),
            panels: vec![panel("left eye"), panel("right eye")],
            high: None,
        }
    }

    #[test]
    fn the_same_numbers_give_the_same_bytes() {
        assert_eq!(map().svg().unwrap(), map().svg().unwrap());
    }

    #[test]
    fn both_eyes_and_the_unit_are_drawn() {
        let svg = map().svg().unwrap();
        assert!(
            svg.contains("left eye")
                && svg.contains("right eye")
                && svg.contains("external lines per tile")
        );
        assert_eq!(svg.matches("data:image/png;base64,").count(), 2);
    }

    #[test]
    fn cells_keep_their_places() {
        let png = png_of(&map().panels[0], 5.0).unwrap();
        let image = image::load_from_memory(&png).unwrap().to_rgb8();
        let RGBColor(r, g, b) = color(1.0);
        assert_eq!(image.get_pixel(2, 1).0, [r, g, b]);
        assert_eq!(image.get_pixel(0, 0).0, [68, 1, 84]);
    }

    #[test]
    fn brightness_rises_along_the_map() {
        let luma: Vec<f64> = (0..=100)
            .map(|i| {
                let RGBColor(r, g, b) = color(f64::from(i) / 100.0);
                0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
            })
            .collect();
        assert!(luma.windows(2).all(|w| w[1] > w[0]));
    }

    #[test]
    fn a_panel_with_missing_cells_is_refused() {
        let mut bad = map();
        bad.panels[1].values.pop();
        assert_eq!(
            bad.svg().unwrap_err().to_string(),
            "plot `Crytek: L2 misses`: panel `right eye`: 5 values for 3x2 tiles"
        );
    }
}
