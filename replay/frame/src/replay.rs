//! Replays the frames of a trace on a machine, for several schedulers and parameters at once.

use super::counts::Counts;
use super::device::Device;
use super::dram::MakeChannels;
use super::items::{Items, Pictures};
use super::machine::{Machine, Settings};
use super::schedulers::{Inputs, Pressure, Queue, Scheduler, order_of};
use super::timeline::FrameTimeline;
use formats::textrace::Tile;
use rayon::prelude::*;
use sim::config::{BetweenFrames, ConfigError, RunConfig, accept};
use sim::memory::dram::Dram;
use sim::order::{TileRef, WorkItem, frames};
use sim::stream::{
    Cores, Expander, Frame, FramePlan, LineMemory, StreamError, TileSource, Walk, rendered,
};
use sim::sums::Unbalanced;
use std::collections::{HashMap, HashSet};
use std::hash::{DefaultHasher, Hash, Hasher};

/// A scheduler on a machine.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// The scheduler.
    pub scheduler: Scheduler,
    /// Parameters of the machine.
    pub settings: Settings,
    /// Whether its timeline is recorded.
    pub records: bool,
}

/// The time of the frames of a trace.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTime {
    /// The machine.
    pub machine: Machine,
    /// Cycles and counters of each frame.
    pub frames: Vec<(u64, Counts)>,
    /// Distinct lines of all textures that the trace samples.
    pub unique_lines: u64,
    /// Tiles that were not rendered, and all tiles.
    pub skipped_tiles: [u64; 2],
    /// The replay over time, if the point records it.
    pub timeline: Option<FrameTimeline>,
}

