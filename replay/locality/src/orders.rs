//! Analyses a trace, with one pass over its lines per order.

use crate::figures::Figures;
use crate::place::Place;
use crate::profile::{Profile, StreamCache, check_size};
use formats::textrace::Pass;
use formats::view::Eye;
use rayon::prelude::*;
use sim::config::{ConfigError, LevelConfig, Order, RunConfig};
use sim::engine::ReplayError;
use sim::memory::{AnyCache, Cache};
use sim::order::{Phase, frames};
use sim::stream::{
    Consumer, Cores, Expander, LineMemory, QuadLines, StreamError, TileSource, Walk, interleave,
    rendered,
};

/// A stream of lines in a machine without latencies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// The L1 look-ups of each core; figures are sums over cores.
    L1,
    /// The L2 look-ups: misses of the configured L1 caches, in order.
    L2,
    /// The look-ups of all cores, as in a shared L1.
    Merged,
}

impl Stream {
    /// Name in columns.
    pub fn key(self) -> &'static str {
        match self {
            Self::L1 => "l1",
            Self::L2 => "l2",
            Self::Merged => "merged",
        }
    }

    /// Name in headings.
    pub fn title(self) -> &'static str {
        match self {
            Self::L1 => "L1",
            Self::L2 => "L2",
            Self::Merged => "all cores as one",
        }
    }
}

/// The streams to analyse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Streams {
    /// Those of the L1 caches and of the L2.
    Levels,
    /// These, and the look-ups of all cores as one.
    WithMerged,
    /// That of the L2, which takes a fraction of the time.
    OnlyL2,
    /// Distances and first uses of that of the L2, without caches that receive it.
    OnlyL2Distances,
}

/// The order of the accesses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sequence {
    /// A tile order.
    Order(Order),
    /// As given in a file of plain addresses.
    AsGiven,
}

impl Sequence {
    /// Name in columns.
    pub fn key(self) -> &'static str {
        match self {
            Self::Order(order) => order.name(),
            Self::AsGiven => "as-given",
        }
    }

    /// Name in headings.
    pub fn title(self) -> &'static str {
        match self {
            Self::Order(order) => order.title(),
            Self::AsGiven => "as given",
        }
    }
}

/// The locality of a sequence of accesses.
#[derive(Clone, Debug)]
pub struct OrderFigures {
    /// The sequence.
    pub order: Sequence,
    /// Figures of each stream.
    pub streams: Vec<(Stream, Figures)>,
}

fn check_tiles(tiles: usize) -> Result<(), StreamError> {
    let most = Place::MOST_TILES;
    if tiles <= most as usize {
        return Ok(());
    }
    let problem = format!("passes have {tiles} tiles: expected at most {most}");
    Err(StreamError::Tables(problem))
}

/// Analyses a trace in every order, in parallel. Order and latencies of `config` are not used. `done` is
/// called for every frame of every order.
///
/// # Errors
/// An impossible configuration, or an unreadable trace.
pub fn analyse(
    trace: &dyn TileSource,
    config: &RunConfig,
    orders: &[Order],
    streams: Streams,
    done: &(dyn Fn(u64) + Sync),
) -> Result<Vec<OrderFigures>, ReplayError> {
    config.validate()?;
    let merged = u32::from(streams == Streams::WithMerged);
    check_size(config, config.cores + merged)?;
    let frames = frames(&trace.tables().passes);
    // State is kept from frame to frame, so with several frames only orders that run concurrently share an expansion.
    let together = match frames.len() {
        0 | 1 => orders.len(),
        _ => rayon::current_num_threads(),
    };
    let empties = config.between_frames.empties()?;
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let rendered = rendered(trace, config)?;
    let passes = &rendered.tables().passes;
    let mut figures = Vec::new();
    for orders in orders.chunks(together.max(1)) {
        let expander = Expander::new(&rendered, config)?;
        check_tiles(expander.bins().tiles())?;
        let mut walk = Walk::new(&expander, &memory, config, orders.iter().copied());
        let analyses: Result<Vec<Option<Analysis>>, ConfigError> = orders
            .iter()
            .map(|_| {
                (frames.len() != 1)
                    .then(|| Analysis::new(config, streams))
                    .transpose()
            })
            .collect();
        let mut analyses = analyses?;
        let mut finished: Vec<Option<OrderFigures>> = orders.iter().map(|_| None).collect();
        for &number in &frames {
            let frame = walk.expand(number)?;
            let plan = walk.plan(&frame)?;
            let last = frames.last() == Some(&number);
            let run = |((&order, kept), finished): (
                (&Order, &mut Option<Analysis>),
                &mut Option<OrderFigures>,
            )| {
                let phases = plan.phases(&RunConfig { order, ..*config });
                let mut analysis = match kept.take() {
                    Some(analysis) => analysis,
                    None => Analysis::new(config, streams)?,
                };
                let places = Places::new(passes, number, &phases, expander.bins().first_tiles());
                if empties {
                    analysis.flush()?;
                }
                analysis.begin_frame(places);
                let mut cores = Cores::new(&frame, config.cores as usize);
                interleave(
                    &mut cores,
                    &phases,
                    order.dispatch(config.assign),
                    &mut analysis,
                )?;
                if last {
                    *finished = Some(analysis.finish(order));
                } else {
                    *kept = Some(analysis);
                }
                done(1);
                Ok::<(), ReplayError>(())
            };
            let orders = orders.par_iter().zip(&mut analyses).zip(&mut finished);
            orders.with_max_len(1).try_for_each(run)?;
        }
        let empty = orders.iter().zip(analyses);
        for ((order, analysis), finished) in empty.zip(finished) {
            let of_no_frame = analysis.map(|analysis| analysis.finish(*order));
            figures.extend(finished.or(of_no_frame));
        }
    }
    Ok(figures)
}

