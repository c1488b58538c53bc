//! Many LRU hierarchies in one pass over an order's lines, each counted as if it were alone.
//!
//! Without latencies the cores' interleaving does not depend on what the caches hold, so all
//! configurations see the same accesses. One [`Forest`] a core stands for all L1 caches; under each
//! L1 size and associativity a forest stands for all L2 caches, since what reaches those are the
//! misses of that L1. A level's misses are counted once a number of sets, by how many of its
//! associativities they miss.

use super::Machine;
use super::batch::Outcome;
use super::counts::{CacheCounts, CellMisses, Misses, TileMisses};
use crate::cache::Forest;
use crate::config::{Assign, CacheConfig, Replacement, RunConfig};
use crate::order::Phase;
use crate::stream::{Bins, Consumer, Cores, QuadLines, StreamError, interleave};

/// Sets and ways of a cache.
pub type Geometry = (u32, u32);

/// Both levels of a configuration.
pub type LevelGeometry = (Geometry, Geometry);

/// The geometry of a configuration, if all its caches are LRU.
pub fn geometry(config: &RunConfig) -> Option<LevelGeometry> {
    let of = |cache: &CacheConfig, level| {
        let lru = cache.replacement == Replacement::LRU;
        let sets = cache.sets(level, config.line_bytes).ok()?;
        lru.then_some((sets, cache.ways))
    };
    Some((of(&config.l1, "L1")?, of(&config.l2, "L2")?))
}

/// Misses of all caches of one number of sets.
struct Tally {
    sets: u32,
    /// Associativities, ascending.
    ways: Vec<u32>,
    /// How many of the associativities miss a line, by its depth.
    missing: Vec<u8>,
    /// By cell and number of associativities that miss, from one on.
    lines: Vec<u64>,
    footprints: Vec<u64>,
    /// By tile likewise: footprints of an L1, lines of an L2.
    tiles: Vec<u32>,
}

impl Tally {
    fn depth(&self) -> u32 {
        self.ways.last().copied().unwrap_or(0)
    }

    /// Counts one footprint: for each of its lines how many associativities miss it.
    #[inline(always)]
    fn count(&mut self, cell: usize, line_depths: impl Iterator<Item = u8>) -> FootprintTally {
        let classes = self.ways.len();
        let mut of = FootprintTally::default();
        for depth in line_depths {
            let missing = self.missing[usize::from(depth)];
            if missing > 0 {
                self.lines[cell * classes + usize::from(missing) - 1] += 1;
                of.most = of.most.max(missing);
                of.lines = of.lines << 8 | u32::from(missing);
            }
        }
        if of.most > 0 {
            self.footprints[cell * classes + usize::from(of.most) - 1] += 1;
        }
        of
    }

    #[inline(always)]
    fn tile(&mut self, tile: usize, missing: u8) {
        let slot = tile * self.ways.len() + usize::from(missing) - 1;
        if let Some(count) = self.tiles.get_mut(slot) {
            *count = count.wrapping_add(1);
        }
    }

    /// Misses of one associativity, the `rank`-th, by cell.
    fn misses(&self, rank: usize) -> impl Iterator<Item = Misses> {
        let classes = self.ways.len();
        let sum = move |counts: &[u64]| counts[rank..].iter().sum();
        let cells = self
            .lines
            .chunks(classes)
            .zip(self.footprints.chunks(classes));
        cells.map(move |(lines, footprints)| Misses {
            footprints: sum(footprints),
            lines: sum(lines),
            secondary: 0,
        })
    }

    fn tile_misses(&self, rank: usize) -> impl Iterator<Item = u32> {
        let sum = move |counts: &[u32]| counts[rank..].iter().copied().fold(0, u32::wrapping_add);
        self.tiles.chunks(self.ways.len()).map(sum)
    }

    fn rank(&self, ways: u32) -> usize {
        self.ways.partition_point(|&w| w < ways)
    }
}

/// How many associativities the missing lines of a footprint miss.
#[derive(Clone, Copy, Default)]
struct FootprintTally {
    most: u8,
    /// A byte each, so that all of it lies in a register.
    lines: u32,
}

impl FootprintTally {
    #[inline(always)]
    fn lines(self) -> impl Iterator<Item = u8> {
        let mut left = self.lines;
        std::iter::from_fn(move || {
            let missing = left as u8;
            left >>= 8;
            (missing > 0).then_some(missing)
        })
    }
}

/// All caches of a level that see the same lines.
struct Level {
    tallies: Vec<Tally>,
}

impl Level {
    fn new(bins: &Bins, tile_maps: bool, geometries: impl Iterator<Item = Geometry>) -> Self {
        let mut sorted: Vec<Geometry> = geometries.collect();
        sorted.sort_unstable();
        sorted.dedup();
        let tally = |same_sets: &[Geometry]| {
            let ways: Vec<u32> = same_sets.iter().map(|&(_, ways)| ways).collect();
            let depth = ways.last().copied().unwrap_or(0);
            let missing = |depth| ways.iter().filter(|&&w| w <= depth).count() as u8;
            let tiles = if tile_maps { bins.tiles() } else { 0 };
            Tally {
                sets: same_sets[0].0,
                missing: (0..=depth).map(missing).collect(),
                lines: vec![0; bins.cells() * ways.len()],
                footprints: vec![0; bins.cells() * ways.len()],
                tiles: vec![0; tiles * ways.len()],
                ways,
            }
        };
        Self {
            tallies: sorted.chunk_by(|a, b| a.0 == b.0).map(tally).collect(),
        }
    }

