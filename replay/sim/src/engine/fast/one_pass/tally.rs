//! Counts the misses of all caches of a level by the number of associativities that miss.
//!
//! Accesses are counted in batches and without branches, because whether a line misses is unpredictable.

use super::Shape;
use crate::engine::counts::Misses;
use crate::memory::{Forest, hashed};
use crate::stream::Bins;
use std::hint::select_unpredictable;

/// A line of a footprint that misses in some cache.
#[derive(Clone, Copy)]
pub(super) struct FootprintLine {
    pub(super) line: u32,
    pub(super) cell: u32,
    pub(super) tile: u32,
    /// Distinguishes the footprint from its neighbours.
    pub(super) footprint: u32,
}

impl FootprintLine {
    /// Placeholder before the first access.
    const NONE: Self = Self {
        line: 0,
        cell: 0,
        tile: 0,
        footprint: u32::MAX,
    };
}

/// The per-tile count.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ByTile {
    Footprints,
    Lines,
}

/// Counts by bin (a cell or a tile) and by the number of associativities that miss, from one on. Index zero
/// would belong to hits; it overlaps the previous bin, and nothing is added there.
#[derive(Clone)]
struct Classes<T> {
    /// Starts one before the first bin.
    counts: Vec<T>,
    classes: usize,
}

impl<T: Copy + Default> Classes<T> {
    fn new(bins: usize, classes: usize) -> Self {
        Self {
            counts: vec![T::default(); bins * classes + 1],
            classes,
        }
    }

    /// Adds what `of` counted since it was `since`.
    fn add_since(&mut self, of: &Self, since: &Self, add: impl Fn(T, T, T) -> T) {
        let counts = of.counts.iter().zip(&since.counts);
        for (total, (now, then)) in self.counts.iter_mut().zip(counts) {
            *total = add(*total, *now, *then);
        }
    }

    /// Counts of the associativity with this rank, by bin.
    fn of(&self, rank: usize, sum: impl Fn(&[T]) -> T) -> impl Iterator<Item = T> {
        let bins = self.counts[1..].chunks(self.classes);
        bins.map(move |counts| sum(&counts[rank..]))
    }
}

/// Misses of all caches with one number of sets.
#[derive(Clone)]
pub(super) struct Tally {
    pub(super) sets: u32,
    /// Whether a line's low bits are its set; else they are hashed.
    pub(super) is_modulo: bool,
    /// Associativities, ascending.
    ways: Vec<u32>,
    /// Number of associativities that miss a line, by its depth.
    missing: Vec<u8>,
    lines: Classes<u64>,
    footprints: Classes<u64>,
    tiles: Classes<u32>,
    by_tile: Option<ByTile>,
}

impl Tally {
    /// The largest associativity.
    pub(super) fn depth(&self) -> u32 {
        self.ways.last().copied().unwrap_or(0)
    }

    /// The number under which its caches hold a line.
    pub(super) fn placed(&self, line: u32) -> u32 {
        match self.is_modulo {
            true => line,
            false => hashed(line, self.sets.ilog2()),
        }
    }

    /// Counts accesses, footprint by footprint. `depths` has each line's depth in its stack.
    pub(super) fn count(&mut self, accesses: &[FootprintLine], depths: impl Iterator<Item = u8>) {
        match *self.ways {
            [ways] => self.count_one(ways as u8, accesses, depths),
            _ => self.count_several(accesses, depths),
        }
    }

    /// For one associativity: a footprint counts at its first miss.
    fn count_one(
        &mut self,
        ways: u8,
        accesses: &[FootprintLine],
        depths: impl Iterator<Item = u8>,
    ) {
        // Separate borrows, so that they stay in registers.
        let (lines, footprints) = (
            &mut self.lines.counts[1..],
            &mut self.footprints.counts[1..],
        );
        let (tiles, by_tile) = (&mut self.tiles.counts[1..], self.by_tile);
        let (mut footprint, mut missed_before) = (u32::MAX, false);
        for (access, depth) in accesses.iter().zip(depths) {
            let misses = depth >= ways;
            missed_before &= access.footprint == footprint;
            footprint = access.footprint;
            let first = misses & !missed_before;
            missed_before |= misses;
            lines[access.cell as usize] += u64::from(misses);
            footprints[access.cell as usize] += u64::from(first);
            if let Some(by_tile) = by_tile {
                let counts = match by_tile {
                    ByTile::Footprints => first,
                    ByTile::Lines => misses,
                };
                let total = &mut tiles[access.tile as usize];
                *total = total.wrapping_add(u32::from(counts));
            }
        }
    }