/// Places of a frame's tiles in an order.
struct Places {
    /// Number of the first tile.
    first: usize,
    /// Work item of each tile, counted from 1, and whether it has two tiles.
    items: Vec<(u32, bool)>,
    /// First tile, eye and columns of each pass of the frame.
    passes: Vec<(usize, Option<Eye>, usize)>,
}

impl Places {
    fn new(passes: &[Pass], frame: u32, phases: &[Phase], first_tiles: &[usize]) -> Self {
        let of_frame = || {
            let all = passes.iter().zip(first_tiles);
            all.filter(|(pass, _)| pass.frame == frame)
        };
        let first = of_frame().map(|(_, &first)| first).min().unwrap_or(0);
        let ends = of_frame().map(|(pass, &first)| first + pass.tile_count() as usize);
        let tiles = ends.max().unwrap_or(0) - first;
        let mut items = vec![(0, false); tiles];
        for (number, item) in (1..).zip(phases.iter().flatten()) {
            let pair = item.tiles().count() > 1;
            for at in item.tiles() {
                let tile = first_tiles[at.pass as usize] + at.tile as usize;
                items[tile - first] = (number, pair);
            }
        }
        Self {
            first,
            items,
            passes: of_frame()
                .map(|(pass, &first)| (first, pass.eye, (pass.tiles[0] as usize).max(1)))
                .collect(),
        }
    }

    fn of(&self, tile: usize) -> Place {
        let (item, pair) = self.items[tile - self.first];
        let pass = self.passes.iter().rfind(|(first, ..)| *first <= tile);
        let eye = pass.and_then(|(_, eye, _)| *eye);
        let row = |(first, _, columns): &(usize, _, usize)| ((tile - first) / columns) as u32;
        Place {
            tile: tile as u32,
            eye,
            row: pass.filter(|_| eye.is_some()).map(row),
            item,
            tiles: 1 + u32::from(pair),
        }
    }
}

/// A machine with analyses instead of caches.
struct Analysis {
    l1: Vec<Core>,
    l2: Shared,
    merged: Option<Shared>,
    places: Option<Places>,
    /// Figures of the streams before the last flush.
    flushed: Vec<(Stream, Figures)>,
}

/// Adds figures to those of their stream.
fn add(streams: &mut Vec<(Stream, Figures)>, stream: Stream, figures: Figures) {
    match streams.iter_mut().find(|(of, _)| *of == stream) {
        Some((_, sum)) => sum.add(&figures),
        None => streams.push((stream, figures)),
    }
}

/// The L1 of a core.
enum FirstLevel {
    Analysed(Box<Profile>),
    Plain(Box<dyn Cache>),
}

impl FirstLevel {
    /// Looks up a line, and fills it on a miss. Returns true for a hit.
    #[inline(always)]
    fn access(&mut self, line: u32) -> bool {
        match self {
            Self::Analysed(profile) => profile.access(line),
            Self::Plain(cache) => cache.access(line),
        }
    }
}

/// A core's L1, and its current place.
struct Core {
    l1: FirstLevel,
    tile: Option<usize>,
    place: Place,
}

