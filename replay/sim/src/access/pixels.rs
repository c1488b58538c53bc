//! Colour and depth of an immediate machine, quad by quad through write-back caches.

use super::Traffic;
use super::buffers::Buffers;
use super::vertices::ShadedView;
use super::write_back::WriteBack;
use crate::config::{FrameConfig, RunConfig};
use crate::memory::Client;
use crate::order::{TileRef, WorkItem};
use crate::stream::{StreamError, TileSource};
use formats::textrace::geometry::ViewTarget;
use formats::textrace::{Surfaces, Tables, Tile};
use std::collections::{BTreeMap, HashSet};

/// The pictures and layers of a frame. Every recorded quad passes the depth test. Lines are cleared without
/// traffic until first written; at the end of the frame, colour that was never drawn is written too.
pub(super) struct Pixels {
    blended: Blended,
    colour: Attachment,
    depth: Attachment,
    /// Size and resolved picture of each shown pass.
    passes: Vec<([u32; 2], u64)>,
    /// Bytes per pixel before and after the resolve; none without multisampling.
    resolve_bytes: Option<[u64; 2]>,
    tile: Tile,
}

impl Pixels {
    pub fn new(
        tables: &Tables,
        views: &[ShadedView],
        config: &RunConfig,
        machine: &FrameConfig,
        buffers: &mut Buffers,
    ) -> Self {
        let mut passes = Vec::new();
        let shown = views.iter().filter_map(|view| match view.view.target {
            ViewTarget::Pass(pass) => Some((pass, tables.passes.get(pass as usize)?)),
            ViewTarget::ShadowMap(_) => None,
        });
        let shown: Vec<_> = shown.filter(|(_, pass)| pass.is_seen()).collect();
        for (_, pass) in &shown {
            let pixels = u64::from(pass.size_px[0]) * u64::from(pass.size_px[1]);
            let resolved = buffers.place(pixels * u64::from(machine.color_bytes));
            passes.push((pass.size_px, resolved));
        }
        let mut attachment = |client, bytes| {
            let mut of = Attachment::new(client, bytes * machine.samples, config, machine);
            for (number, pass) in &shown {
                let tiles = pass.size_px.map(|size| size.div_ceil(config.tile_px));
                let lines = of.lines_of_tile() * u64::from(tiles[0]) * u64::from(tiles[1]);
                let first = buffers.place(lines * of.line_bytes) / of.line_bytes;
                of.first_lines.insert(*number, first);
            }
            of
        };
        Self {
            blended: Blended::new(tables.meta.surfaces.as_ref(), tables.draws.len()),
            colour: attachment(Client::Colour, machine.color_bytes),
            depth: attachment(Client::Depth, machine.depth_bytes),
            passes,
            resolve_bytes: (machine.samples > 1).then(|| {
                let bytes = u64::from(machine.color_bytes);
                [bytes * u64::from(machine.samples), bytes]
            }),
            tile: Tile::default(),
        }
    }

    /// Draws the quads of an item on a core.
    pub fn item(
        &mut self,
        core: usize,
        item: &WorkItem,
        source: &dyn TileSource,
        traffic: &mut Traffic,
    ) -> Result<(), StreamError> {
        let tile = &mut self.tile;
        for at in item.tiles() {
            source.read_tile(at.pass, at.tile, tile)?;
            for run in &tile.runs {
                let records = &tile.records[run.first as usize..(run.first + run.count) as usize];
                let mut last = None;
                for record in records {
                    // Several uv groups of a quad are one access.
                    let place = [record.x, record.y].map(u32::from);
                    if last.replace(place) == Some(place) {
                        continue;
                    }
                    let quad = place.map(|p| 2 * p);
                    // Depth is tested, and written unless the draw blends.
                    let blends = self.blended.has(run.draw);
                    self.depth.quad(core, at, quad, [true, !blends], traffic);
                    self.colour.quad(core, at, quad, [blends, true], traffic);
                }
            }
        }
        Ok(())
    }

    /// Writes back modified lines, clears the colour of undrawn lines, and resolves samples.
    pub fn finish(mut self, traffic: &mut Traffic) {
        self.colour.flush(traffic);
        self.colour.clear_rest(&self.passes, traffic);
        self.depth.flush(traffic);
        if let Some([sampled, resolved]) = self.resolve_bytes {
            let firsts: Vec<u64> = self.colour.first_lines.values().copied().collect();
            for ((size_px, picture), first) in self.passes.iter().zip(firsts) {
                let pixels = u64::from(size_px[0]) * u64::from(size_px[1]);
                let samples = first * self.colour.line_bytes;
                traffic.read(Client::Colour, samples, pixels * sampled);
                traffic.write(Client::Colour, *picture, pixels * resolved);
            }
        }
    }
}

