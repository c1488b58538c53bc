//! Simulates many LRU hierarchies in one pass over an order's lines.
//!
//! Without latencies, the interleaving of cores does not depend on cache contents, so all configurations
//! see the same accesses. One [`Forest`] per core represents all L1 caches. The misses of each L1 size and
//! associativity go to another forest, which represents all L2 caches below it. A level's misses are
//! counted per number of sets, by the number of associativities that miss. Only the L1 caches are simulated
//! line by line; their misses are collected and processed in batches by the L2 caches and the counters
//! ([`pending`]).

mod pending;
mod tally;

use self::pending::{PendingLines, Under};
use self::tally::{ByTile, FootprintLine, LevelTallies};
use crate::config::{LevelConfig, RunConfig};
use crate::engine::counts::{CacheCounts, CellMisses, TileMisses};
use crate::engine::machine::{AtOnce, FrameWork, Machine};
use crate::engine::outcome::MachineOutcome;
use crate::memory::{Forest, OtherWork};
use crate::stream::{Bins, Consumer, QuadLines, StreamError, Tag, interleave};

/// Sets and ways of a cache.
pub type SetsAndWays = (u32, u32);

/// Sets and ways of both levels.
pub(crate) type LevelGeometry = (SetsAndWays, SetsAndWays);

/// The geometry of a configuration with a shared L2 whose caches are all plain LRU.
pub fn geometry(config: &RunConfig) -> Option<LevelGeometry> {
    if !config.level.l2.shared {
        return None;
    }
    let of = |cache: &LevelConfig, level| {
        let lru = cache.is_plain_lru();
        let sets = cache.sets(level, config.line_bytes).ok()?;
        lru.then_some((sets, cache.ways))
    };
    Some((of(&config.level.l1, "L1")?, of(&config.level.l2, "L2")?))
}

/// A set of LRU hierarchies.
pub(crate) struct OnePass {
    l1: LevelTallies,
    /// One per core.
    forests: Vec<Forest>,
    under: Vec<Under>,
    /// The smallest associativity of the L1 caches.
    least_ways: u32,
    pending: PendingLines,
}

impl OnePass {
    /// Empty caches of at least one geometry.
    pub fn new(bins: &Bins, cores: u32, tile_maps: bool, geometries: &[LevelGeometry]) -> Self {
        let by_tile = |what| tile_maps.then_some(what);
        let l1 = geometries.iter().map(|g| g.0);
        let l1 = LevelTallies::new(bins, by_tile(ByTile::Footprints), l1);
        let mut distinct: Vec<SetsAndWays> = geometries.iter().map(|g| g.0).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let under = distinct.iter().map(|&of| {
            let below = geometries.iter().filter(|g| g.0 == of).map(|g| g.1);
            let level = LevelTallies::new(bins, by_tile(ByTile::Lines), below);
            let (tree, rank) = l1.find(of);
            Under {
                tree,
                ways: of.1 as u8,
                rank,
                forest: level.forest(),
                level,
            }
        });
        Self {
            forests: (0..cores).map(|_| l1.forest()).collect(),
            least_ways: distinct.iter().map(|g| g.1).min().unwrap_or(0),
            pending: PendingLines::new(l1.tallies.len()),
            under: under.collect(),
            l1,
        }
    }

    /// The misses of one hierarchy.
    fn counts(&self, (l1, l2): LevelGeometry) -> CacheCounts {
        let (tree, rank) = self.l1.find(l1);
        let first = &self.l1.tallies[tree];
        let under = self
            .under
            .partition_point(|u| (u.tree, u.rank) < (tree, rank));
        let level = &self.under[under].level;
        let (tree, l2_rank) = level.find(l2);
        let second = &level.tallies[tree];
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

    /// Accesses the lines from `index` to `end`.
    #[inline(always)]
    fn access(&mut self, core: usize, quad: &QuadLines<'_>, mut index: usize, end: usize) {
        loop {
            let (lines, ways) = (&quad.lines[index..end], self.least_ways);
            let depths = self.pending.next_depths();
            index += self.forests[core].access_all(lines, ways, depths);
            if index == end {
                return;
            }
            index = self.missed(core, quad, index);
        }
    }

    /// Handles a miss in some L1: the depths of the line at `index` are pending. Accesses the rest of its footprint.
    #[inline(never)]
    fn missed(&mut self, core: usize, quad: &QuadLines<'_>, mut index: usize) -> usize {
        let (cell, tile) = (quad.cell(index) as u32, quad.tile() as u32);
        let footprint = self.pending.footprint();
        loop {
            self.pending.push(FootprintLine {
                line: quad.lines[index],
                cell,
                tile,
                footprint,
            });
            index += 1;
            if quad.tags.get(index).is_none_or(|tag| tag.is_first()) {
                break;
            }
            self.forests[core].access(quad.lines[index], self.pending.next_depths());
        }
        if self.pending.is_full() {
            self.drain();
        }
        index
    }

    #[inline(never)]
    fn drain(&mut self) {
        self.pending.drain(&mut self.l1, &mut self.under);
    }
}

impl Consumer for OnePass {
    #[inline]
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let end = quad.lines.len();
        if self.least_ways >= 4 {
            // The lines of a footprint cannot evict each other, so its repeats hit.
            self.access(core, &quad, 0, end);
            return;
        }
        let mut index = 0;
        while index < end {
            let next = quad.end_of_footprint(index);
            let safe = next - index <= self.least_ways as usize;
            let repeats = if safe { 0 } else { quad.tags[index].repeats() };
            for _ in 0..=repeats {
                self.access(core, &quad, index, next);
            }
            index = next;
        }
    }
}

impl Machine for OnePass {
    fn run(&mut self, frame: FrameWork) -> Result<(), StreamError> {
        let answer = interleave(frame.cores, frame.phases, frame.assign, self);
        self.drain();
        answer
    }

    fn flush(&mut self) {
        self.forests.iter_mut().for_each(Forest::clear);
        self.under.iter_mut().for_each(|under| under.forest.clear());
    }

    fn lose(&mut self, other: OtherWork) {
        self.forests.iter_mut().for_each(Forest::clear);
        for under in &mut self.under {
            for (tree, tally) in under.level.tallies.iter().enumerate() {
                let lines = other.lines(u64::from(tally.sets) * u64::from(tally.depth()), 0);
                under.forest.access_tree(tree, lines, &mut Vec::new());
            }
        }
    }

    fn outcome(&self, config: &RunConfig) -> MachineOutcome {
        // Only configurations with a geometry are in a group of several.
        let counts = geometry(config).map(|geometry| self.counts(geometry));
        let mut counts = counts.unwrap_or_default();
        if !config.tile_maps {
            counts.tiles.clear();
        }
        counts.into()
    }
}

impl AtOnce for OnePass {
    fn lines(&mut self, lines: &[u32], tags: &[Tag], missed: &mut Vec<u32>) {
        let quad = QuadLines::of_lines(lines, tags);
        let mut index = 0;
        loop {
            let depths = self.pending.next_depths();
            index += self.forests[0].access_all(&lines[index..], self.least_ways, depths);
            let Some(&line) = lines.get(index) else {
                return;
            };
            missed.push(line);
            index = self.missed(0, &quad, index);
        }
    }

    fn finish(&mut self) {
        self.drain();
    }
}
