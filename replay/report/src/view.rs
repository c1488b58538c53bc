//! The page of `replay view`: each tile's counts in some orders, and when it was rendered. Its script draws maps and
//! plays the orders; see `view/script.js`.

use super::answers;
use super::html::{self, Answer, Page, count};
use super::lists::unique;
use super::picture::EmbeddedPicture;
use super::plots::heatmap;
use super::run;
use formats::textrace::{Pass, PassKind, Tables};
use maud::{Markup, PreEscaped, html};
use plotters::style::RGBColor;
use serde::Serialize;
use sim::result::{TileMap, Timeline};
use studies::experiment::{PassTiles, ResultRow};

const SCRIPT: &str = include_str!("view/script.js");
const STYLE: &str = include_str!("view/style.css");

/// Frames that would make the data larger are left out.
const MOST_DATA_BYTES: usize = 4_900_000;

/// Replays of a trace with tile maps and timelines, in one or more orders.
pub struct ViewReport<'a> {
    /// The replays.
    pub rows: &'a [ResultRow<'a>],
    /// What the tiles of each pass hold.
    pub tiles: &'a [PassTiles],
    /// Rendered picture of both eyes.
    pub picture: Option<&'a EmbeddedPicture>,
}

/// The data of the page's script.
#[derive(Serialize)]
struct Data<'a> {
    line_bytes: u32,
    /// 256 colours of the maps, six digits each.
    ramp: String,
    picture: Option<String>,
    draws: Vec<&'a str>,
    textures: Vec<TextureDraws<'a>>,
    runs: Vec<Run<'a>>,
    frames: Vec<Frame<'a>>,
}

/// A texture and the draws that sample it.
#[derive(Serialize)]
struct TextureDraws<'a> {
    name: &'a str,
    draws: Vec<usize>,
}

/// Counts of a replay, all frames together.
#[derive(Serialize)]
struct Run<'a> {
    order: &'a str,
    title: &'a str,
    color: String,
    footprints: u64,
    l1_misses: u64,
    l2_misses: u64,
    external_bytes: u64,
    cycles: u64,
}

#[derive(Serialize)]
struct Frame<'a> {
    number: u32,
    passes: Vec<PassData<'a>>,
}

/// A pass; lists have a number for each tile, row by row.
#[derive(Serialize)]
struct PassData<'a> {
    name: String,
    /// Half of the picture that shows the pass.
    eye: Option<u32>,
    size_px: [u32; 2],
    tiles: [u32; 2],
    footprints: &'a [u32],
    /// Covered pixels over all, percent.
    overdraw_pct: Vec<u32>,
    lines: &'a [u32],
    shared_lines: &'a [u32],
    /// By draw: distance from the tile before, quads, and so on.
    draws: Vec<(u32, Vec<u32>)>,
    runs: Vec<TileRun<'a>>,
}

/// When each tile was rendered in an order, in cycles since the start of the frame, and what it missed.
#[derive(Serialize)]
struct TileRun<'a> {
    l1_misses: &'a [u32],
    l2_misses: &'a [u32],
    core: Vec<u32>,
    start: Vec<u32>,
    end: Vec<u32>,
}

impl<'a> ViewReport<'a> {
    /// The page, and the frames that it leaves out.
    ///
    /// # Errors
    /// A number that JSON cannot hold.
    pub fn page(&self) -> serde_json::Result<(String, Vec<u32>)> {
        let Some(first) = self.rows.first() else {
            return Ok(Default::default());
        };
        let tables = first.subject.source.tables();
        let mut data = self.data(tables);
        let (mut bytes, mut left_out) = (serde_json::to_string(&data)?.len(), Vec::new());
        let passes = &tables.passes;
        for number in unique(passes.iter().map(|pass| pass.frame)) {
            let frame = self.frame(passes, number);
            bytes += serde_json::to_string(&frame)?.len();
            match bytes > MOST_DATA_BYTES && !data.frames.is_empty() {
                true => left_out.push(number),
                false => data.frames.push(frame),
            }
        }
        // Names may contain the end of a script.
        let json = serde_json::to_string(&data)?.replace('<', "\\u003c");
        let mut page = Page::default();
        let titles = self.rows.iter().map(|row| row.point.config.order.title());
        page.add("Tiles", viewer(&titles.collect::<Vec<_>>(), &json, true));
        page.add("What the maps show", meanings());
        page.add(
            "Machine",
            html::settings("configuration (TOML)", &first.point.config),
        );
        let answer = Answer {
            sentences: self.sentences(),
            chart: html! {},
            about: html! {
                p { "Each tile of the frame, in the order in which the cores render it. Counts are those of " code { "replay run --tiles" } "." }
                @if !left_out.is_empty() { p { "The page has the first " (count(data.frames.len(), "frame")) "; " (left_out.len()) " more would exceed 5 MB." } }
            },
        };
        let title = format!("{}: tiles and orders", first.subject.label);
        Ok((page.text(&title, &answer), left_out))
    }

