//! The caches as texture units see them: a thread's first trip looks up every footprint's tags, and
//! what is missing is fetched.
//!
//! While a thread is looked up nothing arrives, so each of its distinct lines is there, in flight or
//! neither, once for all its footprints; and what its look-ups leave behind in the L1 depends only on
//! the order of each line's last one. So the distinct lines are looked up, in that order, and
//! footprints only where one of them was not there.

use super::super::Shared;
use super::asking::{Absent, Asking, Trips};
use crate::config::{RunConfig, TmuConfig};
use crate::engine::counts::CacheCounts;
use crate::memory::{Caches, Delay, DelayedFill, MissPath, NOT_IN_FLIGHT, SecondLevel};
use crate::result::MemoryResult;
use crate::stream::{QuadLines, Use};
use crate::tmu::{Pending, Waiting};
use std::ops::Range;

/// The thread of a core that was looked up last.
#[derive(Default)]
struct LookedUp {
    /// The arrivals that it waits for.
    waiting: Waiting,
    /// Its distinct lines that are neither there nor in flight, segment by segment.
    absent: Vec<Absent>,
    /// Where those of each segment end, if there are several.
    segments: Vec<usize>,
}

/// What a thread finds in its core's own cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// All its lines.
    All,
    /// Lines that are not there, but in flight.
    InFlight,
    /// Lines that it has to request from the L2.
    NotAll,
}

/// L1 caches over a shared L2.
pub struct Memory<D> {
    shared: Shared<D>,
    /// By core.
    threads: Vec<LookedUp>,
    tmu: TmuConfig,
    memory_cycles: u64,
    /// True where a miss changes a cache at once, so that a thread's later look-ups see it.
    misses_change_caches_at_once: bool,
    /// The lines of a segment that are neither there nor in flight, by first use.
    by_first_use: [Absent; Use::FIRST_LINES],
}

impl<D: DelayedFill> Memory<D> {
    /// Empty caches.
    pub fn new<C: Delay<Delayed = D>>(
        caches: Caches<C>,
        config: &RunConfig,
        counts: CacheCounts,
        path: MissPath,
    ) -> Self {
        let memory_cycles = u64::from(config.level.l2.hit_cycles) + u64::from(config.memory_cycles);
        // Later trips of threads that miss many lines included.
        let l1_cycles = memory_cycles + 8 * u64::from(config.tmu.loop_cycles);
        let threads = caches.l1.iter().map(|_| LookedUp::default());
        Self {
            threads: threads.collect(),
            shared: Shared::new(caches, config, counts, path, [l1_cycles, memory_cycles]),
            tmu: config.tmu,
            memory_cycles: config.memory_cycles.into(),
            misses_change_caches_at_once: config.misses_change_caches_at_once(),
            by_first_use: [Absent::default(); Use::FIRST_LINES],
        }
    }

    /// What missed.
    pub fn counts(&self) -> &CacheCounts {
        &self.shared.counts
    }

    /// What was counted beside and below the L2.
    pub fn result(&self) -> MemoryResult {
        self.shared.l2.result()
    }

    /// Fetches of the L2 by interval of time, where they are recorded.
    pub fn fetched_lines(&self) -> &[u32] {
        self.shared.l2.fetched_lines()
    }

    /// The caches.
    pub fn shared(&mut self) -> &mut Shared<D> {
        &mut self.shared
    }

    /// The L2 and what lies beside and below it.
    pub fn l2(&mut self) -> &mut SecondLevel<D> {
        &mut self.shared.l2
    }

    /// Empties all caches and drops the lines in flight.
    pub fn flush(&mut self) {
        self.shared.flush();
    }

    /// Looks up all lines of a thread that enters `now`, in its core's own cache. If some are
    /// neither there nor in flight, the caller must call [`Self::ask`].
    #[inline(always)]
    pub fn look_up(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) -> Found {
        let LookedUp {
            waiting,
            absent,
            segments,
        } = &mut self.threads[core];
        waiting.clear();
        absent.clear();
        if self.misses_change_caches_at_once || quad.distinct.is_empty() {
            // Nothing absent either: one by one.
            return Found::NotAll;
        }
        let (cache, counts) = (&mut self.shared.l1[core], &mut self.shared.counts);
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
            // Nearly all quads: nothing to search for where a segment ends.
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
            (false, _) => Found::NotAll,
            (true, false) => Found::InFlight,
            (true, true) => Found::All,
        }
    }

    /// What the thread that was looked up last waits for.
    #[inline(always)]
    pub fn waiting(&mut self, core: usize) -> &mut Waiting {
        &mut self.threads[core].waiting
    }

    /// Requests the lines that are neither there nor in flight, when it is the core's turn at the L2. Returns what
    /// the thread's footprints wait for.
    #[inline(never)]
    pub fn ask(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) -> &mut Waiting {
        let first = &mut self.threads[core];
        let Shared {
            l1,
            l2,
            l2_cycles,
            counts,
        } = &mut self.shared;
        let mut asking = Asking {
            core,
            l1: &mut l1[core],
            l2,
            l2_cycles: *l2_cycles,
            // Without latencies nothing loops, so there is no later trip to wait for.
            is_instant: *l2_cycles + self.memory_cycles == 0,
            tmu: &self.tmu,
            counts,
            waiting: &mut first.waiting,
            now,
            trips: Trips::default(),
        };
        if first.absent.is_empty() {
            asking.one_by_one(quad);
        } else if quad.is_one_segment() {
            asking.segment(quad, &first.absent, 0, &mut self.by_first_use);
        } else {
            let mut start = 0;
            for (segment, &end) in (0..).zip(&first.segments) {
                asking.segment(
                    quad,
                    &first.absent[start..end],
                    segment,
                    &mut self.by_first_use,
                );
                start = end;
            }
            first.waiting.sort_by_segment();
        }
        self.shared.follow_evictions(now);
        &mut self.threads[core].waiting
    }
}
