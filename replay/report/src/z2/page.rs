//! The experiment as a page.

use super::model::{PaperReport, TraceInfo};
use super::plots::{self, TileMeasure};
use super::{cores, tables, whole_frame};
use crate::answers;
use crate::errors::{self, Of};
use crate::html::{self, Answer, Page, charts, count};
use crate::picture::EmbeddedPicture;
use crate::plots::PlotError;
use crate::plots::bars::BarChart;
use crate::plots::hbars::HBarChart;
use crate::table::Table;
use maud::{Markup, html};
use sim::config::{CountBy, Order};
use sim::result::TOOL;

/// Number of textures or draws in the charts and tables by part.
const BUSIEST_PARTS: usize = 20;
/// Grid of the example paths, as in the paper's Fig. 3 (32 tiles).
const EXAMPLE_TILES: [u32; 2] = [8, 4];

/// The whole page. `pictures` are both eyes' images by trace label.
///
/// # Errors
/// A plot that cannot be drawn (a figure that is not finite).
pub fn page(report: &PaperReport, pictures: &[EmbeddedPicture]) -> Result<String, PlotError> {
    let mut page = Page::default();
    page.add("What was run", runs(report));
    if !pictures.is_empty() {
        page.add("Pictures", scenes(pictures));
    }
    page.add(
        "Miss rates, utilisation and traffic (Table 2)",
        table_2(report),
    );
    page.add("Averages", tables::averages(&report.averages).markup());
    page.add("External bandwidth (Fig. 5)", bandwidth(report)?);
    page.sections.extend(whole_frame::section(report)?);
    page.add("Charts of Table 2", rates(report)?);
    if let Some(table) = tables::as_the_paper_counts(report) {
        page.add("As the paper counts", as_the_paper_counts(&table));
    }
    if report.closed_form.rows > 0 {
        page.add(
            "TMU utilisation and the paper's surface",
            utilisation(report)?,
        );
    }
    if let Some(modes) = tables::modes(report) {
        let note = "Functional mode has no latencies: misses fill at once. The difference shows how timing changes the order in which the cores' accesses reach the L2.";
        let body = html! { p { (note) } (modes.markup()) };
        page.add("Functional against timed mode", body);
    }
    page.add("Bounds and checks", bounds(report));
    page.add("Tile orders", orders(report)?);
    page.sections.extend(cores::section(report)?);
    page.add("Heat maps by tile", heat_maps(report)?);
    if report.config.count_by == CountBy::Texture {
        page.add("By mip level", levels(report)?);
    }
    let by_part = match report.config.count_by {
        CountBy::Texture => "By texture",
        CountBy::Draw => "By draw",
    };
    page.add(by_part, parts(report)?);
    page.sections.extend(errors::section(Of::Textures));
    page.add("Configuration", configuration(report));
    let about = html! {
        p {
            "Stereo frames replayed through the caches and the texture unit of the Z\u{b2} paper's machine ("
            (report.config.cores) " cores, " (report.config.line_bytes) "-byte lines) in "
            (report.orders().len()) " tile orders"
            @if report.traces.iter().any(|t| t.stand_in_for.is_some()) { ", compared with its published figures" }
            ". "
            "The same numbers are in the JSON and CSV files next to this page."
        }
        (in_short(report))
    };
    let first = report.traces.first();
    let chart = first.map(|info| plots::bandwidth(report, &info.label).svg());
    let answer = Answer {
        sentences: sentences(report),
        chart: html::chart(chart, "")?,
        about,
    };
    Ok(page.text("Parallax: tile orders for stereo rendering", &answer))
}