    /// The traffic of each order; the machine once.
    fn sentences(&self) -> Vec<String> {
        let mut out: Vec<String> = Vec::new();
        for row in self.rows {
            let own = run::answer(row);
            let new: Vec<String> = own.into_iter().filter(|s| !out.contains(s)).collect();
            out.extend(new);
        }
        // The machine is the last sentence of the first order.
        if let Some(at) = out.iter().position(|s| s.starts_with(answers::MACHINE)) {
            let machine = out.remove(at);
            out.push(machine);
        }
        out
    }

    fn data(&self, tables: &'a Tables) -> Data<'a> {
        let runs = self.rows.iter().map(|row| {
            let (order, result) = (row.point.config.order, row.result);
            Run {
                order: order.name(),
                title: order.title(),
                color: hex(crate::theme::color(order.color())),
                footprints: result.footprints,
                l1_misses: result.l1.counters.footprint_misses,
                l2_misses: result.l2.counters.line_misses,
                external_bytes: result.external_bytes,
                cycles: result.cycles.unwrap_or(0),
            }
        });
        let samples = |draw: usize, texture: u32| {
            let groups = tables.draws[draw].groups.iter();
            groups
                .flat_map(|group| &group.samples)
                .any(|s| s.texture == texture)
        };
        let textures = (0..)
            .zip(&tables.textures)
            .map(|(number, texture)| TextureDraws {
                name: &texture.name,
                draws: (0..tables.draws.len())
                    .filter(|&draw| samples(draw, number))
                    .collect(),
            });
        Data {
            line_bytes: self
                .rows
                .first()
                .map_or(0, |row| row.point.config.line_bytes),
            ramp: ramp(),
            picture: self.picture.map(EmbeddedPicture::data_uri),
            draws: tables
                .draws
                .iter()
                .map(|draw| draw.material.as_str())
                .collect(),
            textures: textures.collect(),
            runs: runs.collect(),
            frames: Vec::new(),
        }
    }

    fn frame(&self, passes: &[Pass], number: u32) -> Frame<'a> {
        let of_frame = || (0..).zip(passes).filter(|(_, pass)| pass.frame == number);
        let of_frame_numbers: Vec<u32> = of_frame().map(|(pass, _)| pass).collect();
        let times: Vec<_> = (self.rows.iter())
            .map(|row| Times::new(row.result.timeline.as_ref(), &of_frame_numbers))
            .collect();
        let pass_data = |(number, pass): (u32, &Pass)| {
            let maps = self.rows.iter().filter_map(move |row| {
                let maps = &row.result.tile_maps;
                maps.iter().find(|map| map.pass == number)
            });
            let maps: Vec<&TileMap> = maps.collect();
            let first = *maps.first()?;
            let tiles = &self.tiles[number as usize];
            let runs = maps
                .iter()
                .zip(&times)
                .map(|(map, times)| times.of_pass(map));
            let draws = tiles
                .draws
                .iter()
                .map(|(draw, counts)| (*draw, deltas(counts)));
            Some(PassData {
                name: pass_name(pass),
                eye: (pass.is_seen() && pass.layer == 0)
                    .then(|| pass.eye.map(|eye| eye as u32))
                    .flatten(),
                size_px: pass.size_px,
                tiles: first.tiles,
                footprints: &first.footprints,
                overdraw_pct: first
                    .overdraw
                    .iter()
                    .map(|of| (100.0 * of).round() as u32)
                    .collect(),
                lines: &tiles.lines,
                shared_lines: &tiles.shared_lines,
                draws: draws.collect(),
                runs: runs.collect(),
            })
        };
        Frame {
            number,
            passes: of_frame().filter_map(pass_data).collect(),
        }
    }
}