/// Reasons why a replay fails.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// An impossible machine.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// An unreadable trace.
    #[error(transparent)]
    Stream(#[from] StreamError),
    /// A defect of the model.
    #[error(transparent)]
    Unbalanced(#[from] Unbalanced),
}

/// A point in the middle of a trace.
struct Run {
    point: Point,
    config: RunConfig,
    machine: Machine,
    pictures: Pictures,
    /// The machine after the last frame.
    device: Option<Device>,
    last: Pressure,
    before: (u64, Counts),
    out: FrameTime,
}

/// Tiles of the current frame, by pass and tile.
#[derive(Default)]
struct Signatures {
    /// By the pass's place in its frame, and tile.
    last: HashMap<(u32, u32), u64>,
    /// Tiles that equal those of the last frame.
    equal: HashSet<TileRef>,
}

impl Signatures {
    /// Reads the tiles of a frame.
    fn read(&mut self, source: &dyn TileSource, frame: u32) -> Result<(), StreamError> {
        let last = std::mem::take(&mut self.last);
        self.equal.clear();
        let mut tile = Tile::default();
        let passes = (0..).zip(&source.tables().passes);
        let of_frame = passes.filter(|(_, pass)| pass.frame == frame);
        for (place, (pass, of)) in (0..).zip(of_frame) {
            for at in 0..of.tile_count() {
                source.read_tile(pass, at, &mut tile)?;
                let mut hasher = DefaultHasher::new();
                for run in &tile.runs {
                    (run.primitive, run.draw, run.first, run.count).hash(&mut hasher);
                }
                for of in &tile.records {
                    let place = (of.x, of.y, of.mask, of.group);
                    (place, of.uv, of.dx, of.dy, of.cross).hash(&mut hasher);
                }
                let signature = hasher.finish();
                if last.get(&(place, at)) == Some(&signature) {
                    self.equal.insert(TileRef { pass, tile: at });
                }
                self.last.insert((place, at), signature);
            }
        }
        Ok(())
    }
}

/// Replays all frames of a trace for each point. Caches keep their contents from frame to frame. `advance` is called
/// with the number of points and frames done.
///
/// # Errors
/// An impossible machine, an unreadable trace, or a defect of the model.
pub fn replay(
    trace: &dyn TileSource,
    config: &RunConfig,
    points: &[Point],
    advance: &(dyn Fn(u64) + Sync),
) -> Result<Vec<FrameTime>, ReplayError> {
    let channels: &MakeChannels<'_> = &|of| Box::new(Dram::new(of, config.line_bytes));
    replay_with(trace, config, points, channels, advance)
}

/// As [`replay`], with other channels of DRAM behind the L2.
///
/// # Errors
/// As [`replay`].
pub fn replay_with(
    trace: &dyn TileSource,
    config: &RunConfig,
    points: &[Point],
    channels: &MakeChannels<'_>,
    advance: &(dyn Fn(u64) + Sync),
) -> Result<Vec<FrameTime>, ReplayError> {
    accept(
        config.between_frames == BetweenFrames::Keep,
        "between_frames",
        "keep, as in the model of frame time",
        config.between_frames,
    )?;
    let rendered = rendered(trace, config)?;
    let expander = Expander::new(&rendered, config)?;
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let orders = points.iter().map(|point| order_of(point.scheduler));
    let mut walk = Walk::new(&expander, &memory, config, orders);
    let runs: Result<Vec<Run>, ReplayError> = points
        .iter()
        .map(|point| Run::new(point, config, &rendered, expander.lines()))
        .collect();
    let mut runs = runs?;
    let skips = points.iter().any(|point| point.scheduler.row().skips_equal);
    let mut signatures = Signatures::default();
    for number in frames(&rendered.tables().passes) {
        if skips {
            signatures.read(&rendered, number)?;
        }
        let frame = walk.expand(number)?;
        let plan = walk.plan(&frame)?;
        runs.par_iter_mut().try_for_each(|run| {
            run.frame(&rendered, &frame, &plan, &signatures, channels)?;
            advance(1);
            Ok::<(), ReplayError>(())
        })?;
    }
    let unique_lines = walk.counts().unique_lines;
    let finish = |run: Run| FrameTime {
        unique_lines,
        timeline: run.device.and_then(Device::timeline),
        ..run.out
    };
    Ok(runs.into_iter().map(finish).collect())
}

impl Run {
    fn new(
        point: &Point,
        config: &RunConfig,
        source: &dyn TileSource,
        texture_lines: u64,
    ) -> Result<Self, ReplayError> {
        let config = RunConfig {
            order: order_of(point.scheduler),
            ..*config
        };
        let machine = Machine::new(&config, &point.settings)?;
        let pixel_bytes = point.settings.colour_bytes;
        Ok(Self {
            point: *point,
            pictures: Pictures::new(source, texture_lines, pixel_bytes, config.line_bytes),
            device: None,
            last: Pressure::default(),
            before: (0, Counts::default()),
            out: FrameTime {
                machine: machine.clone(),
                frames: Vec::new(),
                unique_lines: 0,
                skipped_tiles: [0; 2],
                timeline: None,
            },
            config,
            machine,
        })
    }

    /// Replays a frame.
    fn frame(
        &mut self,
        source: &dyn TileSource,
        frame: &Frame<'_>,
        plan: &FramePlan<'_>,
        signatures: &Signatures,
        channels: &MakeChannels<'_>,
    ) -> Result<(), ReplayError> {
        let passes = &source.tables().passes;
        let first = passes.iter().position(|of| of.frame == frame.number());
        self.last.first_pass = first.unwrap_or(0) as u32;
        if self.point.scheduler.row().uses_last_frame && self.out.frames.is_empty() {
            // The first frame has its own counters, as if the head had not moved, like orders that use counters.
            let mut apart = Device::new(&self.machine, channels)?;
            self.last = self.phases(&mut apart, source, frame, plan, signatures)?.0;
        }
        let mut device = match self.device.take() {
            Some(device) => device,
            None => {
                let mut device = Device::new(&self.machine, channels)?;
                if self.point.records {
                    device.record();
                }
                device
            }
        };
        let (counted, skipped) = self.phases(&mut device, source, frame, plan, signatures)?;
        let (counts, now) = (device.counts()?, device.now());
        (self.last, self.device) = (counted, Some(device));
        let cycles = now - self.before.0;
        self.out.frames.push((cycles, counts.since(&self.before.1)));
        self.before = (now, counts);
        for (sum, of) in self.out.skipped_tiles.iter_mut().zip(skipped) {
            *sum += of;
        }
        Ok(())
    }

    /// Runs the phases of a frame. Returns the lines that each tile read from DRAM, and the tiles that were skipped and
    /// all tiles.
    fn phases(
        &self,
        device: &mut Device,
        source: &dyn TileSource,
        frame: &Frame<'_>,
        plan: &FramePlan<'_>,
        signatures: &Signatures,
    ) -> Result<(Pressure, [u64; 2]), ReplayError> {
        let row = self.point.scheduler.row();
        let mut counted = Pressure::new(self.last.first_pass);
        let mut skipped = [0; 2];
        for mut items in plan.phases(&self.config) {
            let tiles = |items: &[WorkItem]| items.iter().flat_map(WorkItem::tiles).count() as u64;
            skipped[1] += tiles(&items);
            if row.skips_equal {
                let all = tiles(&items);
                let is_new = |item: &WorkItem| {
                    let mut tiles = item.tiles();
                    tiles.any(|at| !signatures.equal.contains(&at))
                };
                items.retain(is_new);
                skipped[0] += all - tiles(&items);
            }
            let inputs = Inputs {
                config: &self.config,
                last: &self.last,
            };
            let queue: Queue = (row.plan)(items, &inputs);
            device.pressure = vec![0; queue.items.len()];
            let reader = Cores::new(frame, 1);
            let mut items = Items::new(
                reader,
                source,
                &queue,
                &self.machine,
                &self.pictures,
                row.priority_warps,
            );
            device.run(&mut items)?;
            device.keep_spans(&queue.items);
            for (item, lines) in queue.items.iter().zip(&device.pressure) {
                counted.add(item, *lines);
            }
        }
        Ok((counted, skipped))
    }
}