    fn forest(&self) -> Forest {
        let tree = |tally: &Tally| (tally.sets, tally.depth());
        Forest::new(&self.tallies.iter().map(tree).collect::<Vec<_>>())
    }

    /// Number of sets and rank of the associativity.
    fn find(&self, (sets, ways): Geometry) -> (usize, usize) {
        let tree = self.tallies.partition_point(|tally| tally.sets < sets);
        (tree, self.tallies[tree].rank(ways))
    }
}

/// All L2 caches under one L1.
struct Under {
    /// The L1: number of sets, ways, and rank of these.
    tree: usize,
    ways: u32,
    rank: usize,
    level: Level,
    forest: Forest,
}

/// A set of LRU hierarchies.
pub struct OnePass {
    l1: Level,
    /// By core.
    forests: Vec<Forest>,
    under: Vec<Under>,
    /// Every L1 cache has at least so many ways.
    least_ways: u32,
    /// Depths of a footprint's lines in the L1: line by line, by number of sets.
    depths: Vec<u8>,
    /// Depths of its missing lines in the L2.
    l2_depths: Vec<u8>,
}

impl OnePass {
    /// Empty caches of all `geometries`, of which there is at least one.
    pub fn new(bins: &Bins, cores: u32, tile_maps: bool, geometries: &[LevelGeometry]) -> Self {
        let l1 = Level::new(bins, tile_maps, geometries.iter().map(|g| g.0));
        let mut distinct: Vec<Geometry> = geometries.iter().map(|g| g.0).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let under = distinct.iter().map(|&of| {
            let below = geometries.iter().filter(|g| g.0 == of).map(|g| g.1);
            let level = Level::new(bins, tile_maps, below);
            let (tree, rank) = l1.find(of);
            Under {
                tree,
                ways: of.1,
                rank,
                forest: level.forest(),
                level,
            }
        });
        let under: Vec<Under> = under.collect();
        let widest = under.iter().map(|u| u.level.tallies.len()).max();
        Self {
            forests: (0..cores).map(|_| l1.forest()).collect(),
            least_ways: distinct.iter().map(|g| g.1).min().unwrap_or(0),
            depths: vec![0; 4 * l1.tallies.len()],
            l2_depths: vec![0; 4 * widest.unwrap_or(0)],
            l1,
            under,
        }
    }

    /// What one of the hierarchies missed.
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
            index += self.forests[core].access_all(lines, ways, &mut self.depths);
            if index == end {
                return;
            }
            index = self.missed(core, quad, index);
        }
    }

    /// The line at `index` missed some L1: accesses the others of its footprint and counts.
    #[inline(never)]
    fn missed(&mut self, core: usize, quad: &QuadLines<'_>, index: usize) -> usize {
        let trees = self.l1.tallies.len();
        let end = quad.end_of_footprint(index);
        let lines = &quad.lines[index..end];
        for (line, depths) in lines.iter().zip(self.depths.chunks_mut(trees)).skip(1) {
            self.forests[core].access(*line, depths);
        }
        let (cell, tile) = (quad.cell(index), quad.tile());
        let depths = &self.depths[..lines.len() * trees];
        for (tree, tally) in self.l1.tallies.iter_mut().enumerate() {
            let of = tally.count(cell, depths.iter().skip(tree).step_by(trees).copied());
            if of.most > 0 {
                tally.tile(tile, of.most);
            }
        }
        for under in &mut self.under {
            let l2_trees = under.level.tallies.len();
            let (mut missing, mut searched) = (0, 0);
            for (&line, depths) in lines.iter().zip(depths.chunks(trees)) {
                if u32::from(depths[under.tree]) >= under.ways {
                    let l2_depths = &mut self.l2_depths[missing * l2_trees..];
                    let on_top = under.forest.access(line, &mut l2_depths[..l2_trees]);
                    searched = searched.max(on_top);
                    missing += 1;
                }
            }
            if missing == 0 {
                continue;
            }
            let depths = &self.l2_depths[..missing * l2_trees];
            // Larger numbers of sets have all lines on top.
            for (tree, tally) in under.level.tallies[..searched].iter_mut().enumerate() {
                let of = tally.count(cell, depths.iter().skip(tree).step_by(l2_trees).copied());
                for missing in of.lines() {
                    tally.tile(tile, missing);
                }
            }
        }
        end
    }
}

impl Consumer for OnePass {
    #[inline]
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let end = quad.lines.len();
        if self.least_ways >= 4 {
            // The lines of a footprint cannot crowd each other out: repeats find all of them.
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
    fn run(
        &mut self,
        cores: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
    ) -> Result<(), StreamError> {
        interleave(cores, phases, assign, self)
    }

    fn flush(&mut self) {
        self.forests.iter_mut().for_each(Forest::clear);
        self.under.iter_mut().for_each(|under| under.forest.clear());
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
