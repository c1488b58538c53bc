//! Many LRU hierarchies in one pass over an order's lines, each counted as if it were alone.
//!
//! Without latencies the cores' interleaving does not depend on what the caches hold, so all
//! configurations see the same accesses. These come in batches, and a batch goes through one number of sets
//! after another ([`tally`](super::tally)): what lay on top of its stack needs no further search. One [`Level`]
//! stands for all L1 caches of all cores; under each L1 size and associativity another stands for all L2 caches,
//! since what reaches those are the misses of that L1. The L2 levels know nothing of each other and
//! take a batch in parallel.

use super::Machine;
use super::batch::Outcome;
use super::counts::{CacheCounts, CellMisses, TileMisses};
use super::tally::{Level, Place, TileCounts};
use crate::cache::Access;
use crate::config::{Assign, CacheConfig, Replacement, RunConfig};
use crate::order::Phase;
use crate::stream::{Bins, Consumer, Cores, QuadLines, StreamError, interleave};
use rayon::prelude::*;

/// Sets and ways of a cache.
pub type Geometry = (u32, u32);

/// Both levels of a configuration.
pub type LevelGeometry = (Geometry, Geometry);

/// Accesses of a batch: few enough to stay in the processor's own caches.
const BATCH: usize = 8192;

/// The geometry of a configuration, if all its caches are LRU.
pub fn geometry(config: &RunConfig) -> Option<LevelGeometry> {
    let of = |cache: &CacheConfig, level| {
        let lru = cache.replacement == Replacement::LRU;
        let sets = cache.sets(level, config.line_bytes).ok()?;
        lru.then_some((sets, cache.ways))
    };
    Some((of(&config.l1, "L1")?, of(&config.l2, "L2")?))
}

/// Accesses of all cores in the order of time.
#[derive(Default)]
struct Batch {
    accesses: Vec<Access>,
    /// By footprint.
    places: Vec<Place>,
}

impl Batch {
    #[inline(always)]
    fn add(&mut self, core: usize, quad: &QuadLines<'_>) {
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                let number = self.places.len() as u32;
                self.places.push(Place {
                    cache: core as u32,
                    cell: footprint.cell as u32,
                    tile: quad.tile() as u32,
                });
                let access = |&line: &u32| Access {
                    line,
                    footprint: number,
                };
                self.accesses.extend(footprint.lines.iter().map(access));
            }
        }
    }
}

/// All L2 caches under one L1.
struct Under {
    /// The L1: which of the numbers of sets, and which of its associativities.
    tree: usize,
    rank: usize,
    level: Level,
    /// The L1's misses.
    accesses: Vec<Access>,
}

/// A set of LRU hierarchies.
pub struct OnePass {
    l1: Level,
    /// By number of sets and associativity of the L1.
    under: Vec<Under>,
    batch: Batch,
}

impl OnePass {
    /// Empty caches of all `geometries`, of which there is at least one.
    pub fn new(bins: &Bins, cores: u32, tile_maps: bool, geometries: &[LevelGeometry]) -> Self {
        let counts = |of| if tile_maps { of } else { TileCounts::None };
        let l1 = geometries.iter().map(|g| g.0);
        let l1 = Level::new(bins, cores as usize, counts(TileCounts::Footprints), l1);
        let mut distinct: Vec<Geometry> = geometries.iter().map(|g| g.0).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let under = distinct.iter().map(|&of| {
            let below = geometries.iter().filter(|g| g.0 == of).map(|g| g.1);
            let (tree, rank) = l1.find(of);
            Under {
                tree,
                rank,
                level: Level::new(bins, 1, counts(TileCounts::Lines), below),
                accesses: Vec::new(),
            }
        });
        Self {
            under: under.collect(),
            l1,
            batch: Batch::default(),
        }
    }

    /// What one of the hierarchies missed.
    fn counts(&self, (l1, l2): LevelGeometry) -> CacheCounts {
        let (tree, rank) = self.l1.find(l1);
        let first = self.l1.tally(tree);
        let under = self
            .under
            .partition_point(|u| (u.tree, u.rank) < (tree, rank));
        let level = &self.under[under].level;
        let (tree, l2_rank) = level.find(l2);
        let second = level.tally(tree);
        let cells = first.misses(rank).zip(second.misses(l2_rank));
        let tiles = first.tile_misses(rank).zip(second.tile_misses(l2_rank));
        CacheCounts {
            cells: cells.map(|(l1, l2)| CellMisses { l1, l2 }).collect(),
            tiles: tiles
                .map(|(l1_footprints, l2_lines)| TileMisses {
                    l1_footprints,
                    l2_lines,
                })
                .collect(),
        }
    }

    /// Sends the batch through all caches.
    #[inline(never)]
    fn run_batch(&mut self) {
        let Self { l1, under, batch } = self;
        let Batch { accesses, places } = batch;
        let first_of_tree: Vec<usize> = (0..l1.trees())
            .map(|tree| under.partition_point(|u| u.tree < tree))
            .collect();
        let own = |place: &Place| place.cache as usize;
        l1.run(accesses, places, own, |tree, access, missing| {
            // The caches of fewer ways miss what one of more ways misses.
            let below = &mut under[first_of_tree[tree]..][..missing.into()];
            for under in below {
                under.accesses.push(*access);
            }
        });
        let places = &**places;
        under.par_iter_mut().for_each(|under| {
            let Under {
                level, accesses, ..
            } = under;
            level.run(accesses, places, |_| 0, |_, _, _| {});
            accesses.clear();
        });
        batch.accesses.clear();
        batch.places.clear();
    }
}

impl Consumer for OnePass {
    #[inline(always)]
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        if quad.lines.is_empty() {
            return;
        }
        self.batch.add(core, &quad);
        if self.batch.accesses.len() >= BATCH {
            self.run_batch();
        }
    }
}

impl Machine for OnePass {
    fn run(
        &mut self,
        cores: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
    ) -> Result<(), StreamError> {
        interleave(cores, phases, assign, self)?;
        self.run_batch();
        Ok(())
    }

    fn flush(&mut self) {
        self.l1.clear();
        self.under.iter_mut().for_each(|under| under.level.clear());
    }

    fn outcome(&self, config: &RunConfig) -> Outcome {
        // Only configurations with a geometry are put into a pass.
        let counts = geometry(config).map(|geometry| self.counts(geometry));
        let mut counts = counts.unwrap_or_else(|| CacheCounts {
            cells: Vec::new(),
            tiles: Vec::new(),
        });
        if !config.tile_maps {
            counts.tiles.clear();
        }
        counts.into()
    }
}
