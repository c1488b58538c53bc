//! Every reading of the SGRT paper's figure 3, beside the paper's values (`replay.readings/2`).

use super::columns::{Columns, columns_of, name};
use super::document::Document;
use super::html::{Answer, Page, figure, figures, settings};
use super::lists::{geometric_mean, least};
use super::plots::lines::{Axis, LineChart, LineSeries};
use super::plots::{PlotError, SeriesStyle};
use super::table::{Style, Table};
use maud::{Markup, html};
use serde::{Serialize, Serializer};
use sgrt::config::SgrtConfig;
use sgrt::readings::{Figures, Reading, Scope, rms_log};
use sim::paper::sgrt::PaperValues;
use sim::result::TraceId;

/// The readings of a trace.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct SceneReadings {
    /// Name in tables.
    pub label: String,
    /// The trace.
    pub trace: TraceId,
    /// Width and height of one eye's image.
    pub eye_size_px: [u32; 2],
    /// The paper's values, if the trace stands in for one of its scenes.
    pub paper: Option<PaperValues>,
    /// True if the closest reading is chosen by this scene.
    pub calibrates: bool,
    /// The figures of each reading, the same readings for all scenes.
    #[serde(serialize_with = "by_reading")]
    #[cfg_attr(feature = "testing", schemars(with = "Vec<ReadingFigures<'static>>"))]
    pub readings: Vec<(Reading, Figures)>,
}

/// A reading and its figures in JSON.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct ReadingFigures<'a> {
    /// Index in `fits`, which describes the reading.
    index: usize,
    #[serde(flatten)]
    figures: &'a Figures,
}

fn by_reading<'a, S: Serializer>(
    readings: &'a [(Reading, Figures)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let one = |(index, pair): (usize, &'a (Reading, Figures))| ReadingFigures {
        index,
        figures: &pair.1,
    };
    serializer.collect_seq(readings.iter().enumerate().map(one))
}

/// How a reading does over all scenes.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Fit {
    /// Index of the reading.
    index: usize,
    reading: Reading,
    /// Root mean square of ln(ours / paper) over performance and energy: scenes that calibrate.
    calibration: Option<f64>,
    /// The same: the other scenes.
    test: Option<f64>,
    /// Geometric means over all scenes.
    relative_performance: f64,
    relative_energy: f64,
    /// The same of the least and most relative energies, if the energies are scaled to 14 nm.
    relative_energy_bounds: [f64; 2],
    /// Scenes on which reprojection saves energy.
    scenes_that_save_energy: usize,
}

/// All readings of all scenes.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct ReadingsReport {
    config: SgrtConfig,
    /// Index of the reading that is closest on the scenes that calibrate.
    chosen: Option<usize>,
    fits: Vec<Fit>,
    scenes: Vec<SceneReadings>,
}

fn scope_name(scope: Scope) -> &'static str {
    match scope {
        Scope::Units => "units",
        Scope::UnitsAndMemory => "units, hierarchy in DRAM",
        Scope::Frame => "whole frame",
    }
}

fn rule_name(reading: &Reading) -> &'static str {
    match reading.rule.to_string().as_str() {
        "none" => "none",
        _ => "strict",
    }
}

impl Document for ReadingsReport {
    const SCHEMA: &'static str = "replay.readings/2";
    const MODEL_VERSION: u32 = sim::model_version::RAY_MODEL_VERSION;
    const FILES_BESIDE_PAGE: bool = false;

    fn content(&self) -> impl Serialize {
        self
    }

    /// A row per reading and scene.
    #[rustfmt::skip]
    fn rows(&self) -> Table {
        struct ReadingRow<'a> { fit: &'a Fit, scene: &'a SceneReadings, chosen: bool }
        let figures = |c: &ReadingRow| c.scene.readings[c.fit.index].1;
        let columns = columns_of::<ReadingRow>()
            .text("scene", "scene", |c| c.scene.label.clone())
            .text("checksum", "checksum", |c| c.scene.trace.checksum.clone())
            .text("width_px", "width", |c| c.scene.eye_size_px[0])
            .text("height_px", "height", |c| c.scene.eye_size_px[1])
            .text("set", "set", |c| if c.scene.calibrates { "calibration" } else { "test" })
            .text("reading", "reading", |c| c.fit.index as u64 + 1)
            .text("chosen", "closest", |c| c.chosen)
            .text("scope", "measured of", |c| scope_name(c.fit.reading.scope))
            .text("reuse", "reused", |c| name(&c.fit.reading.reuse))
            .text("rule", "rule", |c| rule_name(&c.fit.reading))
            .text("row_test", "tested against", |c| name(&c.fit.reading.row_test))
            .text("gbuffer", "G-buffer", |c| name(&c.fit.reading.gbuffer))
            .real("relative_performance", "performance", "ratio", 4, move |c| figures(c).relative_performance)
            .real("paper_relative_performance", "paper", "ratio", 2, |c| Some(c.scene.paper.as_ref()?.relative_performance))
            .real("relative_energy", "energy", "ratio", 4, move |c| figures(c).relative_energy)
            .real("relative_energy_least", "14 nm, least", "ratio", 4, move |c| figures(c).relative_energy_bounds[0])
            .real("relative_energy_most", "14 nm, most", "ratio", 4, move |c| figures(c).relative_energy_bounds[1])
            .real("paper_relative_energy", "paper", "ratio", 2, |c| Some(c.scene.paper.as_ref()?.relative_energy))
            .real("frames_per_second", "frames per second", "", 2, move |c| figures(c).frames_per_second)
            .real("paper_frames_per_second", "paper", "", 1, |c| Some(c.scene.paper.as_ref()?.frames_per_second));
        let cells: Vec<ReadingRow> = self.fits.iter().flat_map(|fit| {
            let chosen = self.chosen == Some(fit.index);
            self.scenes.iter().map(move |scene| ReadingRow { fit, scene, chosen })
        }).collect();
        Table::new(&columns, &cells)
    }

