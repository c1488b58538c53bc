//! The page: tables, plots and pictures of every scene.

use super::frusta::Frusta;
use super::{TechniquesReport, plots};
use crate::answers;
use crate::document::Document;
use crate::html::{self, Answer, Page, count};
use crate::picture::EmbeddedPicture;
use crate::plots::PlotError;
use crate::table::Table;
use crate::theme::group_thousands;
use formats::view::Eye;
use maud::{Markup, html};
use studies::techniques::manifest::{Auto, Manifest};
use studies::techniques::{Difference, Measured, Measures};

/// Keys of the columns in the page's table; CSV and JSON have all columns.
const SHOWN: [&str; 30] = [
    "technique",
    "frame_time_ratio",
    "frame_time_ratio_q1",
    "frame_time_ratio_q3",
    "processor_time_ratio",
    "frame_ms",
    "frame_ms_p99",
    "beyond_90hz_pct",
    "beyond_72hz_pct",
    "cull_ms",
    "cull_tests",
    "false_negatives",
    "false_positives",
    "draws",
    "draw_calls",
    "vertices",
    "fragments",
    "fragments_ratio",
    "memory_bytes_ratio",
    "energy_ratio",
    "flip_mean",
    "flip_p99",
    "flip_worst",
    "psnr_db",
    "ssim",
    "flicker",
    "external_mb_per_frame",
    "peak_memory_bytes",
    "dominated",
    "dominated_in",
];

const PARETO_CAPTION: &str = "The line joins the techniques with less error than every faster one. A technique is dominated if another one has at most its error and takes less time, with disjoint interquartile ranges. Green: meant to be lossless; red: lossy; grey: baseline.";

/// A scene's pictures.
pub struct Scene {
    /// The difference pictures, each with its form for the page.
    pub differences: Vec<(Difference, EmbeddedPicture)>,
}

