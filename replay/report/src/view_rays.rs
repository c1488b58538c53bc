//! The page of `replay view` for a ray trace: what the rays of each tile cost, and which right pixels are reused.

use super::document::Document;
use super::html::{Answer, Page};
use super::picture::EmbeddedPicture;
use super::sgrt::ReprojectReport;
use super::view::{ramp, viewer};
use formats::view::TILE_SIZE_PX;
use image_error::Picture;
use maud::html;
use serde::Serialize;
use sgrt::detect::PixelClass;
use sgrt::frame::EyeFrame;
use sgrt::loaded::{LoadedTrace, RuleRun};

/// A map: key of its list, name and unit.
#[derive(Serialize)]
struct Metric(&'static str, &'static str, &'static str);

/// Maps of a rule come first, then those of the traced rays.
const METRICS: [Metric; 6] = [
    Metric("traced_pct", "traced pixels", "%"),
    Metric("rejected_pct", "pixels that the rule rejects", "%"),
    Metric("flip", "FLIP", "thousandths"),
    Metric("steps", "nodes visited", ""),
    Metric("triangle_tests", "triangles tested", ""),
    Metric("rays", "rays", ""),
];

/// Data of the page's script; see `view.rs` for texture traces.
#[derive(Serialize)]
struct Data {
    metrics: [Metric; 6],
    ramp: String,
    picture: String,
    draws: [(); 0],
    textures: [(); 0],
    runs: Vec<Run>,
    frames: [Frame; 1],
}

#[derive(Serialize)]
struct Run {
    title: String,
    color: &'static str,
}

#[derive(Serialize)]
struct Frame {
    number: u32,
    passes: Vec<Eye>,
}

/// An eye; lists have a number for each tile, row by row.
#[derive(Serialize)]
struct Eye {
    name: &'static str,
    eye: u32,
    tiles: [u32; 2],
    rays: Vec<u64>,
    steps: Vec<u64>,
    triangle_tests: Vec<u64>,
    draws: [(); 0],
    runs: Vec<EyeRun>,
}

/// An eye under a rule.
#[derive(Clone, Serialize)]
struct EyeRun {
    traced_pct: Vec<u64>,
    rejected_pct: Vec<u64>,
    flip: Vec<u64>,
}

/// Sums of values by tile.
struct Tiles {
    size_px: [u32; 2],
    tiles: [u32; 2],
}

impl Tiles {
    fn sums(&self, of: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; (self.tiles[0] * self.tiles[1]) as usize];
        let [width, height] = self.size_px;
        for pixel in 0..width * height {
            let [x, y] = [pixel % width, pixel / width].map(|at| at / TILE_SIZE_PX);
            sums[(y * self.tiles[0] + x) as usize] += of(pixel as usize);
        }
        sums
    }

    fn counts(&self, of: impl Fn(usize) -> u32) -> Vec<u64> {
        let sums = self.sums(|pixel| f64::from(of(pixel)));
        sums.into_iter().map(|sum| sum as u64).collect()
    }

    /// Means over a tile's pixels, times `scale`.
    fn means(&self, scale: f64, of: impl Fn(usize) -> f64) -> Vec<u64> {
        let pixels = self.sums(|_| 1.0);
        let sums = self.sums(of).into_iter().zip(pixels);
        sums.map(|(sum, pixels)| (scale * sum / pixels).round() as u64)
            .collect()
    }

    fn eye(&self, number: u32, frame: &EyeFrame, runs: Vec<EyeRun>) -> Eye {
        let work = |pixel: usize| frame.work[pixel].by_class.iter();
        Eye {
            name: ["left eye", "right eye"][number as usize],
            eye: number,
            tiles: self.tiles,
            rays: self.counts(|pixel| work(pixel).map(|class| class.rays).sum()),
            steps: self.counts(|pixel| work(pixel).map(|class| class.steps).sum()),
            triangle_tests: self
                .counts(|pixel| work(pixel).map(|class| class.triangle_tests).sum()),
            draws: [],
            runs,
        }
    }
}

/// The maps of a ray trace under the chosen and the plain rule.
pub struct RayMaps {
    data: Data,
}

impl RayMaps {
    /// Counts by tile.
    ///
    /// # Errors
    /// An empty picture.
    pub fn new(label: &str, trace: &LoadedTrace<'_>, runs: &[RuleRun; 2]) -> anyhow::Result<Self> {
        let frame = trace.frame();
        let all = Tiles {
            size_px: frame.size_px,
            tiles: frame.size_px.map(|size| size.div_ceil(TILE_SIZE_PX)),
        };
        let left = EyeRun {
            traced_pct: all.means(100.0, |_| 1.0),
            rejected_pct: all.means(0.0, |_| 0.0),
            flip: all.means(0.0, |_| 0.0),
        };
        let share = |is: bool| f64::from(u8::from(is));
        let right = |run: &RuleRun| EyeRun {
            traced_pct: all.means(100.0, |pixel| {
                share(!run.decisions[pixel].class.is_reused())
            }),
            rejected_pct: all.means(100.0, |pixel| {
                share(run.decisions[pixel].class == PixelClass::Bad)
            }),
            flip: all.means(1000.0, |pixel| f64::from(run.flip.errors[pixel])),
        };
        let eyes = vec![
            all.eye(0, frame.left(), vec![left; 2]),
            all.eye(1, frame.right(), runs.iter().map(right).collect()),
        ];
        let both = Picture::side_by_side(&[&trace.left(), &runs[0].picture], 0);
        let titles = [
            ("chosen rule", "0072b2"),
            ("plain: every arrival is reused", "e69f00"),
        ];
        let titles = titles.map(|(title, color)| Run {
            title: title.to_owned(),
            color,
        });
        Ok(Self {
            data: Data {
                metrics: METRICS,
                ramp: ramp(),
                picture: EmbeddedPicture::of(label, &both)?.data_uri(),
                draws: [],
                textures: [],
                runs: titles.into(),
                frames: [Frame {
                    number: 0,
                    passes: eyes,
                }],
            },
        })
    }

    /// The page.
    ///
    /// # Errors
    /// A number that JSON cannot hold.
    pub fn page(&self, report: &ReprojectReport) -> serde_json::Result<String> {
        let json = serde_json::to_string(&self.data)?.replace('<', "\\u003c");
        let mut page = Page::default();
        let titles = self.data.runs.iter().map(|run| run.title.as_str());
        page.add("Tiles", viewer(&titles.collect::<Vec<_>>(), &json, false));
        page.add("What the maps show", html! {
            dl {
                dt { "traced pixels" } dd { "Pixels whose primary ray is traced: all of the left eye; of the right eye those without an arrival or rejected by the rule." }
                dt { "pixels that the rule rejects" } dd { "Pixels with an arrival of the left eye's hits that the rule does not accept." }
                dt { "FLIP" } dd { "Mean error of the right picture against the traced one, in thousandths." }
                dt { "nodes visited, triangles tested, rays" } dd { "Of all rays of the tile's pixels when both eyes are traced in full." }
            }
        });
        let label = report
            .entries
            .first()
            .map_or("", |entry| &entry.report.trace.name);
        let answer = Answer {
            sentences: report.answer(),
            chart: html! {},
            about: html! { p { "Counts by tile of " (TILE_SIZE_PX) "x" (TILE_SIZE_PX) " pixels. Totals are those of " code { "replay reproject" } "." } },
        };
        Ok(page.text(&format!("{label}: rays and reprojection"), &answer))
    }
}
