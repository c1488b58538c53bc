//! Tables, charts, CSV and page of stereo reprojection on a ray-tracing GPU.

mod charts;
mod cycle_table;
mod tables;

use crate::answers;
use crate::columns::name;
use crate::document::Document;
use crate::errors::{self, KnownError, Of};
use crate::html::{Answer, Page, figure as html_figure, settings};
use crate::plots::{PlotError, data_uri};
use crate::table::{Style, Table};
use maud::{Markup, html};
use serde::Serialize;
use sgrt::result::Report;
use sim::paper::sgrt as paper;

/// Longest edge of a picture on the page.
pub const THUMBNAIL_PX: u32 = 560;

/// A trace's results with its pictures.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The figures.
    pub report: Report,
    /// Pictures, if a page is written.
    pub pictures: Option<Thumbnails>,
}

/// Results of several traces.
pub struct ReprojectReport {
    /// The traces.
    pub entries: Vec<Entry>,
}

/// PNG files of one trace.
#[derive(Clone, Debug)]
pub struct Thumbnails {
    /// The left image.
    pub left: Vec<u8>,
    /// The right image with its bad pixels in yellow.
    pub bad: Vec<u8>,
    /// Its FLIP map.
    pub flip: Vec<u8>,
    /// The same under plain reuse.
    pub plain_bad: Vec<u8>,
    /// Its FLIP map under plain reuse.
    pub plain_flip: Vec<u8>,
}

/// The whole page.
///
/// # Errors
/// A chart that cannot be drawn.
pub fn page(entries: &[Entry]) -> Result<String, PlotError> {
    let about = html! {
        p {
            "The left image is traced in full. Its hits are reprojected into the right eye and "
            "reused unless error detection rejects them. Ratios compare with the same hardware "
            "tracing both eyes in full. Paper: Lee et al., \u{201c}Fast Stereoscopic "
            "Rendering on Mobile Ray Tracing GPU for Virtual Reality Applications\u{201d}."
        }
    };
    let answer = Answer {
        sentences: sentences(entries),
        chart: html_figure(&charts::performance(entries).svg()?, ""),
        about,
    };
    let title = "Stereo reprojection on a mobile ray-tracing GPU";
    Ok(sections(entries)?.text(title, &answer))
}

fn sentences(entries: &[Entry]) -> Vec<String> {
    let scene = |entry: &Entry| {
        let (report, result) = (&entry.report, &entry.report.result);
        answers::Reprojected {
            scene: tables::scene_name(report),
            performance: result.relative_performance,
            energy: result.relative_energy,
            energy_bounds: result.relative_energy_bounds,
            reuse_pct: result.reuse_pct,
            flip: result.flip_mean,
            paper: (report.paper.as_ref()).map(|p| [p.relative_performance, p.relative_energy]),
        }
    };
    answers::reprojected(&entries.iter().map(scene).collect::<Vec<_>>())
}

/// The sections of the page.
///
/// # Errors
/// A chart that cannot be drawn.
fn sections(entries: &[Entry]) -> Result<Page, PlotError> {
    let mut page = Page::default();
    page.add("Performance and energy", performance(entries)?);
    page.add("Reuse and image error", accuracy(entries));
    page.add("Units, cores and memory", hardware(entries));
    for entry in entries {
        let scene = tables::scene_name(&entry.report);
        if let Some(pictures) = &entry.pictures {
            page.add(format!("Pictures: {scene}"), picture_row(entry, pictures));
        }
        if !entry.report.curve.is_empty() {
            page.add(format!("Cycles against error: {scene}"), curve(entry)?);
        }
        if !entry.report.sensitivity.is_empty() {
            page.add(
                format!("Sensitivity: {scene}"),
                html! {
                    p {
                        "The paper publishes none of these parameters. Each one is halved and doubled "
                        "on its own (for a hit rate, the miss rate is); rows are sorted by effect."
                    }
                    (tables::sensitivity(&entry.report).markup())
                },
            );
        }
    }
    page.sections.extend(errors::section(Of::Rays));
    if let Some(entry) = entries.first() {
        let config = &entry.report.config;
        page.add("Configuration", settings("All parameters", config));
    }
    Ok(page)
}

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct ReprojectJson<'a> {
    #[serde(flatten)]
    report: &'a Report,
    /// What is known of the figures' errors.
    errors: Vec<&'static KnownError>,
}