/// Whether each draw is not opaque.
struct Blended(Vec<bool>);

impl Blended {
    fn new(surfaces: Option<&Surfaces>, draws: usize) -> Self {
        let mut blended = vec![false; draws];
        for [first, count] in surfaces.iter().flat_map(|surfaces| &surfaces.not_opaque) {
            let end = (first.saturating_add(*count) as usize).min(draws);
            blended[(*first as usize).min(end)..end].fill(true);
        }
        Self(blended)
    }

    fn has(&self, draw: u32) -> bool {
        self.0.get(draw as usize).copied().unwrap_or(false)
    }
}

/// An attachment of every pass, with one cache per core and the lines present in memory.
struct Attachment {
    client: Client,
    caches: Vec<WriteBack>,
    in_memory: HashSet<u64>,
    /// Pixels per line: columns and rows, powers of two.
    block: [u32; 2],
    line_bytes: u64,
    tile_px: u32,
    /// By pass.
    first_lines: BTreeMap<u32, u64>,
}

impl Attachment {
    fn new(client: Client, pixel_bytes: u32, config: &RunConfig, machine: &FrameConfig) -> Self {
        let pixels = (machine.line_bytes / pixel_bytes.next_power_of_two()).max(1);
        let columns = 1 << pixels.ilog2().div_ceil(2);
        let lines = machine.pixel_cache_bytes / u64::from(machine.line_bytes);
        Self {
            client,
            caches: (0..config.cores).map(|_| WriteBack::new(lines)).collect(),
            in_memory: HashSet::new(),
            block: [columns, pixels / columns],
            line_bytes: machine.line_bytes.into(),
            tile_px: config.tile_px,
            first_lines: BTreeMap::new(),
        }
    }

    fn lines_of_tile(&self) -> u64 {
        let [columns, rows] = self.block.map(|pixels| u64::from(self.tile_px / pixels));
        columns * rows
    }

    /// The line of a pixel. Lines of a tile are consecutive, and so are the tiles.
    fn line(&self, at: TileRef, [x, y]: [u32; 2]) -> u64 {
        let columns = self.tile_px / self.block[0];
        let in_tile = y / self.block[1] * columns + x / self.block[0];
        let first = self.first_lines.get(&at.pass).copied().unwrap_or(0);
        first + u64::from(at.tile) * self.lines_of_tile() + u64::from(in_tile)
    }

    /// Accesses a quad at its top left pixel in a tile. `reads`: earlier values are read; `writes`: new
    /// values are written.
    fn quad(
        &mut self,
        core: usize,
        tile: TileRef,
        at: [u32; 2],
        [reads, writes]: [bool; 2],
        traffic: &mut Traffic,
    ) {
        let mut lines = [u64::MAX; 4];
        for (lane, line) in (0_u32..).zip(&mut lines) {
            *line = self.line(tile, [at[0] + (lane & 1), at[1] + (lane >> 1)]);
        }
        for (lane, &line) in lines.iter().enumerate() {
            if lines[..lane].contains(&line) {
                continue;
            }
            let effect = self.caches[core].access(line, writes);
            if effect.missed && reads && self.in_memory.contains(&line) {
                traffic.read(self.client, line * self.line_bytes, self.line_bytes);
            }
            if let Some(evicted) = effect.evicted {
                self.in_memory.insert(evicted);
                traffic.write(self.client, evicted * self.line_bytes, self.line_bytes);
            }
        }
    }

    /// Writes back modified lines.
    fn flush(&mut self, traffic: &mut Traffic) {
        for cache in &mut self.caches {
            for line in cache.flush() {
                self.in_memory.insert(line);
                traffic.write(self.client, line * self.line_bytes, self.line_bytes);
            }
        }
    }

    /// Writes the lines of the passes that were never drawn.
    fn clear_rest(&self, passes: &[([u32; 2], u64)], traffic: &mut Traffic) {
        let lines = |(size_px, _): &([u32; 2], u64)| {
            let [columns, rows] =
                [0, 1].map(|a: usize| u64::from(size_px[a].div_ceil(self.block[a])));
            columns * rows
        };
        let all: u64 = passes.iter().map(lines).sum();
        let undrawn = all.saturating_sub(self.in_memory.len() as u64);
        let first = self.first_lines.values().next().copied().unwrap_or(0);
        traffic.write(
            self.client,
            first * self.line_bytes,
            undrawn * self.line_bytes,
        );
    }
}
