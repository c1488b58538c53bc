//! A functional replay that counts by set: all lines of an L1 set, of the L2 sets that hold them,
//! and of no others, are a *cluster*, which can be replayed alone and exactly.

use crate::cache::{AnyCache, Cache, Levels};
use crate::config::{Assign, ConfigError, Order, RunConfig};
use crate::engine::ReplayError;
use crate::order::{self, Phase};
use crate::stream::{
    Consumer, Cores, Expander, LineMemory, QuadLines, TileSource, TraceCounts, interleave,
};

/// Lines fetched from memory, by cluster, and by work item's first tile.
pub struct Counts {
    /// L2 misses by cluster.
    pub by_cluster: Vec<u64>,
    /// L2 misses and footprints by tile.
    pub by_tile: Vec<(u64, u64)>,
}

struct Counting {
    l1: Vec<Box<dyn Cache>>,
    l2: Box<dyn Cache>,
    mask: u32,
    counts: Counts,
}

impl Consumer for Counting {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let tile = quad.tile();
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                for &line in footprint.lines {
                    if !self.l1[core].access(line) && !self.l2.access(line) {
                        self.counts.by_cluster[(line & self.mask) as usize] += 1;
                        self.counts.by_tile[tile].0 += 1;
                    }
                }
            }
        }
        self.counts.by_tile[tile].1 += u64::from(quad.footprints);
    }
}

/// Replays a trace's first frame, of each phase the items that `chosen` keeps.
///
/// # Errors
/// An impossible configuration, a trace that cannot be read.
pub fn counts(
    trace: &dyn TileSource,
    config: &RunConfig,
    order: Order,
    chosen: &dyn Fn(usize) -> bool,
) -> Result<Counts, ReplayError> {
    config.validate()?;
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let expander = Expander::new(trace, config)?;
    let mut accesses = TraceCounts::new(expander.bins());
    let passes = &trace.tables().passes;
    let number = passes.iter().map(|pass| pass.frame).min().unwrap_or(0);
    let frame = expander.frame(number, &memory, &mut accesses)?;
    let clusters = clusters(config)?;
    let Levels { l1, l2 } = Levels::build(config)?;
    let mut counting = Counting {
        l1: l1.into_iter().map(AnyCache::into_box).collect(),
        l2: l2.into_box(),
        mask: clusters - 1,
        counts: Counts {
            by_cluster: vec![0; clusters as usize],
            by_tile: vec![(0, 0); expander.bins().tiles()],
        },
    };
    let mut index = 0;
    let mut keep = |phase: Phase| -> Phase {
        let kept = phase.into_iter().filter(|_| {
            index += 1;
            chosen(index - 1)
        });
        kept.collect()
    };
    let plan = order::plan_frame(&*order.build(config.seed), passes, number);
    let phases: Vec<Phase> = plan.into_iter().map(&mut keep).collect();
    let mut cores = Cores::new(&frame, config.cores as usize);
    interleave(&mut cores, &phases, Assign::FirstIdle, &mut counting)?;
    Ok(counting.counts)
}

/// The clusters of a configuration: sets of the smaller level.
fn clusters(config: &RunConfig) -> Result<u32, ConfigError> {
    let l1 = config.l1.sets("L1", config.line_bytes)?;
    let l2 = config.l2.sets("L2", config.line_bytes)?;
    Ok(l1.min(l2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{CacheConfig, Mode};
    use crate::engine::replay;
    use crate::stream::synthetic::Synthetic;

    #[test]
    fn clusters_and_tiles_add_up_to_the_functional_replay() {
        let trace = Synthetic {
            size_px: [96, 64],
            patch_px: 24,
            materials: 4,
            ..Synthetic::default()
        }
        .generate();
        let config = RunConfig {
            mode: Mode::Functional,
            l1: CacheConfig::lru(1 << 10),
            l2: CacheConfig::lru(8 << 10),
            ..RunConfig::default()
        };
        for order in [Order::MORTON, Order::Z2_STA] {
            let found = counts(&trace, &config, order, &|_| true).unwrap();
            let expected = replay(&trace, &RunConfig { order, ..config }).unwrap();
            assert_eq!(found.by_cluster.iter().sum::<u64>(), expected.l2.misses);
            assert_eq!(found.by_cluster.len(), 16);
            let tiles = found.by_tile.iter();
            let (misses, footprints) = tiles.fold((0, 0), |(m, f), t| (m + t.0, f + t.1));
            assert_eq!(
                (misses, footprints),
                (expected.l2.misses, expected.footprints)
            );
        }
    }
}
