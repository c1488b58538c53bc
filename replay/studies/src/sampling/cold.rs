//! What captured frames miss because the frames before them were not captured.
//!
//! In a functional LRU cache a set is exact once it has received as many distinct lines as it has ways. Until then, a miss
//! may have been a hit (Wood, Hill and Kessler, SIGMETRICS 1991). So the misses of a frame lie between those of sets that
//! were full and all misses of a replay from empty caches.

use super::run::Run;
use rayon::prelude::*;
use sim::config::{Mode, RunConfig};
use sim::engine::ReplayError;
use sim::memory::{Cache, Found, Hierarchy};
use sim::stream::{
    Consumer, Cores, Expander, LineMemory, QuadLines, TileSource, Walk, interleave, rendered,
};
use std::collections::BTreeMap;

/// Why a configuration has no bracket; `None` if it has one.
pub fn not_bounded(config: &RunConfig) -> Option<&'static str> {
    let levels = [config.level.l1, config.level.l2];
    let plain = levels.iter().all(|level| level.is_plain_lru());
    if config.mode != Mode::Functional {
        Some("timed mode")
    } else if !plain || config.level.l2.sets("L2", config.line_bytes).is_err() {
        Some("a policy other than LRU")
    } else if config.follows_l2_misses() {
        Some("levels, prefetchers or DRAM below the L2")
    } else {
        None
    }
}

/// Counts the misses of sets that are not full.
struct Cold {
    caches: Hierarchy<Box<dyn Cache>>,
    /// Lines that each set of the L2 has received since it was empty.
    filled: Vec<u32>,
    ways: u32,
    misses: u64,
}

impl Consumer for Cold {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                for &line in footprint.lines {
                    if self.caches.access(core, line) == Found::Below {
                        let set = line as usize & (self.filled.len() - 1);
                        if self.filled[set] < self.ways {
                            self.filled[set] += 1;
                            self.misses += 1;
                        }
                    }
                }
            }
        }
    }
}

/// Misses of each frame in L2 sets that were not full. Caches are empty where frame numbers leave a gap.
///
/// # Errors
/// An invalid configuration, or an unreadable trace.
pub fn cold_misses(
    trace: &dyn TileSource,
    config: &RunConfig,
) -> Result<BTreeMap<u32, u64>, ReplayError> {
    config.validate()?;
    let runs = Run::all(trace);
    let of_runs: Vec<_> =
        (runs.par_iter().map(|run| of_run(run, config))).collect::<Result<_, _>>()?;
    Ok(of_runs.into_iter().flatten().collect())
}

fn of_run(run: &Run<'_>, config: &RunConfig) -> Result<Vec<(u32, u64)>, ReplayError> {
    let rendered = rendered(run, config)?;
    let expander = Expander::new(&rendered, config)?;
    let sets = config.level.l2.sets("L2", config.line_bytes)? as usize;
    let mut cold = Cold {
        caches: Hierarchy::build(config)?,
        filled: vec![0; sets],
        ways: config.level.l2.ways,
        misses: 0,
    };
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut walk = Walk::new(&expander, &memory, config, [config.order]);
    let mut out = Vec::new();
    for number in walk.frames() {
        if config.between_frames.empties()? {
            cold.caches.clear();
            cold.filled.fill(0);
        }
        cold.misses = 0;
        let frame = walk.expand(number)?;
        let phases = walk.plan(&frame)?.phases(config);
        let mut cores = Cores::new(&frame, config.cores as usize);
        interleave(&mut cores, &phases, config.dispatch(), &mut cold)?;
        out.push((number, cold.misses));
    }
    Ok(out)
}
