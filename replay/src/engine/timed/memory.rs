//! The caches as texture units see them: a thread's first trip looks up every footprint's tags, and
//! what is missing is fetched.
//!
//! While a thread is looked up nothing arrives, so each of its distinct lines is there, in flight or
//! neither, once for all its footprints; and what its look-ups leave behind in the L1 depends only on
//! the order of each line's last one. So the distinct lines are looked up, in that order, and
//! footprints only where one of them was not there.

use super::super::counts::CacheCounts;
use super::asking::{Absent, Asking, Trips};
use crate::cache::{
    Delay, DelayedFill, Levels, MissPath, MissPathResult, NOT_IN_FLIGHT, SharedLevel,
};
use crate::config::TmuConfig;
use crate::stream::{QuadLines, Use};
use crate::tmu::{Pending, Waiting};
use std::ops::Range;

/// A core's L1, and the thread that was looked up last.
struct First<D> {
    cache: D,
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
    l1: Vec<First<D>>,
    l2: SharedLevel<D>,
    tmu: TmuConfig,
    counts: CacheCounts,
    /// The lines of a segment that are neither there nor in flight, by first use.
    by_first_use: [Absent; Use::FIRST_LINES],
}

impl<D: DelayedFill> Memory<D> {
    /// Empty caches.
    pub fn new<C: Delay<Delayed = D>>(
        levels: Levels<C>,
        tmu: TmuConfig,
        counts: CacheCounts,
        path: MissPath,
    ) -> Self {
        let memory_cycles = u64::from(tmu.l1_penalty_cycles) + u64::from(tmu.l2_penalty_cycles);
        // Later trips of threads that miss many lines included.
        let l1_cycles = memory_cycles + 8 * u64::from(tmu.loop_cycles);
        let Levels { l1, l2 } = levels.delayed(l1_cycles, memory_cycles);
        let first = |cache| First {
            cache,
            waiting: Waiting::default(),
            absent: Vec::new(),
            segments: Vec::new(),
        };
        Self {
            l1: l1.into_iter().map(first).collect(),
            l2: SharedLevel::new(l2, path),
            tmu,
            counts,
            by_first_use: [Absent::default(); Use::FIRST_LINES],
        }
    }

    /// What missed.
    pub fn counts(&self) -> &CacheCounts {
        &self.counts
    }

    /// What was counted beside and below the L2.
    pub fn path_result(&self) -> MissPathResult {
        self.l2.result()
    }

    /// Fetches of the L2 by interval of time, where they are recorded.
    pub fn fetched_lines(&self) -> &[u32] {
        self.l2.fetched_lines()
    }

    /// The L2 and what lies beside and below it.
    pub fn l2(&mut self) -> &mut SharedLevel<D> {
        &mut self.l2
    }

    /// Empties all caches and drops the lines in flight.
    pub fn flush(&mut self) {
        self.l1.iter_mut().for_each(|first| first.cache.clear());
        self.l2.clear();
    }

    /// Empties the L1 caches, and other work puts lines into the L2.
    pub fn lose(&mut self, lines: Range<u32>, now: u64) {
        self.l1.iter_mut().for_each(|first| first.cache.clear());
        self.l2.fill_with(lines, now);
    }

    /// Looks up all lines of a thread that enters `now`, in its core's own cache. If some are
    /// neither there nor in flight, the caller must call [`Self::ask`].
    #[inline(always)]
    pub fn look_up(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) -> Found {
        let First {
            cache,
            waiting,
            absent,
            segments,
        } = &mut self.l1[core];
        waiting.clear();
        absent.clear();
        if self.tmu.misses_change_caches_at_once() || quad.distinct.is_empty() {
            // Nothing absent either: one by one.
            return Found::NotAll;
        }
        let counts = &mut self.counts;
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
        &mut self.l1[core].waiting
    }

    /// Requests the lines that are neither there nor in flight, when it is the core's turn at the L2. Returns what
    /// the thread's footprints wait for.
    #[inline(never)]
    pub fn ask(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) -> &mut Waiting {
        let first = &mut self.l1[core];
        let mut asking = Asking {
            l1: &mut first.cache,
            l2: &mut self.l2,
            tmu: &self.tmu,
            counts: &mut self.counts,
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
        let caches = &mut self.l1;
        self.l2.invalidate_l1(|line| {
            let removed = caches.iter_mut().map(|first| first.cache.remove(line, now));
            removed.map(u64::from).sum()
        });
        &mut self.l1[core].waiting
    }
}