    /// The tables for a terminal.
    fn text(&self, style: Style) -> String {
        let mut out = self.sentences().join(" ") + "\n\nReadings\n" + &self.fits().styled(style);
        if let Some(index) = self.chosen {
            out += "\nThe closest reading, scene by scene\n";
            out += &self.closest(index).styled(style);
        }
        out
    }
}

impl ReadingsReport {
    /// Compares the readings with the paper's values. The readings of all scenes are the same.
    pub fn new(scenes: Vec<SceneReadings>, config: SgrtConfig) -> Self {
        let readings = scenes.first().map_or(&[][..], |scene| &scene.readings);
        let fit = |(index, (reading, _)): (usize, &(Reading, Figures))| {
            let distance = |calibrates: bool| {
                rms_log(scenes.iter().filter_map(|scene| {
                    let paper = scene.paper.as_ref()?;
                    let ratios = [paper.relative_performance, paper.relative_energy];
                    (scene.calibrates == calibrates).then_some((scene.readings[index].1, ratios))
                }))
            };
            let of = |value: fn(&Figures) -> f64| {
                scenes.iter().map(move |s| value(&s.readings[index].1))
            };
            let geometric = |values| geometric_mean(values).unwrap_or(1.0);
            Fit {
                index,
                reading: reading.clone(),
                calibration: distance(true),
                test: distance(false),
                relative_performance: geometric(of(|f| f.relative_performance)),
                relative_energy: geometric(of(|f| f.relative_energy)),
                relative_energy_bounds: [
                    geometric(of(|f| f.relative_energy_bounds[0])),
                    geometric(of(|f| f.relative_energy_bounds[1])),
                ],
                scenes_that_save_energy: of(|f| f.relative_energy).filter(|e| *e < 1.0).count(),
            }
        };
        let fits: Vec<Fit> = readings.iter().enumerate().map(fit).collect();
        let chosen = least(fits.iter().map(|fit| fit.calibration));
        Self {
            config,
            chosen,
            fits,
            scenes,
        }
    }

    /// A row per reading.
    #[rustfmt::skip]
    fn fits(&self) -> Table {
        let columns = columns_of::<Fit>()
            .text("reading", "reading", |f| f.index as u64 + 1)
            .text("scope", "measured of", |f| scope_name(f.reading.scope))
            .text("reuse", "reused", |f| name(&f.reading.reuse))
            .text("rule", "rule", |f| rule_name(&f.reading))
            .text("row_test", "tested against", |f| name(&f.reading.row_test))
            .text("gbuffer", "G-buffer", |f| name(&f.reading.gbuffer))
            .real("calibration", "from the paper, calibration", "RMS ln", 3, |f| f.calibration)
            .real("test", "test scenes", "RMS ln", 3, |f| f.test)
            .real("relative_performance", "performance, mean", "ratio", 3, |f| f.relative_performance)
            .real("relative_energy", "energy, mean", "ratio", 3, |f| f.relative_energy)
            .real("relative_energy_least", "14 nm, least", "ratio", 3, |f| f.relative_energy_bounds[0])
            .real("relative_energy_most", "14 nm, most", "ratio", 3, |f| f.relative_energy_bounds[1])
            .text("saves", "scenes that save energy", |f| f.scenes_that_save_energy as u64);
        Table::new(&columns, &self.fits)
    }

    /// The closest reading, scene by scene, beside the paper's values.
    #[rustfmt::skip]
    fn closest(&self, index: usize) -> Table {
        let columns = columns_of::<SceneReadings>()
            .text("scene", "scene", |s| s.label.clone())
            .text("set", "set", |s| if s.calibrates { "calibration" } else { "test" })
            .real("relative_performance", "performance", "ratio", 2, move |s| s.readings[index].1.relative_performance)
            .real("paper_relative_performance", "paper", "ratio", 2, |s| Some(s.paper.as_ref()?.relative_performance))
            .real("relative_energy", "energy", "ratio", 3, move |s| s.readings[index].1.relative_energy)
            .real("paper_relative_energy", "paper", "ratio", 2, |s| Some(s.paper.as_ref()?.relative_energy))
            .real("frames_per_second", "frames per second", "", 1, move |s| s.readings[index].1.frames_per_second)
            .real("paper_frames_per_second", "paper", "", 1, |s| Some(s.paper.as_ref()?.frames_per_second));
        Table::new(&columns, &self.scenes)
    }