/// The schema of the JSON object.
#[cfg(feature = "testing")]
pub fn schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<ReprojectJson<'_>>(sgrt::result::SCHEMA)
}

impl ReprojectReport {
    fn objects(&self) -> Vec<ReprojectJson<'_>> {
        let errors = || errors::known(Of::Rays);
        let reports = self.entries.iter().map(|entry| &entry.report);
        let object = |report| ReprojectJson {
            report,
            errors: errors(),
        };
        reports.map(object).collect()
    }
}

impl Document for ReprojectReport {
    const SCHEMA: &'static str = sgrt::result::SCHEMA;
    const HAS_DETAILS: bool = true;
    const FILES_BESIDE_PAGE: bool = false;

    fn content(&self) -> impl Serialize {
        self.objects()
    }

    fn rows(&self) -> Table {
        tables::rows(&self.entries)
    }

    fn answer(&self) -> Vec<String> {
        let mut out = sentences(&self.entries);
        if let Some(entry) = self.entries.first() {
            let (config, [width, height]) = (&entry.report.config, entry.report.eye_size_px);
            let machine = format!(
                "Machine: mobile ray-tracing GPU, {} timing; {width}x{height} pixels per eye; rule {}, reuse of {}.",
                config.timing.name(),
                config.rule,
                name(&config.reuse)
            );
            out.insert(1, machine);
        }
        out
    }

    fn text(&self, style: Style) -> String {
        text(&self.entries, style)
    }

    fn details(&self, style: Style) -> String {
        details(&self.entries, style)
    }

    /// One object for each trace; those of several traces have a line each.
    fn json(&self) -> serde_json::Result<String> {
        match self.objects().as_slice() {
            [object] => serde_json::to_string_pretty(object),
            objects => {
                let lines: serde_json::Result<Vec<_>> =
                    objects.iter().map(serde_json::to_string).collect();
                Ok(lines?.join("\n"))
            }
        }
    }
}

/// Parts of a text, each below its title.
#[derive(Default)]
struct Parts(String);

impl Parts {
    fn push(&mut self, title: &str, table: &str) {
        self.0 += &format!("{title}\n{}\n\n", table.trim_end());
    }
}

/// The main table, and those that a flag asks for.
fn text(entries: &[Entry], style: Style) -> String {
    let keys = [
        "scene",
        "run",
        "reuse_pct",
        "relative_performance",
        "paper_relative_performance",
        "relative_energy",
        "relative_energy_least",
        "relative_energy_most",
        "paper_relative_energy",
    ];
    let table = tables::rows(entries).picked(keys).without_empty_columns();
    let mut out = Parts::default();
    out.push("Against tracing both eyes in full", &table.styled(style));
    for entry in entries {
        let scene = tables::scene_name(&entry.report);
        if !entry.report.curve.is_empty() {
            let title = format!("Cycles against error: {scene}");
            out.push(&title, &tables::curve(&entry.report).styled(style));
        }
        if !entry.report.sensitivity.is_empty() {
            let title = format!("Sensitivity: {scene}");
            out.push(&title, &tables::sensitivity(&entry.report).styled(style));
        }
    }
    out.0
}

