//! Replays a part of a trace functionally, with counts by set, tile and frame. A *cluster* is the set of
//! all lines of an L1 set and the L2 sets that hold no other lines. It can be replayed separately with
//! exact results.

use sim::config::{ConfigError, Order, RunConfig};
use sim::engine::ReplayError;
use sim::memory::{Cache, Found, Hierarchy};
use sim::order::Phase;
use sim::stream::{
    Consumer, Cores, Expander, LineMemory, QuadLines, TileSource, Walk, interleave, rendered,
};

/// The part to replay.
pub struct Part<'a> {
    /// Frame numbers, in replay order; the configuration sets the state of the caches between them.
    pub frames: &'a [u32],
    /// Selects work items of the order by their number since the start.
    pub item: &'a dyn Fn(usize) -> bool,
    /// Selects clusters; `None` selects all.
    pub clusters: Option<&'a [bool]>,
}

impl<'a> Part<'a> {
    /// Everything in these frames.
    pub fn frames(frames: &'a [u32]) -> Self {
        Self {
            frames,
            item: &|_| true,
            clusters: None,
        }
    }
}

/// Lines fetched from memory.
pub struct Counts {
    /// L2 misses by cluster.
    pub by_cluster: Vec<u64>,
    /// L2 misses and footprints by tile, summed over frames.
    pub by_tile: Vec<(u64, u64)>,
    /// L2 misses by frame, in the order of [`Part::frames`].
    pub by_frame: Vec<u64>,
}

struct ClusterCounting<'a> {
    caches: Hierarchy<Box<dyn Cache>>,
    mask: u32,
    chosen: Option<&'a [bool]>,
    counts: Counts,
}

impl Consumer for ClusterCounting<'_> {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let tile = quad.tile();
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                for &line in footprint.lines {
                    let cluster = (line & self.mask) as usize;
                    if self.chosen.is_some_and(|chosen| !chosen[cluster]) {
                        continue;
                    }
                    if self.caches.access(core, line) == Found::Below {
                        self.counts.by_cluster[cluster] += 1;
                        self.counts.by_tile[tile].0 += 1;
                    }
                }
            }
        }
        self.counts.by_tile[tile].1 += u64::from(quad.footprints);
    }
}

/// Replays a part of a trace. The caches are empty at the start.
///
/// # Errors
/// An invalid configuration, or an unreadable trace.
pub fn counts(
    trace: &dyn TileSource,
    config: &RunConfig,
    order: Order,
    part: &Part<'_>,
) -> Result<Counts, ReplayError> {
    config.validate()?;
    let rendered = rendered(trace, config)?;
    let expander = Expander::new(&rendered, config)?;
    let clusters = cluster_count(config)?;
    let mut counting = ClusterCounting {
        caches: Hierarchy::build(config)?,
        mask: clusters - 1,
        chosen: part.clusters,
        counts: Counts {
            by_cluster: vec![0; clusters as usize],
            by_tile: vec![(0, 0); expander.bins().tiles()],
            by_frame: Vec::new(),
        },
    };
    let config = &RunConfig { order, ..*config };
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut walk = Walk::new(&expander, &memory, config, [order]);
    let mut index = 0;
    for &number in part.frames {
        if config.between_frames.empties()? {
            counting.caches.clear();
        }
        let frame = walk.expand(number)?;
        let mut keep = |phase: Phase| -> Phase {
            let kept = phase.into_iter().filter(|_| {
                index += 1;
                (part.item)(index - 1)
            });
            kept.collect()
        };
        let plan = walk.plan(&frame)?.phases(config);
        let phases: Vec<Phase> = plan.into_iter().map(&mut keep).collect();
        let before: u64 = counting.counts.by_cluster.iter().sum();
        let mut cores = Cores::new(&frame, config.cores as usize);
        interleave(&mut cores, &phases, config.dispatch(), &mut counting)?;
        let after: u64 = counting.counts.by_cluster.iter().sum();
        counting.counts.by_frame.push(after - before);
    }
    Ok(counting.counts)
}

