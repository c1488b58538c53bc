//! The results of analysing a stream of lines.

use crate::distances::Distances;
use crate::knees::Rows;
use crate::place::{ByOrigin, add};
use crate::set_associative::CacheHits;
use crate::split::MissSplit;
use crate::working_set::WorkingSet;

/// Figures of the lines looked up in a cache. Those of several caches of a level are sums.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Figures {
    /// Line look-ups: first uses and reuses.
    pub accesses: u64,
    /// Distinct lines.
    pub unique_lines: u64,
    /// Tiles with look-ups.
    pub tiles: u64,
    /// Frames with look-ups, summed over caches.
    pub frames: u64,
    /// Distinct lines per frame, summed over frames.
    pub frame_lines: u64,
    /// Lines of a frame that tiles of both eyes use, summed over frames.
    pub frame_lines_of_both_eyes: u64,
    /// Lines of a frame that an earlier frame used, summed over frames.
    pub frame_lines_of_earlier_frames: u64,
    /// Lines and reuses of rows of tiles.
    pub rows: Rows,
    /// Reuses by LRU stack distance.
    pub distances: Distances,
    /// Misses of the configured cache by cause.
    pub split: MissSplit,
    /// LRU caches of several sizes and ways.
    pub lru: Vec<CacheHits>,
    /// Fully associative caches of several sizes under OPT, ascending.
    pub opt: Vec<CacheHits>,
    /// Capacity of the configured cache in lines.
    pub configured_lines: u64,
    /// Hits of the configured geometry under OPT.
    pub opt_of_geometry: ByOrigin,
    /// By window length.
    pub working_sets: Vec<WorkingSet>,
}

impl Figures {
    /// Adds the figures of another cache of the level.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(
            self,
            other,
            accesses,
            unique_lines,
            tiles,
            frames,
            frame_lines,
            frame_lines_of_both_eyes,
            frame_lines_of_earlier_frames
        );
        self.rows.add(&other.rows);
        self.distances.add(&other.distances);
        self.split.add(&other.split);
        let lists = [(&mut self.lru, &other.lru), (&mut self.opt, &other.opt)];
        for (to, from) in lists {
            debug_assert_eq!(to.len(), from.len(), "caches of one level");
            for (to, from) in to.iter_mut().zip(from) {
                add(&mut to.hits, &from.hits);
            }
        }
        add(&mut self.opt_of_geometry, &other.opt_of_geometry);
        // A core with fewer tiles has fewer lengths.
        for (index, other) in other.working_sets.iter().enumerate() {
            match self.working_sets.get_mut(index) {
                Some(own) => own.add(other),
                None => self.working_sets.push(*other),
            }
        }
    }

    /// Reuses by location of the previous use: the hits of an infinite cache.
    pub fn reuses(&self) -> ByOrigin {
        self.distances.total()
    }

    /// Misses of a cache with these hits.
    pub fn misses(&self, hits: &ByOrigin) -> u64 {
        self.accesses - hits.iter().sum::<u64>()
    }

    /// Hits under OPT of a fully associative cache of the configured size.
    pub fn opt_of_size(&self) -> ByOrigin {
        let own = self.opt.iter().find(|p| p.lines == self.configured_lines);
        own.map_or(ByOrigin::default(), |point| point.hits)
    }
}