    /// For several associativities: a footprint counts at its end, by the most associativities that miss
    /// any of its lines.
    fn count_several(&mut self, accesses: &[FootprintLine], depths: impl Iterator<Item = u8>) {
        let classes = self.ways.len();
        let place = |bin: u32, missing: u8| bin as usize * classes + usize::from(missing);
        let (lines, footprints) = (&mut *self.lines.counts, &mut *self.footprints.counts);
        let (tiles, by_tile, missing) = (&mut *self.tiles.counts, self.by_tile, &*self.missing);
        let mut tile = |what, bin, missing: u8, count: bool| {
            if by_tile == Some(what) {
                let total = &mut tiles[place(bin, missing)];
                *total = total.wrapping_add(u32::from(count));
            }
        };
        let mut last = FootprintLine::NONE;
        // The most associativities that miss a line of the current footprint.
        let mut most = 0;
        for (access, depth) in accesses.iter().zip(depths) {
            let missing = missing[usize::from(depth)];
            let ended = access.footprint != last.footprint;
            let counts = ended & (most > 0);
            footprints[place(last.cell, most)] += u64::from(counts);
            tile(ByTile::Footprints, last.tile, most, counts);
            most = missing.max(select_unpredictable(ended, 0, most));
            lines[place(access.cell, missing)] += u64::from(missing > 0);
            tile(ByTile::Lines, access.tile, missing, missing > 0);
            last = *access;
        }
        footprints[place(last.cell, most)] += u64::from(most > 0);
        tile(ByTile::Footprints, last.tile, most, most > 0);
    }

    /// Misses of the associativity with this rank, by cell.
    pub(super) fn misses(&self, rank: usize) -> impl Iterator<Item = Misses> {
        let sum = |counts: &[u64]| counts.iter().sum();
        let footprints = self.footprints.of(rank, sum);
        self.lines
            .of(rank, sum)
            .zip(footprints)
            .map(|(lines, footprints)| Misses {
                footprints,
                lines,
                secondary: 0,
            })
    }

    pub(super) fn tile_misses(&self, rank: usize) -> impl Iterator<Item = u32> {
        let sum = |counts: &[u32]| counts.iter().copied().fold(0, u32::wrapping_add);
        self.tiles.of(rank, sum)
    }

    pub(super) fn rank(&self, ways: u32) -> usize {
        self.ways.partition_point(|&w| w < ways)
    }
}

/// All caches of a level that receive the same lines.
#[derive(Clone)]
pub(super) struct LevelTallies {
    /// By number of sets, ascending.
    pub(super) tallies: Vec<Tally>,
}

impl LevelTallies {
    pub(super) fn new(
        bins: &Bins,
        by_tile: Option<ByTile>,
        geometries: impl Iterator<Item = Shape>,
    ) -> Self {
        let mut sorted: Vec<Shape> = geometries.collect();
        sorted.sort_unstable();
        sorted.dedup();
        let tally = |same_sets: &[Shape]| {
            let ways: Vec<u32> = same_sets.iter().map(|of| of.ways).collect();
            let depth = ways.last().copied().unwrap_or(0);
            let missing = |depth| ways.iter().filter(|&&w| w <= depth).count() as u8;
            let tiles = by_tile.map_or(0, |_| bins.tiles());
            Tally {
                sets: same_sets[0].sets,
                is_modulo: same_sets[0].is_modulo,
                missing: (0..=depth).map(missing).collect(),
                lines: Classes::new(bins.cells(), ways.len()),
                footprints: Classes::new(bins.cells(), ways.len()),
                tiles: Classes::new(tiles, ways.len()),
                by_tile,
                ways,
            }
        };
        Self {
            tallies: (sorted.chunk_by(|a, b| (a.is_modulo, a.sets) == (b.is_modulo, b.sets)))
                .map(tally)
                .collect(),
        }
    }

    /// Adds what the same caches of another treatment counted since their counts were `since`.
    pub(super) fn add_since(&mut self, of: &Self, since: &Self) {
        let counted = of.tallies.iter().zip(&since.tallies);
        for (tally, (of, since)) in self.tallies.iter_mut().zip(counted) {
            let add = |total: u64, now: u64, then| total + (now - then);
            tally.lines.add_since(&of.lines, &since.lines, add);
            tally
                .footprints
                .add_since(&of.footprints, &since.footprints, add);
            let add = |total: u32, now: u32, then| total.wrapping_add(now.wrapping_sub(then));
            tally.tiles.add_since(&of.tiles, &since.tiles, add);
        }
    }

    /// Number of counters.
    pub(super) fn counters(&self) -> usize {
        let of = |tally: &Tally| tally.lines.counts.len() + tally.footprints.counts.len();
        self.tallies.iter().map(of).sum()
    }

    pub(super) fn forest(&self) -> Forest {
        let tree = |tally: &Tally| (tally.sets, tally.depth());
        Forest::new(&self.tallies.iter().map(tree).collect::<Vec<_>>())
    }

    /// Index of the number of sets, and rank of the associativity.
    pub(super) fn find(&self, shape: Shape) -> (usize, usize) {
        let place = (shape.is_modulo, shape.sets);
        let before = |tally: &Tally| (tally.is_modulo, tally.sets) < place;
        let tree = self.tallies.partition_point(before);
        (tree, self.tallies[tree].rank(shape.ways))
    }
}