impl TechniquesReport<'_> {
    /// The page; `pictures` has one entry per scene.
    ///
    /// # Errors
    /// A plot that cannot be drawn.
    pub fn page(&self, pictures: &[Scene]) -> Result<String, PlotError> {
        let mut page = Page::default();
        self.scene_sections(pictures, &mut page)?;
        let orders = self.order_table();
        if !orders.rows.is_empty() {
            let title = "Tile orders with and without each technique";
            page.add(title, self.orders_section(&orders));
        }
        let claims = self.claim_table().without_empty_columns();
        if !claims.rows.is_empty() {
            page.add(
                "Published and measured savings",
                html! {
                    (claims.markup())
                    p.note { "Device and scenes differ from those of the published figure. The image error of the technique is in the same row." }
                },
            );
        }
        page.add(
            "Machine of the caches",
            html::settings("configuration (TOML)", &self.config),
        );
        let title = "Parallax: techniques of stereo rendering";
        Ok(page.text(title, &self.answer()?))
    }

    /// The sections of each scene.
    fn scene_sections(&self, pictures: &[Scene], page: &mut Page) -> Result<(), PlotError> {
        let table = self.rows();
        for ((measures, manifest), scene) in self.scenes.iter().zip(&self.manifests).zip(pictures) {
            let name = measures.scene;
            let own = table.only("scene", name).picked(SHOWN);
            page.add(
                format!("{name}: techniques"),
                html! {
                    (facts(manifest))
                    (own.markup())
                    (own.folded_meanings())
                },
            );
            page.add(
                format!("{name}: time and error"),
                time_and_error(measures, manifest)?,
            );
            let pacing = self.pacing_table();
            let pacing = if pacing.headings.iter().any(|h| h.key == "scene") {
                pacing.only("scene", name)
            } else {
                pacing
            };
            page.add(
                format!("{name}: frames and refreshes"),
                html! {
                    (pacing.markup())
                    (pacing.folded_meanings())
                    p.note { "Times are as measured on the device above, not scaled to a display's refresh rate." }
                },
            );
            page.add(
                format!("{name}: frusta and cones"),
                html::figure(
                    &frusta(measures, manifest).svg(),
                    "Both drawings are to scale. Far fields begin at their split and are rendered by one camera between the eyes.",
                ),
            );
            let stages = self.stage_table(&table, name);
            if !stages.rows.is_empty() {
                page.add(format!("{name}: time by stage"), stages.markup());
            }
            if let Some(auto) = &manifest.auto {
                page.add(format!("{name}: automatic choice"), chosen(auto));
            }
            if !scene.differences.is_empty() {
                page.add(
                    format!("{name}: skipped work"),
                    differences(measures, &scene.differences),
                );
            }
        }
        Ok(())
    }

    /// The top of the page: what was found, in sentences and a chart.
    fn answer(&self) -> Result<Answer, PlotError> {
        let scenes: Vec<&str> = self.scenes.iter().map(|m| m.scene).collect();
        let software = self.manifests.iter().any(|m| m.software_driver);
        let about = html! {
            p {
                "Every technique on " (scenes.join(", ")) ", alone and combined, compared with the baseline: "
                "frame time (measured in alternation with the baseline), image error inside the visible area, and texture cache traffic. "
                "All figures are in the JSON and CSV files next to this page."
            }
            @if software {
                p { strong { "Frame times are a processor's" } ": the driver renders in software, so the cost of vertices, fragments and state changes differs from a GPU's. Counts, image errors and cache figures do not depend on that." }
            }
        };
        let first = self.scenes.first();
        let chart = html::chart(first.map(|m| plots::pareto(m).svg()), PARETO_CAPTION)?;
        Ok(Answer {
            sentences: self.sentences(),
            chart,
            about,
        })
    }

    /// The fastest technique of the first scene, the baseline, the driver and the machine.
    pub(super) fn sentences(&self) -> Vec<String> {
        let mut out = self.scenes.first().map_or_else(Vec::new, |measures| {
            let (own, others): (Vec<&Measured>, Vec<_>) =
                measures.rows.iter().partition(|m| m.is_baseline());
            let timed = others.iter().map(|m| answers::Timed {
                name: m.row.technique.clone(),
                time: m.timing.ratio,
                flip: m.pictures.flip_mean,
            });
            let baseline = own
                .first()
                .map_or("the first technique", |m| &m.row.technique);
            let noise = own.first().map(|m| m.timing.ratio);
            answers::timed(
                measures.scene,
                &timed.collect::<Vec<_>>(),
                (baseline, noise),
            )
        });
        if let (Some(manifest), false) = (self.manifests.first(), out.is_empty()) {
            let [width, height] = manifest.size_px;
            let frames = count(manifest.frames.len(), "frame");
            let software = match self.manifests.iter().any(|m| m.software_driver) {
                true => ", by a software driver: frame times are a processor's, not a GPU's",
                false => "",
            };
            let condition =
                format!("Measured at {width}x{height} pixels per eye over {frames}{software}.");
            out.insert(1, condition);
        }
        let defects = self
            .manifests
            .iter()
            .filter_map(|m| m.multiview_defect.as_deref());
        out.extend(defects.map(|defect| {
            let defect = formats::text::printable(defect);
            format!(
                "Multiview was timed as separate views and counted as one submission: {defect}."
            )
        }));
        let caches = [self.config.level.l1, self.config.level.l2].map(|cache| cache.size_bytes);
        let frames: Vec<u32> = (self.manifests.iter())
            .map(|m| m.frames.len() as u32)
            .collect();
        out.push(answers::machine(&self.config, [caches], &frames));
        out
    }

    /// The times of the stages, if the capture has them.
    fn stage_table(&self, table: &Table, scene: &str) -> Table {
        let keys: Vec<&str> = table
            .headings
            .iter()
            .map(|h| h.key.as_ref())
            .filter(|key| *key == "technique" || key.starts_with("stages_ms."))
            .collect();
        if keys.len() < 2 {
            return Table::default();
        }
        table.only("scene", scene).picked(keys)
    }

    fn orders_section(&self, orders: &Table) -> Markup {
        let (order, against) = self.gain_orders();
        html! {
            (orders.markup())
            (orders.folded_meanings())
            p.note {
                (order.title()) " renders the tiles of both eyes that show the same place together. The second eye then hits the lines that the first eye fetched. "
                "It can save at most the repeated fetches of " (against.title()) ": the traffic above that of an infinite cache, as far as both eyes touch the lines. "
                "A technique that reduces either leaves less to save."
            }
        }
    }
}