/// The answer: the best order in the mean over everything, and the paper's figure for it.
pub(super) fn sentences(report: &PaperReport) -> Vec<String> {
    let last = report.averages.last();
    let means: Vec<_> = (report.averages.iter())
        .filter(|a| last.is_some_and(|last| last.scene == a.scene))
        .collect();
    let orders: Vec<(String, f64)> = (means.iter())
        .map(|a| (a.order.title().to_owned(), a.reduction_pct))
        .collect();
    let caches = count(report.caches().len(), "cache configuration");
    let over = match (last, report.traces.len()) {
        (Some(last), 1) => format!("{}, mean over {caches}", last.scene),
        (_, traces) => format!("mean over {} and {caches}", count(traces, "trace")),
    };
    let mut out = answers::tile_orders(Order::MORTON.title(), &over, &orders);
    let best = means
        .iter()
        .max_by(|a, b| a.reduction_pct.total_cmp(&b.reduction_pct));
    if let Some(best) = best {
        if let Some(paper) = best.paper_reduction_pct {
            let words = html::change(-paper, "less", "more", "as much");
            let name = best.order.title();
            out.push(format!(
                "The paper's figures for {name} on these scenes give {words}."
            ));
        } else if let Some(ratio) = best.tmu_ratio {
            let name = best.order.title();
            out.push(format!(
                "The texture units' utilisation in {name} is {ratio:.3} times that in Morton order."
            ));
        }
    }
    let caches = report.rows.iter().map(|row| {
        let level = &row.point.config.level;
        [level.l1.size_bytes, level.l2.size_bytes]
    });
    let frames: Vec<u32> = report.traces.iter().map(|trace| trace.frames).collect();
    out.insert(1, answers::machine(&report.config, caches, &frames));
    out
}

/// The means over everything.
fn in_short(report: &PaperReport) -> Markup {
    let Some(last) = report.averages.last() else {
        return html! {};
    };
    let means = report.averages.iter().filter(|a| a.scene == last.scene);
    html! {
        ul {
            @for mean in means {
                li {
                    (mean.order.title()) " against Morton, mean of " (last.scene) ": external traffic "
                    strong { (format!("{:+.1} %", -mean.reduction_pct)) }
                    @if let Some(ratio) = mean.tmu_ratio { ", texture-unit utilisation " strong { "\u{d7}" (format!("{ratio:.3}")) } }
                    @if let Some(paper) = mean.paper_reduction_pct {
                        " (paper: " (format!("{:+.1} %", -paper))
                        @if let Some(ratio) = mean.paper_tmu_ratio { ", \u{d7}" (format!("{ratio:.3}")) }
                        ")"
                    }
                }
            }
        }
    }
}

fn runs(report: &PaperReport) -> Markup {
    html! {
        @for info in &report.traces {
            h3 { (info.label) }
            dl {
                dt { "scene" } dd { (info.trace.scene) ", " (thousands(info.meta.scene_triangles)) " triangles, camera " (info.meta.camera) }
                @if let Some(scene) = info.stand_in_for { dt { "stands for" } dd { (scene) " of the paper" } }
                dt { "display" } dd {
                    (info.meta.hmd.name) ", " (info.meta.hmd.eye_size_px[0]) "\u{d7}" (info.meta.hmd.eye_size_px[1]) " px per eye, "
                    (fov(info)) ", " (format!("{:.0}", info.meta.hmd.ipd_m * 1000.0)) " mm between the eyes (" (info.meta.hmd.source) ")"
                }
                dt { "trace" } dd {
                    "checksum " (info.trace.checksum) ", " (info.frames) @if info.frames == 1 { " frame" } @else { " frames" } ", "
                    (thousands(info.quads)) " quads, " (thousands(info.footprints)) " footprints, "
                    (info.textures) " textures, " (info.tiles[0]) "\u{d7}" (info.tiles[1]) " tiles per eye"
                }
                dt { "captured by" } dd { (info.meta.tool) ", " (info.meta.backend) ", " (info.meta.driver) ", seed " (info.meta.seed) }
                dt { "command" } dd { code { (info.meta.command_line.join(" ")) } }
            }
        }
    }
}