/// The analysis of a stream shared by cores, and its current tile.
struct Shared {
    profile: Profile,
    tile: Option<usize>,
}

impl Shared {
    #[inline(always)]
    fn access(&mut self, tile: usize, place: &Place, line: u32) {
        if self.tile != Some(tile) {
            self.tile = Some(tile);
            self.profile.at(place);
        }
        self.profile.access(line);
    }
}

impl Analysis {
    fn new(config: &RunConfig, streams: Streams) -> Result<Self, ConfigError> {
        // The seeds of a replay.
        let profile = |level: &'static str, cache: &LevelConfig, number: u32| {
            let of = StreamCache {
                cache: *cache,
                level,
                line_bytes: config.line_bytes,
                seed: config.seed.wrapping_add(number.into()),
            };
            match streams {
                Streams::OnlyL2Distances => Profile::of_distances(of),
                _ => Profile::new(of),
            }
        };
        let shared = |profile| Shared {
            profile,
            tile: None,
        };
        let plain = |number: u32| {
            let seed = config.seed.wrapping_add(number.into());
            AnyCache::build(&config.level.l1, "L1", config.line_bytes, seed)
        };
        let core = |number| {
            let l1 = match streams {
                Streams::OnlyL2 | Streams::OnlyL2Distances => {
                    FirstLevel::Plain(plain(number)?.into_box())
                }
                Streams::Levels | Streams::WithMerged => {
                    FirstLevel::Analysed(Box::new(profile("L1", &config.level.l1, number)?))
                }
            };
            Ok(Core {
                l1,
                tile: None,
                place: Place::default(),
            })
        };
        let merged = (streams == Streams::WithMerged)
            .then(|| profile("L1", &config.level.l1, 1))
            .transpose()?;
        Ok(Self {
            l1: (1..=config.cores)
                .map(core)
                .collect::<Result<_, ConfigError>>()?,
            l2: shared(profile("L2", &config.level.l2, 0)?),
            merged: merged.map(shared),
            places: None,
            flushed: Vec::new(),
        })
    }

    /// Empties all caches, unless nothing has been looked up.
    fn flush(&mut self) -> Result<(), ConfigError> {
        if self.places.is_none() {
            return Ok(());
        }
        for core in &mut self.l1 {
            match &mut core.l1 {
                FirstLevel::Analysed(profile) => {
                    add(&mut self.flushed, Stream::L1, profile.flush()?);
                }
                FirstLevel::Plain(cache) => cache.clear(),
            }
        }
        add(&mut self.flushed, Stream::L2, self.l2.profile.flush()?);
        if let Some(merged) = &mut self.merged {
            add(&mut self.flushed, Stream::Merged, merged.profile.flush()?);
        }
        Ok(())
    }

    fn begin_frame(&mut self, places: Places) {
        self.places = Some(places);
        for core in &mut self.l1 {
            core.tile = None;
            if let FirstLevel::Analysed(profile) = &mut core.l1 {
                profile.begin_frame();
            }
        }
        for shared in [Some(&mut self.l2), self.merged.as_mut()]
            .into_iter()
            .flatten()
        {
            shared.tile = None;
            shared.profile.begin_frame();
        }
    }

    fn finish(self, order: Order) -> OrderFigures {
        let mut streams = self.flushed;
        for core in self.l1 {
            if let FirstLevel::Analysed(profile) = core.l1 {
                add(&mut streams, Stream::L1, profile.finish());
            }
        }
        add(&mut streams, Stream::L2, self.l2.profile.finish());
        if let Some(merged) = self.merged {
            add(&mut streams, Stream::Merged, merged.profile.finish());
        }
        OrderFigures {
            order: Sequence::Order(order),
            streams,
        }
    }
}

impl Consumer for Analysis {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let Some(places) = &self.places else { return };
        if quad.lines.is_empty() {
            return;
        }
        let (core, tile) = (&mut self.l1[core], quad.tile());
        if core.tile != Some(tile) {
            core.tile = Some(tile);
            core.place = places.of(tile);
            if let FirstLevel::Analysed(profile) = &mut core.l1 {
                profile.at(&core.place);
            }
        }
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                for &line in footprint.lines {
                    if !core.l1.access(line) {
                        self.l2.access(tile, &core.place, line);
                    }
                    if let Some(merged) = &mut self.merged {
                        merged.access(tile, &core.place, line);
                    }
                }
            }
        }
    }
}
