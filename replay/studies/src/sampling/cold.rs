//! What captured frames miss because the frames before them were not captured.
//!
//! In a functional LRU cache a set is exact once it has received as many distinct lines as it has ways. Until then, a miss
//! may have been a hit (Wood, Hill and Kessler, SIGMETRICS 1991). So the misses of a frame lie between those of sets that
//! were full and all misses of a replay from empty caches, if all sets of the L1 were full.

use super::run::Run;
use rayon::prelude::*;
use sim::config::{BetweenFrames, Mode, RunConfig};
use sim::engine::ReplayError;
use sim::memory::{Cache, Found, Hierarchy};
use sim::stream::{Consumer, Cores, Expander, LineMemory, QuadLines, Walk, interleave, rendered};
use std::collections::BTreeMap;

/// Why a configuration has no bounds; `None` if it has them.
pub fn not_bounded(config: &RunConfig) -> Option<&'static str> {
    let levels = [config.level.l1, config.level.l2];
    if config.mode != Mode::Functional {
        Some("timed mode")
    } else if !levels.iter().all(|level| level.is_plain_lru()) || !levels[1].shared {
        Some("caches other than plain LRU")
    } else if config.follows_l2_misses() {
        Some("levels, prefetchers or DRAM below the L2")
    } else if config.between_frames.lost_percent().is_some() {
        Some("other work between frames")
    } else {
        None
    }
}

/// What a frame may have missed because of the frames before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cold {
    /// Misses in L1 sets that were not full.
    pub l1_misses: u64,
    /// Bytes of misses in L2 sets that were not full.
    pub l2_bytes: u64,
}

/// The sets of a cache, and the lines that each has received since it was empty.
struct Filling {
    lines: Vec<u32>,
    ways: u32,
    /// Lines that the sets that are not full lack.
    lacks: u64,
}

impl Filling {
    fn new(sets: u32, ways: u32) -> Self {
        Self {
            lines: vec![0; sets as usize],
            ways,
            lacks: u64::from(sets) * u64::from(ways),
        }
    }

    /// Whether the set of a missing line is not full. The line fills it.
    fn is_cold(&mut self, line: u32) -> bool {
        let set = line as usize & (self.lines.len() - 1);
        let cold = self.lines[set] < self.ways;
        self.lines[set] += u32::from(cold);
        self.lacks -= u64::from(cold);
        cold
    }
}

struct Counting {
    caches: Hierarchy<Box<dyn Cache>>,
    /// One per core.
    l1: Vec<Filling>,
    l2: Filling,
    line_bytes: u64,
    cold: Cold,
}

impl Consumer for Counting {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                for &line in footprint.lines {
                    let found = self.caches.access(core, line);
                    if found != Found::L1 && self.l1[core].is_cold(line) {
                        self.cold.l1_misses += 1;
                    }
                    if found == Found::Below && self.l2.is_cold(line) {
                        self.cold.l2_bytes += self.line_bytes;
                    }
                }
            }
        }
    }
}

/// What each frame may have missed. Each run starts with empty caches; frame 0 has no frames before it.
///
/// # Errors
/// An invalid configuration, or an unreadable trace.
pub fn cold(runs: &[Run<'_>], config: &RunConfig) -> Result<BTreeMap<u32, Cold>, ReplayError> {
    config.validate()?;
    let found: Vec<_> =
        (runs.par_iter().map(|run| of_run(run, config))).collect::<Result<_, _>>()?;
    Ok(found.into_iter().flatten().collect())
}

fn of_run(run: &Run<'_>, config: &RunConfig) -> Result<Vec<(u32, Cold)>, ReplayError> {
    let rendered = rendered(run, config)?;
    let expander = Expander::new(&rendered, config)?;
    let level = &config.level;
    let l1 = || level.l1.sets("L1", config.line_bytes);
    let l1 = || l1().map(|sets| Filling::new(sets, level.l1.ways));
    let mut counting = Counting {
        caches: Hierarchy::build(config)?,
        l1: (0..config.cores).map(|_| l1()).collect::<Result<_, _>>()?,
        l2: Filling::new(level.l2.sets("L2", config.line_bytes)?, level.l2.ways),
        line_bytes: config.line_bytes.into(),
        cold: Cold::default(),
    };
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut walk = Walk::new(&expander, &memory, config, [config.order]);
    let frames = walk.frames();
    let starts_empty = config.between_frames == BetweenFrames::Flush || frames.first() == Some(&0);
    if starts_empty {
        return Ok(frames
            .into_iter()
            .map(|frame| (frame, Cold::default()))
            .collect());
    }
    let mut out = Vec::new();
    for number in frames {
        counting.cold = Cold::default();
        if counting
            .l1
            .iter()
            .chain([&counting.l2])
            .all(|of| of.lacks == 0)
        {
            // All sets are exact from here on.
            out.push((number, Cold::default()));
            continue;
        }
        let frame = walk.expand(number)?;
        let phases = walk.plan(&frame)?.phases(config);
        let mut cores = Cores::new(&frame, config.cores as usize);
        interleave(&mut cores, &phases, config.dispatch(), &mut counting)?;
        out.push((number, counting.cold));
    }
    Ok(out)
}
