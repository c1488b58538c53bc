//! The caches and counts of one treatment between frames.
//!
//! One [`Forest`] per core represents all L1 caches. The misses of each L1 size and associativity go to another
//! forest, which represents all L2 caches below it. A level's misses are counted per number of sets, by the
//! number of associativities that miss. Only the L1 caches are simulated line by line; their misses are collected
//! and processed in batches by the L2 caches and the counters ([`super::pending`]).

use super::pending::{PendingLines, Under};
use super::tally::{ByTile, FootprintLine, LevelTallies};
use super::{LevelGeometry, Shape};
use crate::config::{BetweenFrames, RunConfig};
use crate::engine::counts::{CacheCounts, CellMisses, TileMisses};
use crate::memory::{Forest, OtherWork};
use crate::stream::{Bins, QuadLines, Tag};

/// A set of LRU hierarchies with one treatment between frames.
///
/// Its L1 caches, or some of its L2 caches, may *follow* those of another treatment for the rest of a frame:
/// their contents are the same, so only the other one is simulated.
pub(super) struct History {
    pub(super) between: BetweenFrames,
    l1: LevelTallies,
    /// One per core.
    forests: Vec<Forest>,
    under: Vec<Under>,
    /// The smallest associativity of the L1 caches.
    least_ways: u32,
    pending: PendingLines,
    /// The other treatment's counts of the L1 caches when these started to follow.
    l1_followed_since: Option<LevelTallies>,
}

/// Counts of the L1 caches and of the L2 caches under each.
pub(super) type Counts = (LevelTallies, Vec<LevelTallies>);

/// Lines of the L1 caches and of the L2 caches under each.
pub(super) type Contents = (Vec<Forest>, Vec<Forest>);

impl History {
    /// Empty caches of at least one geometry.
    pub(super) fn new(
        bins: &Bins,
        cores: u32,
        tile_maps: bool,
        geometries: &[LevelGeometry],
        between: BetweenFrames,
    ) -> Self {
        let by_tile = |what| tile_maps.then_some(what);
        let l1 = geometries.iter().map(|g| g.0);
        let l1 = LevelTallies::new(bins, by_tile(ByTile::Footprints), l1);
        let mut distinct: Vec<Shape> = geometries.iter().map(|g| g.0).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let under = distinct.iter().map(|&of| {
            let below = geometries.iter().filter(|g| g.0 == of).map(|g| g.1);
            let level = LevelTallies::new(bins, by_tile(ByTile::Lines), below);
            let (tree, rank) = l1.find(of);
            Under {
                tree,
                ways: of.ways as u8,
                rank,
                forest: level.forest(),
                level,
                followed_since: None,
            }
        });
        Self {
            between,
            l1_followed_since: None,
            forests: (0..cores).map(|_| l1.forest()).collect(),
            least_ways: distinct.iter().map(|g| g.ways).min().unwrap_or(0),
            pending: PendingLines::new(l1.tallies.len()),
            under: under.collect(),
            l1,
        }
    }

    /// The misses of one hierarchy.
    pub(super) fn counts(&self, (l1, l2): LevelGeometry) -> CacheCounts {
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
    fn access(
        &mut self,
        followers: &mut [Self],
        core: usize,
        quad: &QuadLines<'_>,
        mut index: usize,
        end: usize,
    ) {
        loop {
            let (lines, ways) = (&quad.lines[index..end], self.least_ways);
            let depths = self.pending.next_depths();
            index += self.forests[core].access_all(lines, ways, depths);
            if index == end {
                return;
            }
            index = self.missed(followers, core, quad, index);
        }
    }

    /// Handles a miss in some L1: the depths of the line at `index` are pending. Accesses the rest of its footprint.
    #[inline(never)]
    fn missed(
        &mut self,
        followers: &mut [Self],
        core: usize,
        quad: &QuadLines<'_>,
        mut index: usize,
    ) -> usize {
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
            self.drain(followers);
        }
        index
    }

    /// Counts all pending accesses and sends their misses to the L2 caches, also to those of followers of the L1.
    #[inline(never)]
    pub(super) fn drain(&mut self, followers: &mut [Self]) {
        self.pending.count(&mut self.l1);
        for (index, under) in self.under.iter_mut().enumerate() {
            self.pending.select(under.tree, under.ways);
            for follower in followers.iter_mut().filter(|other| !other.is_apart()) {
                let other = &mut follower.under[index];
                if other.followed_since.is_none() {
                    self.pending.send(other);
                }
            }
            self.pending.send(under);
            for follower in followers.iter_mut().filter(|other| !other.is_apart()) {
                follower.under[index].follow(under);
            }
        }
        self.pending.clear();
    }