fn facts(manifest: &Manifest) -> Markup {
    let count = |n: u64| group_thousands(&n.to_string());
    let [width, height] = manifest.size_px;
    let lens = manifest.lens[0];
    html! {
        dl {
            dt { "scene" } dd { (manifest.scene) ", " (count(manifest.scene_triangles)) " triangles in " (count(manifest.instances)) " instances, camera " (manifest.camera) }
            dt { "path" } dd {
                @if let Some(path) = &manifest.path { (path) ", " }
                (manifest.frames.len()) @if manifest.frames.len() == 1 { " frame" } @else { " frames" }
                " at " (manifest.fps) " a second"
            }
            dt { "display" } dd {
                (manifest.hmd.name) ", " (width) "\u{d7}" (height) " px per eye, "
                strong { (format!("{:.2}", manifest.pixels_per_degree)) " pixels per degree" } ", used by every FLIP value; lens of radius tangent " (format!("{:.3}", lens.radius))
                " (errors count inside it)"
            }
            dt { "rendered by" } dd { (manifest.adapter) ", " (manifest.driver) @if manifest.software_driver { " (in software: frame times are a processor's)" } }
            @if let Some(defect) = &manifest.multiview_defect {
                dt { "multiview" } dd { "timed as separate views, counted as one submission, because of a driver defect (" (defect) ")" }
            }
            dt { "measured by" } dd { (manifest.tool) "; baseline " (manifest.baseline) }
        }
    }
}

/// The display from above, with the mean splits of the scene's techniques.
fn frusta<'a>(measures: &Measures, manifest: &'a Manifest) -> Frusta<'a> {
    let split = |m: &Measured| Some((m.row.technique.clone(), m.predicted("split_m")?));
    Frusta {
        title: format!("{}: display {}", measures.scene, manifest.hmd.name),
        hmd: &manifest.hmd,
        lens: manifest.lens,
        splits: measures.rows.iter().filter_map(split).collect(),
    }
}

fn time_and_error(measures: &Measures, manifest: &Manifest) -> Result<Markup, PlotError> {
    let mut rows = vec![plots::ratios(measures).svg()];
    if manifest.frames.len() > 1 {
        rows.push(plots::frame_times(measures).svg());
        rows.extend(plots::errors(measures).map(|errors| errors.svg()));
    }
    Ok(html! {
        (html::figure(&plots::pareto(measures).svg()?, PARETO_CAPTION))
        (html::charts(rows)?)
        @if manifest.frames.len() > 1 { p.note { "Lines along the path: the baseline and the techniques that are not dominated." } }
    })
}

/// A value without quotes and braces: a technique by its name, other objects key by key.
fn plain(value: &serde_json::Value) -> String {
    let Some(map) = value.as_object() else {
        return value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned);
    };
    if let Some(name) = map.get("technique") {
        return plain(name);
    }
    let pairs = map
        .iter()
        .map(|(key, value)| format!("{key} = {}", plain(value)));
    pairs.collect::<Vec<_>>().join(", ")
}

fn chosen(auto: &Auto) -> Markup {
    html! {
        dl {
            dt { "budget" } dd { (plain(&auto.budget)) }
            dt { "chosen" } dd { (plain(&auto.chosen)) }
            dt { "why" } dd { (auto.reason) }
            dt { "searched on" } dd { (auto.search_frames.len()) " frames" }
            dt { "checked on" } dd { (auto.held_frames.len()) " other frames" }
        }
    }
}

fn differences(measures: &Measures, pictures: &[(Difference, EmbeddedPicture)]) -> Markup {
    html! {
        p {
            "The worst picture of each technique: the picture, its FLIP error (from black to yellow) and the skipped work in vermilion. "
            "Skipped work is the share of the baseline's fragments that each 16\u{d7}16 tile skipped, if there are traces, else the pixel's error. Pixels outside the lens are dimmed."
        }
        div.row {
            @for (difference, picture) in pictures {
                @let m = &measures.rows[difference.row];
                figure.picture {
                    img src=(picture.data_uri()) alt={ (m.row.title) ": picture, error, skipped work" }
                        width=(picture.size_px[0]) height=(picture.size_px[1]);
                    figcaption {
                        (m.row.title) ", frame " (difference.frame) ", "
                        @if difference.eye == Eye::Left { "left" } @else { "right" } " eye"
                        @if let Some(pct) = difference.shaded_pct { ": " (format!("{pct:.1}")) " % of the baseline's fragments" }
                    }
                }
            }
        }
    }
}