/// 256 colours of the maps, six digits each.
pub(super) fn ramp() -> String {
    (0..256)
        .map(|step| hex(heatmap::color(f64::from(step) / 255.0)))
        .collect()
}

/// The controls and canvases, which the script fills: a figure for each title. Maps without time are not `animated`.
pub(super) fn viewer(titles: &[&str], json: &str, animated: bool) -> Markup {
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
            div.scale { span { "0" } span #view-ramp role="img" aria-label="colour scale" {} span #view-most {} span.now hidden[!animated] { "in work" } }
            div.orders {
                @for (number, title) in titles.iter().enumerate() {
                    figure {
                        figcaption #{ "view-name-" (number) } { (title) }
                        canvas tabindex="0" role="img" aria-labelledby={ "view-name-" (number) } aria-describedby="view-keys" {}
                    }
                }
            }
            output #view-tile aria-live="polite" {}
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
        script { (PreEscaped(SCRIPT)) }
    }
}

/// When the tiles of a frame were rendered.
struct Times {
    start: u64,
    /// Pass, tile, core, start and end.
    tiles: Vec<(u32, u32, u32, [u64; 2])>,
}

impl Times {
    fn new(timeline: Option<&Timeline>, passes: &[u32]) -> Self {
        let items = timeline.map_or(&[][..], |timeline| &timeline.items);
        let mut tiles = Vec::new();
        for item in items {
            let of_frame = item.tiles.iter().filter(|at| passes.contains(&at.pass));
            let times = [item.start_cycle, item.end_cycle];
            tiles.extend(of_frame.map(|at| (at.pass, at.tile, item.core, times)));
        }
        Self {
            start: tiles.iter().map(|tile| tile.3[0]).min().unwrap_or(0),
            tiles,
        }
    }

    /// The times since the start of the frame. A tile that is rendered in parts lasts from its first to its last part.
    fn of_pass<'a>(&self, map: &'a TileMap) -> TileRun<'a> {
        let tiles = map.footprints.len();
        let mut out = TileRun {
            l1_misses: &map.l1_misses,
            l2_misses: &map.l2_misses,
            core: vec![0; tiles],
            start: vec![u32::MAX; tiles],
            end: vec![0; tiles],
        };
        for (_, tile, core, times) in self.tiles.iter().filter(|tile| tile.0 == map.pass) {
            let [start, end] = times.map(|cycle| (cycle - self.start) as u32);
            let tile = *tile as usize;
            out.core[tile] = *core;
            out.start[tile] = out.start[tile].min(start);
            out.end[tile] = out.end[tile].max(end);
        }
        for (start, end) in out.start.iter_mut().zip(&out.end) {
            *start = (*start).min(*end);
        }
        out
    }
}

fn deltas(counts: &[[u32; 2]]) -> Vec<u32> {
    let mut before = 0;
    let pair = |[tile, quads]: &[u32; 2]| {
        let delta = tile - before;
        before = *tile;
        [delta, *quads]
    };
    counts.iter().flat_map(pair).collect()
}

fn pass_name(pass: &Pass) -> String {
    let layer = match pass.layer {
        0 => String::new(),
        layer => format!(", layer {layer}"),
    };
    match (pass.kind, pass.eye) {
        (PassKind::Shadow, _) => "shadow map".to_owned(),
        (_, Some(eye)) => format!("{eye} eye{layer}"),
        (_, None) => format!("both eyes{layer}"),
    }
}

fn hex(RGBColor(red, green, blue): RGBColor) -> String {
    format!("{red:02x}{green:02x}{blue:02x}")
}

fn meanings() -> Markup {
    html! {
        dl {
            dt { "footprints" } dd { "Bilinear fetches. The same in every order." }
            dt { "covered pixels" } dd { "Covered pixels of all triangles over the tile's pixels, percent: overdraw. The same in every order." }
            dt { "L1 misses" } dd { "Footprints with a line that the core's L1 lacks." }
            dt { "L2 misses" } dd { "Lines that the L2 fetches from below." }
            dt { "bytes from DRAM" } dd { "These lines times the size of a line." }
            dt { "shared with the other eye" } dd { "Distinct lines of the tile that the other eye touches in this frame as well, percent. Only these can be reused between the eyes." }
            dt { "order of work" } dd { "The tile's place in the order, from dark to bright." }
            dt { "only" } dd { "Quads of one draw, or of the draws that sample one texture." }
        }
    }
}