    /// What was found, in sentences.
    fn sentences(&self) -> Vec<String> {
        let (count, scenes) = (self.fits.len(), self.scenes.len());
        let saving = self.fits.iter().filter(|f| f.relative_energy < 1.0).count();
        let readings = match count {
            1 => "the only reading".to_owned(),
            count => format!("the {count} readings"),
        };
        let of = match scenes {
            1 => "On the only scene".to_owned(),
            scenes => format!("In the mean over {scenes} scenes"),
        };
        let verdict = match saving {
            0 => format!("none of {readings}")
                .replace("none of the only reading", "not under the only reading"),
            saving if saving == count => format!(
                "under {}",
                readings.replacen("the ", "all ", usize::from(count > 1))
            ),
            saving => format!("under {saving} of {readings}"),
        };
        let verdict = verdict.replacen("none of", "under none of", 1);
        let mut text = vec![format!(
            "{of}, reprojection saves energy {verdict} of the paper."
        )];
        let bounds = || self.fits.iter().map(|f| f.relative_energy_bounds);
        let (always, never) = (
            bounds().filter(|[_, most]| *most < 1.0).count(),
            bounds().filter(|[least, _]| *least >= 1.0).count(),
        );
        text.push(format!(
            "With energies scaled to 14 nm, {always} of {count} readings save energy at any scaling, {never} at none, and {} at some.",
            count - always - never
        ));
        if let Some(fit) = self.chosen.and_then(|index| self.fits.get(index)) {
            let distance = |d: Option<f64>| d.map_or("-".to_owned(), |d| format!("{d:.3}"));
            text.push(format!(
                "Closest to the paper's figure 3 on the scenes that calibrate is reading {}: {}, reuse of {}, rule {}, tested against {}, G-buffer by {} (RMS of ln(ours/paper) {}; on the test scenes {}).",
                fit.index + 1,
                scope_name(fit.reading.scope),
                name(&fit.reading.reuse),
                rule_name(&fit.reading),
                name(&fit.reading.row_test),
                name(&fit.reading.gbuffer),
                distance(fit.calibration),
                distance(fit.test),
            ));
        }
        text
    }

    /// A self-contained page.
    ///
    /// # Errors
    /// A chart that cannot be drawn.
    pub fn page(&self) -> Result<String, PlotError> {
        let about = html! {
            p {
                "The paper (Lee et al., \u{201c}Fast Stereoscopic Rendering on Mobile Ray Tracing GPU for Virtual Reality "
                "Applications\u{201d}) leaves open what its figure 3 measures and what a reused pixel takes over. Each reading "
                "is one choice for each question. Nothing else is fitted: the constants of the hardware are those of --preset sgrt-paper."
            }
        };
        let mut page = Page::default();
        page.add("Energy and performance under every reading", self.charts()?);
        if let Some(index) = self.chosen {
            let title = "The closest reading, scene by scene";
            page.add(title, self.closest(index).markup());
        }
        page.add("Readings", self.fits().markup());
        page.add("Configuration", settings("All parameters", &self.config));
        let answer = Answer {
            sentences: self.sentences(),
            chart: figure(
                &self.trade().svg()?,
                "A symbol for each reading and scene; hover shows its figures.",
            ),
            about,
        };
        Ok(page.text("Readings of the SGRT paper", &answer))
    }

    /// Energy against performance.
    fn trade(&self) -> LineChart {
        let series = |(number, scene): (usize, &SceneReadings)| {
            LineSeries::dots(
                SeriesStyle::nth(&scene.label, number),
                (scene.readings.iter()).map(|(_, f)| (f.relative_performance, f.relative_energy)),
            )
        };
        LineChart {
            title: "Energy against performance under every reading".to_owned(),
            x: Axis::linear("frames per second over tracing both eyes"),
            y: Axis::linear("energy over tracing both eyes"),
            series: self.scenes.iter().enumerate().map(series).collect(),
        }
    }

    fn charts(&self) -> Result<Markup, PlotError> {
        let chart = |title: &str, label: &str, value: fn(&Figures) -> f64| LineChart {
            title: title.to_owned(),
            x: Axis::linear("number of the reading in the table"),
            y: Axis::linear(label),
            series: (0..)
                .zip(&self.scenes)
                .map(|(number, scene)| {
                    LineSeries::dots(
                        SeriesStyle::nth(&scene.label, number),
                        (1..)
                            .zip(&scene.readings)
                            .map(|(at, (_, figures))| (f64::from(at), value(figures))),
                    )
                })
                .collect(),
        };
        let energy = chart("Relative energy", "energy over tracing both eyes", |f| {
            f.relative_energy
        });
        let performance = chart(
            "Relative performance",
            "frames per second over tracing both eyes",
            |f| f.relative_performance,
        );
        Ok(figures(&[
            (
                energy.svg()?,
                "Below 1, reprojection saves energy.".to_owned(),
            ),
            (
                performance.svg()?,
                "Above 1, reprojection is faster.".to_owned(),
            ),
        ]))
    }
}