/// The other tables.
fn details(entries: &[Entry], style: Style) -> String {
    let mut out = Parts::default();
    let mut part = |title: &str, table: String| out.push(title, &table);
    part("Stereo reprojection", tables::rule_line(entries));
    part(
        "Performance and energy",
        tables::performance(entries).styled(style),
    );
    if let Some(line) = tables::mean_reuse_line(entries) {
        part("Average reuse", line);
    }
    for note in tables::row_notes(entries) {
        part("Rows", note);
    }
    part(
        "Reuse and image error",
        tables::accuracy(entries).styled(style),
    );
    part(
        "Right pixels by class",
        tables::classes(entries).styled(style),
    );
    part("Bytes moved", tables::traffic(entries).styled(style));
    if let Some(table) = cycle_table::units(entries) {
        part(cycle_table::TITLE, table.styled(style));
    }
    if let Some(table) = cycle_table::prefetches(entries) {
        part(cycle_table::PREFETCH_TITLE, table.styled(style));
    }
    out.0.trim_end().to_owned() + "\n" + &errors::text(Of::Rays, style)
}

fn performance(entries: &[Entry]) -> Result<Markup, PlotError> {
    Ok(html! {
        (charts::ratios(entries)?)
        p { (tables::rule_line(entries)) "." }
        @if let Some(line) = tables::mean_reuse_line(entries) { p { (line) "." } }
        @for note in tables::row_notes(entries) { p { strong { (note) "." } } }
        (tables::performance(entries).markup())
        p {
            "The paper's average reuse is " (paper::REUSE_PCT) " %. Its units' work falls by about "
            (paper::TNI_REDUCTION_PCT) " %, and its cores' work grows by about "
            (paper::SRP_OVERHEAD_PCT) " %. The paper does not publish unit counts, latencies, cache sizes and "
            "energies; the model's are parameters, the same for all scenes. "
            "\u{201c}Units alone\u{201d} is the ratio of unit cycles. \u{201c}14 nm\u{201d} are the bounds of "
            "the energy ratio if the default energies, which are 45 nm figures, are scaled. Where only primary hits "
            "are reused, the share of primary rays in all steps limits the saving: scenes with many shadow, "
            "reflection and refraction rays save little at any rate of reuse."
        }
    })
}

fn accuracy(entries: &[Entry]) -> Markup {
    html! {
        p {
            "FLIP (0 to 1) compares the right image with the fully traced one at the display's "
            "pixels per degree (ppd). Percentages are of all right pixels. A position error is the "
            "distance between reused and true hit over the pixel's width at that depth."
        }
        (tables::accuracy(entries).markup())
        (tables::classes(entries).markup())
    }
}

fn hardware(entries: &[Entry]) -> Markup {
    html! {
        (tables::work(entries).markup())
        @if let Some(table) = cycle_table::units(entries) { (table.markup()) }
        @if let Some(table) = cycle_table::prefetches(entries) { (table.markup()) }
        (tables::traffic(entries).markup())
        (tables::energy(entries).markup())
    }
}

fn picture_row(entry: &Entry, pictures: &Thumbnails) -> Markup {
    let report = &entry.report;
    let figure = |png: &[u8], caption: String| {
        html! {
            figure {
                img src=(data_uri::png(png)) alt=(caption) style="max-width:100%";
                figcaption { (caption) }
            }
        }
    };
    let flip = |o: &sgrt::result::Outcome| {
        format!(
            "FLIP, mean {:.4} at {:.1} ppd (from black to yellow)",
            o.flip_mean, o.pixels_per_degree
        )
    };
    let (ours, plain) = (&report.result, &report.plain);
    html! {
        div.row {
            (figure(&pictures.left, "Left image, traced".to_owned()))
            (figure(&pictures.bad, format!(
                "Right image, rule {}: {:.2} % reused, yellow is traced",
                report.config.rule, ours.reuse_pct
            )))
            (figure(&pictures.flip, flip(ours)))
        }
        div.row {
            (figure(&pictures.plain_bad, format!(
                "Right image, plain reuse: {:.2} % reused, yellow is traced", plain.reuse_pct
            )))
            (figure(&pictures.plain_flip, flip(plain)))
        }
    }
}

fn curve(entry: &Entry) -> Result<Markup, PlotError> {
    Ok(html! {
        (charts::curve(&entry.report)?)
        (tables::curve(&entry.report).markup())
    })
}

#[cfg(test)]
mod tests;
