//! The page: tables, plots and pictures of every scene.

use super::frusta::Frusta;
use super::{TechniquesReport, plots};
use crate::report::html::{self, Section, figures, slug};
use crate::report::picture::EmbeddedPicture;
use crate::report::plots::PlotError;
use crate::report::table::Table;
use crate::report::theme::group_thousands;
use crate::techniques::manifest::{Auto, Manifest};
use crate::techniques::{Difference, Measured, Measures};
use formats::view::Eye;
use maud::{Markup, html};

/// Keys of the columns that the page's table shows; CSV and JSON have them all.
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

/// A scene's pictures.
pub struct Scene {
    /// The difference pictures, each with its picture for the page.
    pub differences: Vec<(Difference, EmbeddedPicture)>,
}

impl TechniquesReport<'_> {
    /// The page; `pictures` has one a scene.
    ///
    /// # Errors
    /// A plot that cannot be drawn.
    pub fn page(&self, pictures: &[Scene]) -> Result<String, PlotError> {
        let mut sections = Vec::new();
        let table = self.table();
        for ((measures, manifest), scene) in self.scenes.iter().zip(&self.manifests).zip(pictures) {
            let name = measures.scene;
            let section = |title: String, body: Markup| Section {
                id: slug(&title),
                title,
                body,
            };
            let own = table.only("scene", name).picked(SHOWN);
            sections.push(section(
                format!("{name}: techniques"),
                html! {
                    (facts(manifest))
                    (own.markup())
                    (meanings(&own))
                },
            ));
            sections.push(section(
                format!("{name}: time and error"),
                time_and_error(measures, manifest)?,
            ));
            let pacing = self.pacing_table();
            let pacing = if pacing.headings.iter().any(|h| h.key == "scene") {
                pacing.only("scene", name)
            } else {
                pacing
            };
            sections.push(section(
                format!("{name}: frames and refreshes"),
                html! {
                    (pacing.markup())
                    (meanings(&pacing))
                    p.note { "Times are as they were measured on the device above, not scaled to a display's." }
                },
            ));
            sections.push(section(
                format!("{name}: frusta and cones"),
                html::figure(
                    &frusta(measures, manifest).svg(),
                    "Both drawings are to scale. Far fields lie beyond their split, seen by one camera between the eyes.",
                ),
            ));
            let stages = self.stage_table(&table, name);
            if !stages.rows.is_empty() {
                sections.push(section(
                    format!("{name}: where the time goes"),
                    stages.markup(),
                ));
            }
            if let Some(auto) = &manifest.auto {
                sections.push(section(
                    format!("{name}: chosen for a budget"),
                    chosen(auto),
                ));
            }
            if !scene.differences.is_empty() {
                sections.push(section(
                    format!("{name}: what was skipped"),
                    differences(measures, &scene.differences),
                ));
            }
        }
        let orders = self.order_table();
        if !orders.rows.is_empty() {
            sections.push(Section::new(
                "Tile orders with and without each technique",
                self.orders_section(&orders),
            ));
        }
        let claims = self.claim_table();
        if !claims.rows.is_empty() {
            sections.push(Section::new(
                "Published savings beside ours",
                html! {
                    (claims.markup())
                    p.note { "Ours is on another device and other scenes than the published figure; what it costs in image error stands beside it." }
                },
            ));
        }
        sections.push(Section::new(
            "Machine of the caches",
            html::folded(
                "configuration (TOML)",
                &toml::to_string(&self.config).unwrap_or_default(),
            ),
        ));
        let scenes: Vec<&str> = self.scenes.iter().map(|m| m.scene).collect();
        let software = self.manifests.iter().any(|m| m.software_driver);
        let lead = html! {
            p {
                "Every technique on " (scenes.join(", ")) ", alone and combined, held against the baseline: "
                "frame time measured alternately with it, image error where the user can see, and what the texture caches fetch. "
                "All figures are in the JSON and CSV files beside this page."
            }
            @if software {
                p { strong { "Frame times are a processor's" } ": the driver renders in software, so they weigh vertices, fragments and state changes otherwise than a GPU does. Counts, image errors and cache figures do not depend on it." }
            }
        };
        Ok(html::page(
            "Parallax: techniques of stereo rendering",
            &lead,
            &sections,
        ))
    }

    /// The stages' times, if the capture tells them.
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
            (meanings(orders))
            p.note {
                (order.title()) " renders the tiles of both eyes that show the same place together, so that the second eye finds the lines that the first one fetched. "
                "It can save what " (against.title()) " fetches more than once: the traffic above an infinite cache's, and of that what both eyes touch. "
                "A technique that shrinks either leaves less to save."
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
                (manifest.hmd.name) ", " (width) "\u{d7}" (height) " px an eye, "
                strong { (format!("{:.2}", manifest.pixels_per_degree)) " pixels per degree" } ", to which every FLIP belongs; lens of radius tangent " (format!("{:.3}", lens.radius))
                " (errors count inside it)"
            }
            dt { "rendered by" } dd { (manifest.adapter) ", " (manifest.driver) @if manifest.software_driver { " (in software: frame times are a processor's)" } }
            @if let Some(defect) = &manifest.multiview_defect {
                dt { "multiview" } dd { "timed view by view, counted as one submission: the driver's cannot be trusted (" (defect) ")" }
            }
            dt { "measured by" } dd { (manifest.tool) "; baseline " (manifest.baseline) }
        }
    }
}

/// What the columns are.
fn meanings(table: &Table) -> Markup {
    html! {
        details {
            summary { "what the columns are" }
            dl.note {
                @for h in table.headings.iter().filter(|h| !h.about.is_empty()) {
                    dt { (h.name) @if !h.unit.is_empty() { ", " (h.unit) } } dd { (h.about) }
                }
            }
        }
    }
}

/// The display from above, with the splits that the scene's techniques chose on average.
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
    let mut rows = vec![(plots::ratios(measures).svg()?, String::new())];
    if manifest.frames.len() > 1 {
        rows.push((plots::frame_times(measures).svg()?, String::new()));
        if let Some(errors) = plots::errors(measures) {
            rows.push((errors.svg()?, String::new()));
        }
    }
    Ok(html! {
        (html::figure(&plots::pareto(measures).svg()?, "The line joins the techniques that no other dominates: another takes no more time, errs no more, and is better at one of both."))
        (figures(&rows))
        @if manifest.frames.len() > 1 { p.note { "Lines along the path: the baseline and the techniques that no other dominates." } }
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
            "The worst picture of each technique: as it is, its FLIP error (black none, yellow the most) and what was skipped in vermilion, "
            "by the share of the baseline's fragments that a 16\u{d7}16 tile was spared where the traces tell it, else by the pixel's error. What the lens hides is dimmed."
        }
        div.row {
            @for (difference, picture) in pictures {
                @let m = &measures.rows[difference.row];
                figure.picture {
                    img src=(picture.data_uri()) alt={ (m.row.title) ": picture, error, what was skipped" }
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
