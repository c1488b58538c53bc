//! The caches of threads that stop at a miss, with both ways of counting: primary misses with DRAM traffic,
//! and first look-ups.

use super::super::Shared;
use super::thread::{FETCHES_UNTIL_KEPT, Thread};
use crate::engine::counts::CellMisses;
use crate::memory::{Answer, DelayedFill, NOT_IN_FLIGHT};
use crate::result::FirstLookups;

/// Outcome of a footprint's look-up in the core's L1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// All lines are resident.
    All,
    /// Some lines are missing; [`FirstMissMemory::request`] requests them.
    NotAll,
}

/// What a look-up found, and both ways of counting.
pub struct FirstMissMemory {
    /// Per core, the missing lines of the last footprint looked up: index and arrival.
    missing: Vec<Vec<(usize, u64)>>,
    /// First look-ups, and look-ups served by data that the thread kept, not by the cache.
    pub first: FirstLookups,
}

impl FirstMissMemory {
    pub fn new(cores: usize) -> Self {
        Self {
            missing: vec![Vec::with_capacity(4); cores],
            first: FirstLookups::default(),
        }
    }

    /// Looks up all lines of a footprint in the core's L1. A second look-up in the same cycle changes nothing.
    #[inline(always)]
    pub fn look_up<D: DelayedFill>(
        &mut self,
        shared: &mut Shared<D>,
        core: usize,
        now: u64,
        lines: &[u32],
    ) -> Seen {
        let missing = &mut self.missing[core];
        missing.clear();
        shared.l1[core].look_up_all(lines, now, |index, _, arrival| {
            missing.push((index, arrival))
        });
        if missing.is_empty() {
            Seen::All
        } else {
            Seen::NotAll
        }
    }

    /// Requests the missing lines of the last footprint looked up, except those in flight.
    pub fn request<D: DelayedFill>(
        &mut self,
        shared: &mut Shared<D>,
        core: usize,
        now: u64,
        thread: &mut Thread,
    ) {
        let Some(footprint) = thread.footprint() else {
            return;
        };
        let (cell, tile) = (footprint.cell, footprint.tile);
        let mut state = thread.state;
        let first = !std::mem::replace(&mut state.tried, true);
        if state.kept_from.is_some() {
            // Everything is requested; the thread waits for the last line.
            return;
        }
        self.first.l1_misses += u64::from(first);
        let Shared {
            l1: caches,
            l2: second,
            l2_cycles,
            counts,
        } = &mut *shared;
        let CellMisses { l1, l2 } = &mut counts.cells[cell];
        let (mut fetched, mut from_memory, mut latest) = (0_u32, 0_u32, now);
        for &(index, arrival) in &self.missing[core] {
            let line = footprint.lines[index];
            if arrival != NOT_IN_FLIGHT {
                if first {
                    // A line in flight into the L1 counts as an L2 miss until memory has sent it.
                    let in_l2 = second.cache(core).arrival(line, now);
                    self.first.l2_lookups += 1;
                    self.first.l2_misses += u64::from(in_l2 != NOT_IN_FLIGHT);
                    l1.secondary += 1;
                }
                latest = latest.max(arrival);
                continue;
            }
            fetched += 1;
            let answer = second.request(core, line, now);
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
            let arrival = there + *l2_cycles;
            caches[core].enter(line, now, arrival);
            latest = latest.max(arrival);
        }
        l1.lines += u64::from(fetched);
        l2.lines += u64::from(from_memory);
        // A footprint counts once, however often it requests lines.
        let newly_fetched = fetched > 0 && !std::mem::replace(&mut state.fetched, true);
        let newly_missed = from_memory > 0 && !std::mem::replace(&mut state.from_memory, true);
        l1.footprints += u64::from(newly_fetched);
        l2.footprints += u64::from(newly_missed);
        if let Some(tile) = counts.tiles.get_mut(tile) {
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
        shared.follow_evictions(now);
    }
}
