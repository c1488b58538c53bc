//! Lines of items, and what comes to the L2.

use crate::cache::{Cache, FourWayLru, Levels};
use crate::config::{BetweenFrames, RunConfig};
use crate::engine::{OtherWork, ReplayError};
use crate::order::{Phase, WorkItem};
use crate::stream::{Consumer, Cores, Frame, QuadLines, StreamError, interleave};

/// Lists lines as they come.
#[derive(Default)]
struct Lines(Vec<u32>);

impl Consumer for Lines {
    fn quad(&mut self, _core: usize, quad: QuadLines<'_>) {
        self.0.extend_from_slice(quad.lines);
    }
}

/// The lines of each item as its core asks for them, those that it asks for again left out.
pub fn lines_of_items(
    frame: &Frame<'_>,
    items: &[WorkItem],
    config: &RunConfig,
) -> Result<Vec<Vec<u32>>, StreamError> {
    let mut cores = Cores::new(frame, 1);
    let mut seen = std::collections::HashSet::new();
    let mut of_items = Vec::with_capacity(items.len());
    for item in items {
        let mut lines = Lines::default();
        interleave(&mut cores, &[vec![*item]], config.assign, &mut lines)?;
        seen.clear();
        lines.0.retain(|line| seen.insert(*line));
        of_items.push(lines.0);
    }
    Ok(of_items)
}

/// L1 caches, and a list of what misses them.
struct Misses {
    l1: Vec<Box<dyn Cache>>,
    missed: Vec<u32>,
}

impl Consumer for Misses {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let l1 = &mut self.l1[core];
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                let missing = footprint.lines.iter().filter(|line| !l1.access(**line));
                self.missed.extend(missing);
            }
        }
    }
}

/// What comes to the L2, in its order.
pub fn l2_stream(
    frame: &Frame<'_>,
    phases: &[Phase],
    config: &RunConfig,
) -> Result<Vec<u32>, ReplayError> {
    let Levels { l1, .. } = Levels::build(config)?;
    let mut misses = Misses {
        l1: l1
            .into_iter()
            .map(crate::cache::AnyCache::into_box)
            .collect(),
        missed: Vec::new(),
    };
    let mut cores = Cores::new(frame, config.cores as usize);
    interleave(&mut cores, phases, config.dispatch(), &mut misses)?;
    Ok(misses.missed)
}

/// Caches of one machine that count what they fetch.
pub struct Counting {
    l1: Vec<FourWayLru>,
    l2: FourWayLru,
    /// Lines fetched from memory.
    pub fetched: u64,
}

impl Counting {
    /// Empty caches; none unless all of them are of four ways and plain LRU.
    ///
    /// # Errors
    /// A geometry that cannot be built.
    pub fn new(config: &RunConfig) -> Result<Option<Self>, ReplayError> {
        let levels = Levels::build(config)?.all_four_way().ok();
        Ok(levels.map(|Levels { l1, l2 }| Self { l1, l2, fetched: 0 }))
    }
}

impl Counting {
    /// Between frames: what becomes of the caches.
    pub fn between(&mut self, config: &RunConfig, frame: usize) {
        if config.between_frames != BetweenFrames::Keep {
            self.l1.iter_mut().for_each(Cache::clear);
        }
        match config.between_frames {
            BetweenFrames::Keep => {}
            BetweenFrames::Flush => self.l2.clear(),
            BetweenFrames::Lose(percent) => {
                let lines = config.l2.size_bytes / u64::from(config.line_bytes);
                OtherWork::after(frame, percent)
                    .lines(lines)
                    .for_each(|line| {
                        self.l2.access(line);
                    });
            }
        }
    }
}

impl Consumer for Counting {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        for &line in quad.lines {
            if !self.l1[core].access(line) {
                self.fetched += u64::from(!self.l2.access(line));
            }
        }
    }
}