    /// True if its L1 caches are simulated.
    pub(super) fn is_apart(&self) -> bool {
        self.l1_followed_since.is_none()
    }

    /// True if the L1 caches have the same contents.
    pub(super) fn has_l1_of(&self, first: &Self) -> bool {
        self.forests == first.forests
    }

    /// Follows the L1 caches of `first`, which have the same contents and no pending accesses.
    pub(super) fn follow(&mut self, first: &Self) {
        self.drain(&mut []);
        self.l1_followed_since = Some(first.l1.clone());
        for (under, of_first) in self.under.iter_mut().zip(&first.under) {
            under.follow(of_first);
        }
    }

    /// Takes the contents and counts of the caches that it followed.
    pub(super) fn catch_up(&mut self, first: &Self) {
        if let Some(since) = self.l1_followed_since.take() {
            self.l1.add_since(&first.l1, &since);
            self.forests.clone_from(&first.forests);
        }
        for (under, of_first) in self.under.iter_mut().zip(&first.under) {
            if let Some(since) = under.followed_since.take() {
                under.level.add_since(&of_first.level, &since);
                under.forest.clone_from(&of_first.forest);
            }
        }
    }

    #[inline(always)]
    pub(super) fn quad(&mut self, followers: &mut [Self], core: usize, quad: QuadLines<'_>) {
        let end = quad.lines.len();
        if self.least_ways >= 4 {
            // The lines of a footprint cannot evict each other, so its repeats hit.
            self.access(followers, core, &quad, 0, end);
            return;
        }
        let mut index = 0;
        while index < end {
            let next = quad.end_of_footprint(index);
            let safe = next - index <= self.least_ways as usize;
            let repeats = if safe { 0 } else { quad.tags[index].repeats() };
            for _ in 0..=repeats {
                self.access(followers, core, &quad, index, next);
            }
            index = next;
        }
    }

    /// Accesses lines on the first core, each as a footprint of its own.
    pub(super) fn lines(&mut self, lines: &[u32], tags: &[Tag], missed: &mut Vec<u32>) {
        let quad = QuadLines::of_lines(lines, tags);
        let mut index = 0;
        loop {
            let depths = self.pending.next_depths();
            index += self.forests[0].access_all(&lines[index..], self.least_ways, depths);
            let Some(&line) = lines.get(index) else {
                return;
            };
            missed.push(line);
            index = self.missed(&mut [], 0, &quad, index);
        }
    }

    /// What determines the hits and misses of later accesses, between two frames.
    pub(super) fn contents(&self) -> (&[Forest], Vec<&Forest>) {
        let under = self.under.iter().map(|under| &under.forest);
        (&self.forests, under.collect())
    }

    /// The counts up to now, between two frames.
    pub(super) fn counts_so_far(&self) -> Counts {
        let under = self.under.iter().map(|under| under.level.clone());
        (self.l1.clone(), under.collect())
    }

    /// Size of contents and two sets of counts.
    pub(super) fn bytes(&self) -> usize {
        let (l1, l2) = self.contents();
        let lines: usize = l1.iter().chain(l2).map(Forest::lines).sum();
        let levels = std::iter::once(&self.l1).chain(self.under.iter().map(|under| &under.level));
        let counters: usize = levels.map(LevelTallies::counters).sum();
        lines * size_of::<u32>() + 2 * counters * size_of::<u64>()
    }

    /// Counts what an earlier frame counted, and takes the contents that it left.
    pub(super) fn repeat(&mut self, before: &Counts, after: &Counts, left: &Contents) {
        self.l1.add_since(&after.0, &before.0);
        self.forests.clone_from(&left.0);
        let counts = before.1.iter().zip(&after.1);
        for ((under, (before, after)), forest) in self.under.iter_mut().zip(counts).zip(&left.1) {
            under.level.add_since(after, before);
            under.forest.clone_from(forest);
        }
    }

    /// Applies the treatment after the frame with this index.
    pub(super) fn between_frames(&mut self, index: usize, config: &RunConfig) {
        match self.between {
            BetweenFrames::Keep => (),
            BetweenFrames::Flush => {
                self.forests.iter_mut().for_each(Forest::clear);
                self.under.iter_mut().for_each(|under| under.forest.clear());
            }
            BetweenFrames::Lose(percent) => self.lose(OtherWork::after(index, percent, config)),
        }
    }

    fn lose(&mut self, other: OtherWork) {
        self.forests.iter_mut().for_each(Forest::clear);
        for under in &mut self.under {
            for (tree, tally) in under.level.tallies.iter().enumerate() {
                let lines = other.lines(u64::from(tally.sets) * u64::from(tally.depth()), 0);
                let lines = lines.map(|line| tally.placed(line));
                under.forest.access_tree(tree, lines, &mut Vec::new());
            }
        }
    }
}
