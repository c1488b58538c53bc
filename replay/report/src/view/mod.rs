//! The page of `replay view`: each tile's counts in some orders, when it was rendered, and what the L2 held. Its script
//! draws maps and plays the orders; see `maps.js` and `charts.js`.

mod markup;
mod pack;
mod parts;
mod times;

pub(super) use markup::{ramp, viewer};

use super::answers;
use super::html::{self, Answer, Page, count};
use super::picture::EmbeddedPicture;
use super::plots::heatmap;
use super::run;
use super::z2::whole_frame;
use formats::textrace::{Pass, PassKind, Tables};
use markup::{hex, meanings};
use maud::html;
use pack::{Packed, packed};
use parts::{Maps, PartSums, Parts};
use serde::Serialize;
use sim::result::{RunResult, TileMap};
use studies::experiment::{
    Counts, FULL, FrameContent, FrameTiles, L2Content, PassTiles, ResultRow, STEPS, frame_tiles,
};
use times::{PassTimes, Times};

/// Frames that would make the data larger are left out.
const MOST_DATA_BYTES: usize = 4_900_000;

/// Replays of a trace with tile maps and timelines, in one or more orders.
pub struct ViewReport<'a> {
    /// The replays.
    pub rows: &'a [ResultRow<'a>],
    /// The same replays, counted by draw.
    pub draws: &'a [ResultRow<'a>],
    /// Rendered picture of both eyes.
    pub picture: Option<&'a EmbeddedPicture>,
}

/// The data of the page's script.
#[derive(Serialize)]
struct Data<'a> {
    line_bytes: u32,
    /// Steps of a frame's time, and the share of a tile of which all lines are in the L2.
    steps: u32,
    full: u8,
    /// Lines that fit into all L2 caches.
    l2_lines: u64,
    /// 256 colours of the maps, six digits each.
    ramp: String,
    picture: Option<String>,
    draws: Vec<&'a str>,
    textures: Vec<&'a str>,
    levels: usize,
    runs: Vec<Run<'a>>,
    parts: Vec<Parts>,
    reads: Maps,
    frames: Vec<Frame>,
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
struct Frame {
    number: u32,
    /// By run; absent if the content of the L2 is not recorded.
    l2: Vec<Option<FrameL2>>,
    passes: Vec<PassData>,
}

/// The L2 over a frame, at its start and at the end of each step.
#[derive(Serialize)]
struct FrameL2 {
    /// Lines of the left eye only, the right eye only, both, and neither.
    lines: [Packed; 4],
    /// Lines that entered since the value before.
    entered: Packed,
}

/// A pass; lists have a number for each tile, row by row.
#[derive(Serialize)]
struct PassData {
    name: String,
    /// Half of the picture that shows the pass.
    eye: Option<u32>,
    size_px: [u32; 2],
    tiles: [u32; 2],
    footprints: Packed,
    /// Covered pixels over all, percent.
    overdraw_pct: Packed,
    lines: Packed,
    shared_lines: Packed,
    /// Quads by draw, and distinct lines by texture and mip level: distance from the tile before, count, and so on.
    draws: Vec<(u32, Packed)>,
    textures: Vec<(u32, Packed)>,
    levels: Vec<(u32, Packed)>,
    runs: Vec<TileRun>,
}

/// The tiles in an order.
#[derive(Serialize)]
struct TileRun {
    l1_misses: Packed,
    l2_misses: Packed,
    #[serde(flatten)]
    times: PassTimes,
    /// Share of each tile's lines in the L2 over the steps.
    in_l2: Packed,
}