/// Left and right half-angles of the left eye, then up and down.
fn fov(info: &TraceInfo) -> String {
    let degrees = |tangent: f32| f64::from(tangent).atan().to_degrees();
    let fov = &info.meta.hmd.fov[0];
    format!(
        "{:.0}\u{b0} \u{d7} {:.0}\u{b0}",
        degrees(fov.left) + degrees(fov.right),
        degrees(fov.up) + degrees(fov.down)
    )
}

fn thousands(number: u64) -> String {
    crate::theme::group_thousands(&number.to_string())
}

fn scenes(pictures: &[EmbeddedPicture]) -> Markup {
    html! {
        div.row {
            @for picture in pictures {
                figure.picture {
                    img src=(picture.data_uri()) alt={ "both eyes of " (picture.label) }
                        width=(picture.size_px[0]) height=(picture.size_px[1]);
                    figcaption { (picture.label) ", left and right eye" }
                }
            }
        }
    }
}

fn table_2(report: &PaperReport) -> Markup {
    let table = tables::table_2(report);
    html! {
        (table.markup())
        p.note { "A footprint is one bilinear fetch of one lane; MB are 10\u{2076} bytes. The paper's saving is computed from its two miss rates." }
        (table.meanings())
    }
}

fn as_the_paper_counts(table: &Table) -> Markup {
    html! {
        p {
            "The same frames on the machine of " code { "--preset z2-paper" } ": a thread stops at its first miss. Rates are of first "
            "look-ups and count lines in flight as misses. Merged requests cause no memory traffic, so the product of these rates is "
            "not a traffic figure; the traffic is in the columns on the right. The settings were found by search."
        }
        (table.markup())
        (table.meanings())
    }
}

/// What each trace shows.
fn by_trace(
    report: &PaperReport,
    body: impl Fn(&TraceInfo) -> Result<Markup, PlotError>,
) -> Result<Markup, PlotError> {
    let bodies: Vec<Markup> = report.traces.iter().map(body).collect::<Result<_, _>>()?;
    Ok(html! { @for body in bodies { (body) } })
}

fn bandwidth(report: &PaperReport) -> Result<Markup, PlotError> {
    let traces = report.traces.iter();
    let svgs = traces.map(|info| plots::bandwidth(report, &info.label).svg());
    Ok(html! {
        (charts(svgs)?)
        p.note { "The paper's text gives no absolute traffic. A mark is its ratio to Morton times the measured Morton traffic, for scenes that stand for one of the paper's." }
    })
}

fn rates(report: &PaperReport) -> Result<Markup, PlotError> {
    by_trace(report, |info| {
        charts(plots::rates(report, &info.label).iter().map(BarChart::svg))
    })
}

fn utilisation(report: &PaperReport) -> Result<Markup, PlotError> {
    let closed_form = plots::closed_form(report).map(|chart| chart.svg());
    let svgs = std::iter::once(plots::surface(report)).chain(closed_form);
    let d = &report.closed_form;
    Ok(html! {
        p {
            "Mean absolute deviation from the closed form " strong { (format!("{:.2}", d.mean_absolute_points)) " points" }
            ", largest " (format!("{:.2}", d.largest_points)) " points, over " (d.rows) " rows."
        }
        (charts(svgs)?)
    })
}

fn bounds(report: &PaperReport) -> Markup {
    html! {
        (tables::bounds(report).markup())
        h3 { "Conservation" }
        p { "Every order replays the same multiset of accesses, according to an order-independent hash:" }
        ul {
            @for c in &report.conservation {
                li {
                    (c.scene) ": "
                    @if c.differing.is_empty() { (c.runs) " runs agree (" code { (c.access_hash) } ")" }
                    @else { strong { "differs in " (c.differing.join(", ")) } }
                }
            }
        }
    }
}

