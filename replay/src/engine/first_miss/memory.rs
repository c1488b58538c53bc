//! The caches as threads see them that stop at a miss, and the two ways of counting: primary misses
//! with the bytes that memory sends, and first look-ups.

use super::super::counts::{CacheCounts, CellMisses};
use super::thread::{FETCHES_UNTIL_KEPT, Thread};
use crate::cache::{
    Answer, Delay, DelayedFill, Levels, MissPath, MissPathResult, NOT_IN_FLIGHT, SharedLevel,
};
use crate::config::TmuConfig;
use crate::result::FirstLookups;
use std::ops::Range;

/// What a footprint finds in its core's own cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// All its lines.
    All,
    /// Not all of them: [`Memory::ask`] knows which.
    NotAll,
}

/// L1 caches over a shared L2.
pub struct Memory<D> {
    l1: Vec<D>,
    l2: SharedLevel<D>,
    l1_penalty_cycles: u64,
    counts: CacheCounts,
    /// Lines of the footprint looked up last that were not there, by core: index and arrival.
    missing: Vec<Vec<(usize, u64)>>,
    first: FirstLookups,
    /// Look-ups that found their data with the thread, not in the cache.
    pub forwarded: u64,
}

impl<D: DelayedFill> Memory<D> {
    /// Empty caches.
    pub fn new<C: Delay<Delayed = D>>(
        levels: Levels<C>,
        tmu: &TmuConfig,
        counts: CacheCounts,
        path: MissPath,
    ) -> Self {
        let [l1_penalty_cycles, l2_penalty_cycles] =
            [tmu.l1_penalty_cycles, tmu.l2_penalty_cycles].map(u64::from);
        let memory_cycles = l1_penalty_cycles + l2_penalty_cycles;
        let Levels { l1, l2 } = levels.delayed(memory_cycles, l2_penalty_cycles);
        Self {
            missing: vec![Vec::with_capacity(4); l1.len()],
            l1,
            l2: SharedLevel::new(l2, path),
            l1_penalty_cycles,
            counts,
            first: FirstLookups::default(),
            forwarded: 0,
        }
    }

    /// What was counted beside and below the L2.
    pub fn path_result(&self) -> MissPathResult {
        self.l2.result()
    }

    /// Primary misses.
    pub fn counts(&self) -> &CacheCounts {
        &self.counts
    }

    /// First look-ups of so many footprints.
    pub fn first_lookups(&self, footprints: u64) -> FirstLookups {
        FirstLookups {
            forwarded: self.forwarded,
            ..self.first
        }
        .over(footprints)
    }

    /// The L2 and what lies beside and below it.
    pub fn l2(&mut self) -> &mut SharedLevel<D> {
        &mut self.l2
    }

    /// Empties all caches and drops the lines in flight.
    pub fn flush(&mut self) {
        self.l1.iter_mut().for_each(D::clear);
        self.l2.clear();
    }

    /// Empties the L1 caches, and other work puts lines into the L2.
    pub fn lose(&mut self, lines: Range<u32>, now: u64) {
        self.l1.iter_mut().for_each(D::clear);
        self.l2.fill_with(lines, now);
    }

    /// Looks up all lines of a footprint in the core's own cache. Doing so once more at the same
    /// cycle changes nothing.
    #[inline(always)]
    pub fn look_up(&mut self, core: usize, now: u64, lines: &[u32]) -> Seen {
        let missing = &mut self.missing[core];
        missing.clear();
        self.l1[core].look_up_all(lines, now, |index, _, arrival| {
            missing.push((index, arrival))
        });
        if missing.is_empty() {
            Seen::All
        } else {
            Seen::NotAll
        }
    }

    /// The footprint that was looked up last asks for the lines that it did not find, unless they
    /// are in flight.
    pub fn ask(&mut self, core: usize, now: u64, thread: &mut Thread) {
        let Some(footprint) = thread.footprint() else {
            return;
        };
        let (cell, tile) = (footprint.cell, footprint.tile);
        let mut state = thread.state;
        let first = !std::mem::replace(&mut state.tried, true);
        if state.kept_from.is_some() {
            // All is asked for; the thread waits for the last of it.
            return;
        }
        self.first.l1_misses += u64::from(first);
        let CellMisses { l1, l2 } = &mut self.counts.cells[cell];
        let (mut fetched, mut from_memory, mut latest) = (0_u32, 0_u32, now);
        for &(index, arrival) in &self.missing[core] {
            let line = footprint.lines[index];
            if arrival != NOT_IN_FLIGHT {
                if first {
                    // A line in flight into the L1 is a miss of the L2 until memory has sent it.
                    let in_l2 = self.l2.cache.arrival(line, now);
                    self.first.l2_lookups += 1;
                    self.first.l2_misses += u64::from(in_l2 != NOT_IN_FLIGHT);
                    l1.secondary += 1;
                }
                latest = latest.max(arrival);
                continue;
            }
            fetched += 1;
            let answer = self.l2.request(line, now);
            if first {
                self.first.l2_lookups += 1;
                self.first.l2_misses += u64::from(answer != Answer::Hit);
            }
            let there = match answer {
                Answer::Hit => now,
                Answer::InFlight(arrival) => {
                    l2.secondary += 1;
                    arrival
                }
                Answer::Miss(arrival) => {
                    from_memory += 1;
                    arrival
                }
            };
            let arrival = there + self.l1_penalty_cycles;
            self.l1[core].enter(line, now, arrival);
            latest = latest.max(arrival);
        }
        let caches = &mut self.l1;
        (self.l2).invalidate_l1(|line| {
            caches
                .iter_mut()
                .map(|l1| u64::from(l1.remove(line, now)))
                .sum()
        });
        l1.lines += u64::from(fetched);
        l2.lines += u64::from(from_memory);
        // A footprint counts once, however often it asks.
        let newly_fetched = fetched > 0 && !std::mem::replace(&mut state.fetched, true);
        let newly_missed = from_memory > 0 && !std::mem::replace(&mut state.from_memory, true);
        l1.footprints += u64::from(newly_fetched);
        l2.footprints += u64::from(newly_missed);
        if let Some(tile) = self.counts.tiles.get_mut(tile) {
            tile.l1_footprints = tile.l1_footprints.wrapping_add(u32::from(newly_fetched));
            tile.l2_lines = tile.l2_lines.wrapping_add(from_memory);
        }
        if fetched > 0 {
            state.fetches += 1;
            if state.fetches == FETCHES_UNTIL_KEPT {
                state.kept_from = Some(latest);
            }
        }
        thread.state = state;
    }
}
