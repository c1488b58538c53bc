//! The caches as seen by texture units: a thread's first trip looks up the tags of all its footprints, and
//! missing lines are fetched.
//!
//! Nothing arrives during a thread's look-up. Each distinct line is therefore resident, in flight or absent
//! for all of its footprints alike, and the state left in the L1 depends only on the order of each line's
//! last look-up. So the distinct lines are looked up in that order, and single footprints matter only if a
//! line was missing.

use super::super::Shared;
use super::requests::{Absent, Requests, Trips};
use crate::config::{RunConfig, TmuConfig};
use crate::memory::{DelayedFill, NOT_IN_FLIGHT};
use crate::stream::{QuadLines, Use};
use crate::tmu::{Pending, Waiting};
use std::ops::Range;

/// The last thread looked up on a core.
#[derive(Default)]
struct LookedUp {
    /// The arrivals it waits for.
    waiting: Waiting,
    /// Its distinct lines that are neither resident nor in flight, by segment.
    absent: Vec<Absent>,
    /// End of each segment in `absent`, if there are several.
    segments: Vec<usize>,
}

/// Outcome of a thread's look-up in the core's L1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuadLookup {
    /// All lines are resident.
    All,
    /// The missing lines are all in flight.
    InFlight,
    /// Some lines must be requested from the L2.
    NotAll,
}

/// The threads' look-ups and requests.
pub struct LoopingMemory {
    /// One per core.
    threads: Vec<LookedUp>,
    tmu: TmuConfig,
    memory_cycles: u64,
    /// True if a miss fills the cache immediately, so that later look-ups of the same thread hit.
    misses_change_caches_at_once: bool,
    /// The absent lines of a segment, by first use.
    by_first_use: [Absent; Use::FIRST_LINES],
}

impl LoopingMemory {
    pub fn new(config: &RunConfig, cores: usize) -> Self {
        Self {
            threads: (0..cores).map(|_| LookedUp::default()).collect(),
            tmu: config.tmu,
            memory_cycles: config.memory_cycles.into(),
            misses_change_caches_at_once: config.misses_change_caches_at_once(),
            by_first_use: [Absent::default(); Use::FIRST_LINES],
        }
    }

    /// Looks up all lines of a thread that enters at `now` in the core's L1. If lines are neither resident
    /// nor in flight, the caller must call [`Self::request`].
    #[inline(always)]
    pub fn look_up<D: DelayedFill>(
        &mut self,
        shared: &mut Shared<D>,
        core: usize,
        now: u64,
        quad: &QuadLines<'_>,
    ) -> QuadLookup {
        let LookedUp {
            waiting,
            absent,
            segments,
        } = &mut self.threads[core];
        waiting.clear();
        absent.clear();
        if self.misses_change_caches_at_once || quad.distinct.is_empty() {
            // Distinct lines are not listed; `request` looks footprints up one by one.
            return QuadLookup::NotAll;
        }
        let (cache, counts) = (&mut shared.l1[core], &mut shared.counts);
        let mut look_up = |lines: Range<usize>, segment: u32| {
            let uses = &quad.uses[lines.clone()];
            cache.look_up_all(&quad.distinct[lines], now, |index, line, arrival| {
                let of = uses[index];
                if arrival == NOT_IN_FLIGHT {
                    absent.push(Absent { line, of });
                } else {
                    counts.secondary(quad.cell_of(of), of.footprints().count_ones());
                    waiting.push(Pending::new(arrival, of.footprints(), segment));
                }
            });
            absent.len()
        };
        if quad.is_one_segment() {
            // The case of nearly all quads, which needs no search for segment ends.
            look_up(0..quad.distinct.len(), 0);
        } else {
            segments.clear();
            let mut start = 0;
            for (segment, end) in (0..).zip(quad.segments()) {
                segments.push(look_up(start..end, segment));
                start = end;
            }
        }
        match (absent.is_empty(), waiting.is_empty()) {
            (false, _) => QuadLookup::NotAll,
            (true, false) => QuadLookup::InFlight,
            (true, true) => QuadLookup::All,
        }
    }

    /// The arrivals that the last thread looked up waits for.
    #[inline(always)]
    pub fn waiting(&mut self, core: usize) -> &mut Waiting {
        &mut self.threads[core].waiting
    }

    /// Requests the absent lines when the core has access to the L2. Returns the arrivals that the footprints wait for.
    #[inline(never)]
    pub fn request<D: DelayedFill>(
        &mut self,
        shared: &mut Shared<D>,
        core: usize,
        now: u64,
        quad: &QuadLines<'_>,
    ) -> &mut Waiting {
        let first = &mut self.threads[core];
        let Shared {
            l1,
            l2,
            l2_cycles,
            counts,
        } = &mut *shared;
        let mut requests = Requests {
            core,
            l1: &mut l1[core],
            l2,
            l2_cycles: *l2_cycles,
            // Without latencies no thread loops, so there are no later trips.
            is_instant: *l2_cycles + self.memory_cycles == 0,
            tmu: &self.tmu,
            counts,
            waiting: &mut first.waiting,
            now,
            trips: Trips::default(),
        };
        if first.absent.is_empty() {
            requests.one_by_one(quad);
        } else if quad.is_one_segment() {
            requests.segment(quad, &first.absent, 0, &mut self.by_first_use);
        } else {
            let mut start = 0;
            for (segment, &end) in (0..).zip(&first.segments) {
                requests.segment(
                    quad,
                    &first.absent[start..end],
                    segment,
                    &mut self.by_first_use,
                );
                start = end;
            }
            first.waiting.sort_by_segment();
        }
        shared.follow_evictions(now);
        &mut self.threads[core].waiting
    }
}