fn orders(report: &PaperReport) -> Result<Markup, PlotError> {
    let grid = report.traces.first().map_or(EXAMPLE_TILES, |t| t.tiles);
    let paths = |tiles| {
        let orders = report.orders().into_iter();
        orders.map(move |order| plots::path(order, report.config.seed, tiles))
    };
    let examples = paths(EXAMPLE_TILES).map(|path| path.svg());
    let maps = paths(grid).map(|path| path.steps().svg());
    Ok(html! {
        p { "On 32 tiles per eye, as in the paper's Fig. 3; the numbers are steps." }
        (charts(examples)?)
        p { "On the grid of the traces, " (grid[0]) "\u{d7}" (grid[1]) " tiles per eye:" }
        (charts(maps)?)
    })
}

fn heat_maps(report: &PaperReport) -> Result<Markup, PlotError> {
    by_trace(report, |info| {
        let details = report.details(&info.label);
        let mut svgs = Vec::new();
        for (measure, depends_on_order) in TileMeasure::ALL {
            let mut maps: Vec<_> = details
                .iter()
                .filter_map(|d| plots::heat_map(info, d, measure))
                .take(if depends_on_order { usize::MAX } else { 1 })
                .collect();
            // All orders share one scale.
            let high = maps.iter().map(|m| m.largest()).fold(0.0, f64::max);
            for map in &mut maps {
                map.high = Some(high);
                svgs.push(map.svg());
            }
        }
        Ok(match details.first() {
            Some(first) if !svgs.is_empty() => html! {
                h3 { (info.label) ", L1/L2 " (first.caches_title()) " KiB" } (charts(svgs)?)
            },
            _ => html! {},
        })
    })
}

fn levels(report: &PaperReport) -> Result<Markup, PlotError> {
    by_trace(report, |info| {
        let details = report.details(&info.label);
        let svgs = plots::by_level(&details);
        let table = tables::parts(&details, "mip level", |d| &d.result.by_level, usize::MAX);
        Ok(html! {
            h3 { (info.label) }
            (charts(svgs.iter().map(BarChart::svg))?)
            details { summary { "table" } (table.markup()) }
        })
    })
}

fn parts(report: &PaperReport) -> Result<Markup, PlotError> {
    by_trace(report, |info| {
        let details = report.details(&info.label);
        let (what, all) = (details.first()).map_or(("texture", 0), |d| {
            let (what, parts) = d.result.parts();
            (what, parts.len())
        });
        let svgs = plots::by_part(&details, BUSIEST_PARTS);
        let table = tables::parts(&details, what, |d| d.result.parts().1, BUSIEST_PARTS);
        Ok(html! {
            h3 { (info.label) }
            @if all > BUSIEST_PARTS { p.note { "The " (BUSIEST_PARTS) " of " (all) " " (what) "s with the most external traffic; all are in the JSON." } }
            (charts(svgs.iter().map(HBarChart::svg))?)
            details { summary { "table" } (table.markup()) }
        })
    })
}

fn configuration(report: &PaperReport) -> Markup {
    let orders: Vec<&str> = report.orders().into_iter().map(Order::title).collect();
    let caches = report.caches();
    let mode = report.config.mode_name();
    html! {
        p {
            "Mode " (mode) "; varied: orders " (orders.join(", ")) "; L1/L2 " (caches.join(", ")) " KiB. "
            "All other settings as below. Written by " (TOOL) "."
        }
        (html::settings("full configuration (TOML)", &report.config))
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::with_report;
    use super::*;

    #[test]
    fn the_page_has_every_part_and_is_reproducible() {
        with_report(|report| {
            let text = page(report, &[]).unwrap();
            assert_eq!(text, page(report, &[]).unwrap());
            for part in [
                "Table 2",
                "Fig. 5",
                "paper's surface",
                "Functional against timed",
                "Bounds and checks",
                "Tile orders",
                "Heat maps by tile",
                "By texture",
                "By mip level",
                "line_bytes = 16",
                "crytek-sponza",
                "llvmpipe",
            ] {
                assert!(text.contains(part), "{part}");
            }
            let links = text.matches("http://").count();
            assert_eq!(links, text.matches("http://www.w3.org/2000/svg").count());
        });
    }
}