impl<'a> ViewReport<'a> {
    /// The page, and the number of frames that it leaves out.
    ///
    /// # Errors
    /// A trace that cannot be read, or a page that cannot be written.
    pub fn page(&self) -> anyhow::Result<(String, usize)> {
        let Some(first) = self.rows.first() else {
            return Ok(Default::default());
        };
        let (source, config) = (first.subject.source, &first.point.config);
        let tables = source.tables();
        let (mut sums, mut frames, mut bytes) = (PartSums::default(), Vec::new(), 0);
        let mut contents: Vec<L2Content> = self.rows.iter().map(|_| L2Content::default()).collect();
        let mut index = 0;
        frame_tiles(source, config, |mut tiles: FrameTiles| {
            if bytes <= MOST_DATA_BYTES {
                let frame = self.frame(&tables.passes, index, &tiles, &mut contents);
                let size = serde_json::to_string(&frame)?.len();
                bytes += size;
                frames.push((frame, size));
            }
            index += 1;
            sums.add(&mut tiles);
            anyhow::Ok(())
        })?;
        let mut data = self.data(tables, &sums)?;
        let mut bytes = serde_json::to_string(&data)?.len();
        for (frame, size) in frames {
            bytes += size;
            if bytes > MOST_DATA_BYTES && !data.frames.is_empty() {
                break;
            }
            data.frames.push(frame);
        }
        let left_out = index - data.frames.len();
        // Names may contain the end of a script.
        let json = serde_json::to_string(&data)?.replace('<', "\\u003c");
        let mut page = Page::default();
        let titles = self.rows.iter().map(|row| row.point.config.order.title());
        page.add("Tiles", viewer(&titles.collect::<Vec<_>>(), &json, true));
        page.add("By eye, mip level, texture and draw", markup::parts());
        let rows: Vec<&ResultRow<'_>> = self.rows.iter().collect();
        if rows.iter().any(|row| !row.result.clients.is_empty()) {
            page.add(
                "Traffic by client",
                whole_frame::of_orders(&first.subject.label, &rows)?,
            );
        }
        page.add("What the maps show", meanings());
        page.add("Machine", html::settings("configuration (TOML)", config));
        let answer = Answer {
            sentences: self.sentences(),
            chart: html! {},
            about: html! {
                p { "Each tile of the frame, in the order in which the cores render it. Counts are those of " code { "replay run --tiles" } "." }
                @if left_out > 0 { p { "The page has the first " (count(data.frames.len(), "frame")) "; " (left_out) " more would exceed 5 MB." } }
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

    fn data(&self, tables: &'a Tables, sums: &PartSums) -> anyhow::Result<Data<'a>> {
        let config = &self.rows[0].point.config;
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
        let l2 = &config.level.l2;
        let textures = tables.textures.iter();
        Ok(Data {
            line_bytes: config.line_bytes,
            steps: STEPS,
            full: FULL,
            l2_lines: l2.size_bytes / u64::from(config.line_bytes)
                * u64::from(l2.caches(config.cores)),
            ramp: ramp(),
            picture: self.picture.map(EmbeddedPicture::data_uri),
            draws: (tables.draws.iter())
                .map(|draw| draw.material.as_str())
                .collect(),
            levels: textures
                .clone()
                .map(|of| of.levels as usize)
                .max()
                .unwrap_or(0),
            textures: textures.map(|of| of.name.as_str()).collect(),
            runs: runs.collect(),
            parts: sums.parts(self.rows, self.draws),
            reads: sums.maps(tables, config)?,
            frames: Vec::new(),
        })
    }

    /// The frame with this index.
    fn frame(
        &self,
        passes: &[Pass],
        index: usize,
        tiles: &FrameTiles,
        contents: &mut [L2Content],
    ) -> Frame {
        let numbers: Vec<u32> = tiles.passes.iter().map(|(pass, _)| *pass).collect();
        let runs: Vec<OfRun<'_>> = (self.rows.iter().zip(contents))
            .map(|(row, content)| {
                let timeline = row.result.timeline.as_ref();
                let times = Times::new(timeline, &numbers);
                let changes = timeline.and_then(|of| of.l2_changes.get(index));
                let l2 = changes.map(|of| content.follow(of, times.cycles, tiles));
                OfRun {
                    result: row.result,
                    times,
                    l2,
                }
            })
            .collect();
        let l2 = |run: &OfRun<'_>| {
            let content = run.l2.as_ref()?;
            Some(FrameL2 {
                lines: content.lines.each_ref().map(packed),
                entered: packed(&content.entered),
            })
        };
        Frame {
            number: tiles.number,
            l2: runs.iter().map(l2).collect(),
            passes: (tiles.passes.iter().enumerate())
                .filter_map(|(at, (pass, of))| {
                    PassData::new(at, *pass, &passes[*pass as usize], of, &runs)
                })
                .collect(),
        }
    }
}

/// A frame in an order.
struct OfRun<'a> {
    result: &'a RunResult,
    times: Times,
    l2: Option<FrameContent>,
}

impl OfRun<'_> {
    fn map(&self, pass: u32) -> Option<&TileMap> {
        self.result.tile_maps.iter().find(|map| map.pass == pass)
    }
}

impl PassData {
    /// The pass at `at` in the frame.
    fn new(
        at: usize,
        number: u32,
        pass: &Pass,
        of: &PassTiles,
        runs: &[OfRun<'_>],
    ) -> Option<Self> {
        let first = runs.first()?.map(number)?;
        let tile_run = |run: &OfRun<'_>| {
            let map = run.map(number)?;
            let shares = run.l2.as_ref().map_or(&[][..], |l2| &l2.shares[at]);
            Some(TileRun {
                l1_misses: packed(&map.l1_misses),
                l2_misses: packed(&map.l2_misses),
                times: run.times.of_pass(map),
                in_l2: pack::shares(shares),
            })
        };
        let is_of_eye = pass.is_seen() && pass.layer == 0;
        let overdraw = first.overdraw.iter();
        Some(Self {
            name: pass_name(pass),
            eye: pass.eye.filter(|_| is_of_eye).map(|eye| eye as u32),
            size_px: pass.size_px,
            tiles: first.tiles,
            footprints: packed(&first.footprints),
            overdraw_pct: overdraw.map(|of| (100.0 * of).round() as u32).collect(),
            lines: of.lines.iter().map(|lines| lines.len() as u32).collect(),
            shared_lines: packed(&of.shared_lines),
            draws: deltas(&of.draws),
            textures: deltas(&of.textures),
            levels: deltas(&of.levels),
            runs: runs.iter().filter_map(tile_run).collect(),
        })
    }
}

fn deltas(counts: &Counts) -> Vec<(u32, Packed)> {
    let list = |list: &Vec<[u32; 2]>| {
        let mut before = 0;
        let pair = |[tile, count]: &[u32; 2]| {
            let delta = tile - std::mem::replace(&mut before, *tile);
            [delta, *count]
        };
        list.iter().flat_map(pair).collect()
    };
    counts.iter().map(|(part, of)| (*part, list(of))).collect()
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