/// Number of clusters: the sets of the smaller level.
pub(super) fn cluster_count(config: &RunConfig) -> Result<u32, ConfigError> {
    let l1 = config.level.l1.sets("L1", config.line_bytes)?;
    let l2 = config.level.l2.sets("L2", config.line_bytes)?;
    Ok(l1.min(l2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::textrace::{Pass, Surfaces};
    use sim::config::{Assign, BetweenFrames, Hsr, LevelConfig, Levels, Mode};
    use sim::engine::replay;
    use sim::order;
    use sim::stream::testing::Synthetic;

    /// Every option that changes the misses of a functional replay changes the sample as well.
    #[test]
    fn samples_follow_assignment_flushing_and_hidden_surface_removal() {
        let mut trace = Synthetic {
            materials: 4,
            ..Synthetic::new([96, 96], 24)
        }
        .generate();
        trace.tables.meta.surfaces = Some(Surfaces {
            depth_tested: true,
            not_opaque: Vec::new(),
        });
        let (passes, tiles) = (trace.tables.passes.clone(), trace.tiles.clone());
        for frame in 1..3 {
            let again = passes.iter().map(|pass| Pass { frame, ..*pass });
            trace.tables.passes.extend(again);
            trace.tiles.extend(tiles.iter().cloned());
        }
        let plain = RunConfig {
            mode: Mode::Functional,
            level: Levels::two(LevelConfig::lru(2 << 10), LevelConfig::lru(64 << 10)),
            ..RunConfig::default()
        };
        let variants = [
            RunConfig {
                assign: Assign::Static,
                ..plain
            },
            RunConfig {
                between_frames: BetweenFrames::Flush,
                ..plain
            },
            RunConfig {
                hsr: Hsr::Deferred,
                ..plain
            },
        ];
        let sampled = |config: &RunConfig| {
            let found = counts(
                &trace,
                config,
                Order::MORTON,
                &Part::frames(&order::frames(&trace.tables.passes)),
            );
            let found = found.unwrap();
            let footprints = found.by_tile.iter().map(|tile| tile.1).sum::<u64>();
            (found.by_cluster.iter().sum::<u64>(), footprints)
        };
        for config in variants {
            let config = RunConfig {
                order: Order::MORTON,
                ..config
            };
            let expected = replay(&trace, &config).unwrap();
            assert_eq!(
                sampled(&config),
                (expected.l2.counters.line_misses, expected.footprints)
            );
            assert_ne!(
                sampled(&config),
                sampled(&plain),
                "the option has no effect here"
            );
        }
    }

    #[test]
    fn clusters_and_tiles_add_up_to_the_functional_replay() {
        let trace = Synthetic {
            materials: 4,
            ..Synthetic::one_layer([96, 64], 24)
        }
        .generate();
        let config = RunConfig {
            mode: Mode::Functional,
            level: Levels::two(LevelConfig::lru(1 << 10), LevelConfig::lru(8 << 10)),
            ..RunConfig::default()
        };
        for order in [Order::MORTON, Order::Z2_STA] {
            let frames = order::frames(&trace.tables.passes);
            let found = counts(&trace, &config, order, &Part::frames(&frames)).unwrap();
            let expected = replay(&trace, &RunConfig { order, ..config }).unwrap();
            assert_eq!(
                found.by_cluster.iter().sum::<u64>(),
                expected.l2.counters.line_misses
            );
            assert_eq!(found.by_cluster.len(), 16);
            assert_eq!(found.by_frame, [expected.l2.counters.line_misses]);
            // Each cluster has the same count alone as together with the others.
            let chosen: Vec<bool> = (0..16).map(|cluster| cluster % 5 == 1).collect();
            let part = Part {
                clusters: Some(&chosen),
                ..Part::frames(&frames)
            };
            let alone = counts(&trace, &config, order, &part).unwrap();
            for (cluster, chosen) in chosen.into_iter().enumerate() {
                let expected = if chosen { found.by_cluster[cluster] } else { 0 };
                assert_eq!(alone.by_cluster[cluster], expected);
            }
            let tiles = found.by_tile.iter();
            let (misses, footprints) = tiles.fold((0, 0), |(m, f), t| (m + t.0, f + t.1));
            assert_eq!(
                (misses, footprints),
                (expected.l2.counters.line_misses, expected.footprints)
            );
        }
    }
}
