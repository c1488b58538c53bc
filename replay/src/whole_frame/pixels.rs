//! Colour and depth of an immediate machine: quad by quad through write-back caches.

use super::Traffic;
use super::write_back::WriteBack;
use crate::access::{Client, FrameConfig};
use crate::config::RunConfig;
use crate::order::{Phase, TileRef};
use crate::stream::{StreamError, TileSource};
use formats::textrace::{Pass, Surfaces, Tile};
use formats::view::TILE_SIZE_PX;
use std::collections::HashSet;

/// Renders the pictures and layers of a frame. Every recorded quad passes the depth test; lines are cleared without
/// traffic until they are written for the first time, and at the end of the frame colour that was never drawn is.
pub(super) fn render(
    source: &dyn TileSource,
    config: &RunConfig,
    machine: &FrameConfig,
    frame: u32,
    phases: &[Phase],
    traffic: &mut Traffic,
) -> Result<(), StreamError> {
    let tables = source.tables();
    let blended = Blended::new(tables.meta.surfaces.as_ref(), tables.draws.len());
    let sample_bytes = |bytes: u32| bytes * machine.samples;
    let mut attachments = [
        Attachment::new(
            Client::Colour,
            sample_bytes(machine.color_bytes),
            config,
            machine,
        ),
        Attachment::new(
            Client::Depth,
            sample_bytes(machine.depth_bytes),
            config,
            machine,
        ),
    ];
    let mut tile = Tile::default();
    for (number, item) in phases.iter().flatten().enumerate() {
        let core = number % config.cores as usize;
        for at in item.tiles() {
            source.read_tile(at.pass, at.tile, &mut tile)?;
            for run in &tile.runs {
                let records = &tile.records[run.first as usize..(run.first + run.count) as usize];
                let mut last = None;
                for record in records {
                    // Several groups of one quad are one access.
                    let place = [record.x, record.y].map(u32::from);
                    if last.replace(place) == Some(place) {
                        continue;
                    }
                    let quad = place.map(|p| 2 * p);
                    let [colour, depth] = &mut attachments;
                    // Depth is tested, then written unless the draw blends.
                    let blends = blended.has(run.draw);
                    depth.quad(core, at, quad, [true, !blends], traffic);
                    colour.quad(core, at, quad, [blends, true], traffic);
                }
            }
        }
    }
    let rendered = || {
        tables
            .passes
            .iter()
            .filter(|pass| pass.frame == frame && pass.is_seen())
    };
    let [mut colour, mut depth] = attachments;
    colour.finish(rendered(), true, traffic);
    depth.finish(rendered(), false, traffic);
    if machine.samples > 1 {
        // The resolve reads all samples and writes a pixel.
        for pass in rendered() {
            let pixels = u64::from(pass.size_px[0]) * u64::from(pass.size_px[1]);
            traffic.read(
                Client::Colour,
                pixels * u64::from(sample_bytes(machine.color_bytes)),
            );
            traffic.write(Client::Colour, pixels * u64::from(machine.color_bytes));
        }
    }
    Ok(())
}

/// Draws that are not opaque.
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

/// An attachment of every pass: caches by core, and the lines that memory holds.
struct Attachment {
    client: Client,
    caches: Vec<WriteBack>,
    in_memory: HashSet<u64>,
    /// Pixels of a line: columns and rows, powers of two.
    block: [u32; 2],
    line_bytes: u64,
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
        }
    }

    /// The line of a pixel: lines of a tile lie one behind the other, and the tiles, too.
    fn line(&self, at: TileRef, [x, y]: [u32; 2]) -> u64 {
        let columns = TILE_SIZE_PX / self.block[0];
        let in_tile = y / self.block[1] * columns + x / self.block[0];
        let of_tile = columns * (TILE_SIZE_PX / self.block[1]);
        u64::from(at.pass) << 40 | (u64::from(at.tile) * u64::from(of_tile) + u64::from(in_tile))
    }

    /// A quad at its top left pixel in a tile. `reads` what was drawn before, `writes` a new value.
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
                traffic.read(self.client, self.line_bytes);
            }
            if let Some(evicted) = effect.evicted {
                self.in_memory.insert(evicted);
                traffic.write(self.client, self.line_bytes);
            }
        }
    }

    /// Writes back what is changed, and with `cleared` the lines of the passes that nothing was drawn into.
    fn finish<'p>(
        &mut self,
        passes: impl Iterator<Item = &'p Pass>,
        cleared: bool,
        traffic: &mut Traffic,
    ) {
        for cache in &mut self.caches {
            for line in cache.flush() {
                self.in_memory.insert(line);
                traffic.write(self.client, self.line_bytes);
            }
        }
        if cleared {
            let lines = |pass: &Pass| {
                let [columns, rows] =
                    [0, 1].map(|a: usize| u64::from(pass.size_px[a].div_ceil(self.block[a])));
                columns * rows
            };
            let all: u64 = passes.map(lines).sum();
            let undrawn = all.saturating_sub(self.in_memory.len() as u64);
            traffic.write(self.client, undrawn * self.line_bytes);
        }
    }
}
