//! The controls and canvases of the page, which its script fills.

use super::heatmap;
use maud::{Markup, PreEscaped, html};
use plotters::style::RGBColor;

/// One script, in parts that share their names.
const SCRIPTS: [&str; 5] = [
    include_str!("data.js"),
    include_str!("maps.js"),
    include_str!("charts.js"),
    include_str!("parts.js"),
    include_str!("controls.js"),
];
const STYLE: &str = include_str!("style.css");

/// Whose lines the L2 holds: name and colour, in the order of the data.
const OWNERS: [(&str, &str); 4] = [
    ("left eye only", "#56b4e9"),
    ("right eye only", "#cc79a7"),
    ("both eyes", "#009e73"),
    ("neither eye of this frame", "#8a919a"),
];

/// 256 colours of the maps, six digits each.
pub(crate) fn ramp() -> String {
    (0..256)
        .map(|step| hex(heatmap::color(f64::from(step) / 255.0)))
        .collect()
}

pub(super) fn hex(RGBColor(red, green, blue): RGBColor) -> String {
    format!("{red:02x}{green:02x}{blue:02x}")
}

/// A figure for each title. Maps without time are not `animated`.
pub(crate) fn viewer(titles: &[&str], json: &str, animated: bool) -> Markup {
    html! {
        style { (PreEscaped(STYLE)) }
        div #view {
            div.controls {
                button #view-play type="button" hidden[!animated] { "Play" }
                label hidden[!animated] { "progress " input #view-at type="range" min="0" max="1000" value="1000"; }
                label hidden[!animated] { "advance by " select #view-by { option value="time" { "time" } option value="work" { "tiles" } } }
                label hidden[!animated] { "length " select #view-speed { option value="40" { "40 s" } option value="10" selected { "10 s" } option value="3" { "3 s" } } }
                label { "show " select #view-metric {} }
                label hidden[!animated] { "only " select #view-part {} }
                label #view-frames { "frame " input #view-frame type="range" min="0" value="0"; output #view-number {} }
            }
            div.scale {
                span { "0" } span #view-ramp role="img" aria-label="colour scale" {} span #view-most {}
                @if animated { span.now { "in work" } span.missed hidden { "misses just now" } }
            }
            div.orders {
                @for (number, title) in titles.iter().enumerate() {
                    figure {
                        figcaption #{ "view-name-" (number) } { (title) }
                        div.stack {
                            canvas.still aria-hidden="true" {}
                            canvas.map tabindex="0" role="img" aria-labelledby={ "view-name-" (number) } aria-describedby="view-keys" {}
                            canvas.grid aria-hidden="true" {}
                        }
                        canvas.l2 role="img" aria-label={ "Lines in the L2 over the frame by eye, and lines fetched: " (title) } hidden[!animated] {}
                    }
                }
            }
            div.owners hidden[!animated] {
                span { "lines in the L2 of" }
                @for (name, color) in OWNERS { span { i style={ "background:" (color) } {} (name) } }
                span { "below: lines fetched" }
            }
            output #view-tile aria-live="polite" {}
            div #view-reads hidden {
                output #view-reads-name aria-live="polite" {}
                div.textures {}
            }
            div.scroll tabindex="0" role="region" aria-label="counts so far" hidden[!animated] { table #view-counts {} }
            figure hidden[!animated] {
                canvas #view-curve role="img" aria-label="Bytes from DRAM over the frame, by order" {}
                figcaption #view-curve-name {}
            }
            p.note #view-keys {
                "Keys on a map: arrows choose a tile"
                @if animated { ", Space plays, comma and full stop step by a tile, Home and End go to the start and the end" }
                "."
            }
        }
        script #view-data type="application/json" { (PreEscaped(json)) }
        script type="module" { (PreEscaped(SCRIPTS.concat())) }
    }
}

/// The table of parts.
pub(super) fn parts() -> Markup {
    html! {
        div.parts {
            label { "by " select #view-kind {} }
            div.scroll.tall tabindex="0" role="region" aria-label="counts by part" { table #view-parts {} }
        }
    }
}

pub(super) fn meanings() -> Markup {
    html! {
        dl {
            dt { "footprints" } dd { "Bilinear fetches. The same in every order." }
            dt { "covered pixels" } dd { "Covered pixels of all triangles over the tile's pixels, percent: overdraw. The same in every order." }
            dt { "L1 misses" } dd { "Footprints with a line that the core's L1 lacks." }
            dt { "L2 misses" } dd { "Lines that the L2 fetches from below." }
            dt { "bytes from DRAM" } dd { "These lines times the size of a line." }
            dt { "in the L2 now" } dd { "Share of the tile's distinct lines that are in the L2 at this place of the animation, in sevenths (0 only for none, 7 only for all), whether the tile is rendered already or not. The order's time has 64 steps. Orange dots: tiles that ended within the last eighth of a step, the larger the more L2 misses." }
            dt { "shared with the other eye" } dd { "Distinct lines of the tile that the other eye touches in this frame as well, percent. Only these can be reused between the eyes." }
            dt { "order of work" } dd { "The tile's place in the order, from dark to bright." }
            dt { "only" } dd { "Distinct lines of one mip level or texture in each tile, or quads of one draw. Of a texture or draw, the rectangles show which texels of each level lie in lines that are read, in all frames; the trace has no texel colours." }
        }
    }
}
