//! The lines of work items, and the requests that reach the L2.

use sim::config::{BetweenFrames, RunConfig};
use sim::engine::ReplayError;
use sim::memory::{Cache, Caches, Found, FourWayLru, Hierarchy, MissPath, OtherWork};
use sim::order::{Phase, WorkItem};
use sim::stream::{Consumer, Cores, Frame, QuadLines, StreamError, interleave};

/// Lists lines in order of access.
#[derive(Default)]
struct Lines(Vec<u32>);

impl Consumer for Lines {
    fn quad(&mut self, _core: usize, quad: QuadLines<'_>) {
        self.0.extend_from_slice(quad.lines);
    }
}

/// The distinct lines of each item in order of first access.
pub(super) fn lines_of_items(
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

/// L1 caches, and a list of their misses.
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

/// The requests that reach the L2, in order.
pub(super) fn l2_stream(
    frame: &Frame<'_>,
    phases: &[Phase],
    config: &RunConfig,
) -> Result<Vec<u32>, ReplayError> {
    let mut misses = Misses {
        l1: Caches::build(config)?.boxed().l1,
        missed: Vec::new(),
    };
    let mut cores = Cores::new(frame, config.cores as usize);
    interleave(&mut cores, phases, config.dispatch(), &mut misses)?;
    Ok(misses.missed)
}

/// Caches of a machine, with a count of the lines that they fetch.
pub struct Counting {
    caches: Hierarchy<FourWayLru>,
    /// Lines fetched from memory.
    pub fetched: u64,
}

impl Counting {
    /// Empty caches. None unless all of them are plain LRU caches of four ways.
    ///
    /// # Errors
    /// An impossible geometry.
    pub fn new(config: &RunConfig) -> Result<Option<Self>, ReplayError> {
        let caches = Caches::build(config)?.all_four_way().ok();
        Ok(caches.map(|caches| Self {
            caches: Hierarchy::new(caches, MissPath::memory_alone()),
            fetched: 0,
        }))
    }

    /// Applies what happens to the caches between two frames.
    pub fn between(&mut self, config: &RunConfig, frame: usize) {
        match config.between_frames {
            BetweenFrames::Keep => {}
            BetweenFrames::Flush => self.caches.clear(),
            BetweenFrames::Lose(percent) => {
                self.caches.lose(OtherWork::after(frame, percent, config));
            }
        }
    }
}

impl Consumer for Counting {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        for &line in quad.lines {
            let found = self.caches.access(core, line);
            self.fetched += u64::from(found == Found::Below);
        }
    }
}
