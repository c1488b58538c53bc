//! The caches as texture units see them: a thread's first trip looks up every footprint's tags, and
//! what is missing is fetched.
//!
//! While a thread is looked up nothing arrives, so each of its distinct lines is there, on its way or
//! neither, once for all its footprints; and what its look-ups leave behind in the L1 depends only on
//! the order of each line's last one. So the distinct lines are looked up, in that order, and
//! footprints only where one of them was not there.

use super::super::counts::{CacheCounts, FootprintMisses};
use crate::cache::{Delay, DelayedFill, Levels, NOT_ASKED};
use crate::config::TmuConfig;
use crate::stream::{QuadLines, Use};
use crate::tmu::{Pending, Waiting};
use std::hint::select_unpredictable;
use std::ops::Range;

/// A core's L1, and the thread that was looked up last.
struct First<D> {
    cache: D,
    /// For what it waits.
    waiting: Waiting,
    /// Its distinct lines that nobody has asked for, segment by segment.
    absent: Vec<Absent>,
    /// Where those of each segment end, if there are several.
    segments: Vec<usize>,
}

/// A line that nobody has asked for, and who uses it.
#[derive(Clone, Copy, Debug, Default)]
struct Absent {
    line: u32,
    of: Use,
}

/// What a thread finds in its core's own cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// All its lines.
    All,
    /// Lines that are not there, but on their way.
    OnTheirWay,
    /// Lines that it has to ask the L2 for.
    NotAll,
}

/// L1 caches over a shared L2.
pub struct Memory<D> {
    l1: Vec<First<D>>,
    l2: D,
    tmu: TmuConfig,
    counts: CacheCounts,
    /// Of a segment the lines that nobody has asked for, by first use.
    by_first_use: [Absent; Use::FIRST_LINES],
}

/// Lines that a thread asked for: so many in each of its trips.
#[derive(Clone, Copy, Debug, Default)]
struct Trips {
    fetches: u32,
    full_trips: u32,
}

impl<D: DelayedFill> Memory<D> {
    /// Empty caches.
    pub fn new<C: Delay<Delayed = D>>(
        levels: Levels<C>,
        tmu: TmuConfig,
        counts: CacheCounts,
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
            l2,
            tmu,
            counts,
            by_first_use: [Absent::default(); Use::FIRST_LINES],
        }
    }

    /// What missed.
    pub fn counts(&self) -> &CacheCounts {
        &self.counts
    }

    /// Empties all caches. Nobody waits for what is on its way.
    pub fn flush(&mut self) {
        self.l1.iter_mut().for_each(|first| first.cache.clear());
        self.l2.clear();
    }

    /// Looks up all lines of a thread that enters `now`, in its core's own cache. If nobody has asked for
    /// some of them, [`Self::ask`] is to be called.
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
        if self.tmu.l1_penalty_cycles == 0 || quad.distinct.is_empty() {
            return Found::NotAll;
        }
        let counts = &mut self.counts;
        let mut look_up = |lines: Range<usize>, segment: u32| {
            let uses = &quad.uses[lines.clone()];
            cache.look_up_all(&quad.distinct[lines], now, |index, line, arrival| {
                let of = uses[index];
                if arrival == NOT_ASKED {
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
            (true, false) => Found::OnTheirWay,
            (true, true) => Found::All,
        }
    }

    /// What the thread that was looked up last waits for.
    #[inline(always)]
    pub fn waiting(&mut self, core: usize) -> &mut Waiting {
        &mut self.l1[core].waiting
    }

    /// Asks for the lines that nobody has asked for, once it is the core's turn at the L2: what the
    /// thread's footprints wait for.
    #[inline(never)]
    pub fn ask(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) -> &mut Waiting {
        let First {
            cache,
            waiting,
            absent,
            segments,
        } = &mut self.l1[core];
        let mut asking = Asking {
            l1: cache,
            l2: &mut self.l2,
            tmu: &self.tmu,
            counts: &mut self.counts,
            waiting,
            now,
            trips: Trips::default(),
        };
        if absent.is_empty() {
            asking.one_by_one(quad);
        } else if quad.is_one_segment() {
            asking.segment(quad, absent, 0, &mut self.by_first_use);
        } else {
            let mut start = 0;
            for (segment, &end) in (0..).zip(&*segments) {
                asking.segment(quad, &absent[start..end], segment, &mut self.by_first_use);
                start = end;
            }
            waiting.sort_by_segment();
        }
        waiting
    }
}

/// A thread that asks for its lines.
struct Asking<'m, D> {
    l1: &'m mut D,
    l2: &'m mut D,
    tmu: &'m TmuConfig,
    counts: &'m mut CacheCounts,
    waiting: &'m mut Waiting,
    now: u64,
    trips: Trips,
}

impl<D: DelayedFill> Asking<'_, D> {
    /// Asks for the `absent` lines of a segment in the order in which its footprints do.
    #[inline(always)]
    fn segment(
        &mut self,
        quad: &QuadLines<'_>,
        absent: &[Absent],
        segment: u32,
        by_first_use: &mut [Absent; Use::FIRST_LINES],
    ) {
        // A bit for the first use of each.
        let mut first_uses = [0_u64; Use::FIRST_LINES / 64];
        for one in absent {
            let first = one.of.first_line();
            first_uses[first / 64] |= 1 << (first % 64);
            by_first_use[first] = *one;
        }
        let mut asking = 0;
        // Of the footprint that asks: whether it has fetched, and from memory.
        let mut missed = [false; 2];
        for (by_first_use, mut rest) in by_first_use.chunks_exact(64).zip(first_uses) {
            while rest != 0 {
                let Absent { line, of } = by_first_use[rest.trailing_zeros() as usize];
                rest &= rest - 1;
                let users = of.footprints();
                let first_user = users & users.wrapping_neg();
                missed = missed.map(|missed| missed & (first_user == asking));
                asking = first_user;
                // Another segment, or another cell of this one, may have asked for it just now.
                let known = match of.may_be_listed() {
                    true => self.l1.arrival(line, self.now),
                    false => NOT_ASKED,
                };
                let cell = quad.cell_of(of);
                let ready = if known == NOT_ASKED {
                    let mut misses = FootprintMisses {
                        l1_lines: 1,
                        l1_secondary: users.count_ones() - 1,
                        ..FootprintMisses::default()
                    };
                    let ready = self.fetch(line, &mut misses);
                    self.counts.line(cell, quad.tile(), &misses, &mut missed);
                    ready
                } else {
                    self.counts.secondary(cell, users.count_ones());
                    known
                };
                self.waiting.push(Pending::new(ready, users, segment));
            }
        }
    }

    /// Looks up footprint after footprint: where a miss may fill at once, and where distinct lines
    /// are not listed.
    #[inline(never)]
    fn one_by_one(&mut self, quad: &QuadLines<'_>) {
        let now = self.now;
        let mut number = 0;
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                let mut misses = FootprintMisses::default();
                let mut latest = now;
                for &line in footprint.lines {
                    let ready = match self.l1.look_up(line, now) {
                        NOT_ASKED => {
                            misses.l1_lines += 1;
                            self.fetch(line, &mut misses)
                        }
                        arrival => {
                            misses.l1_secondary += u32::from(arrival > 0);
                            arrival
                        }
                    };
                    latest = latest.max(ready);
                }
                if latest > now {
                    let (segment, number) = (number / Pending::SEGMENT, number % Pending::SEGMENT);
                    self.waiting
                        .push(Pending::new(latest, 1 << number, segment));
                }
                number += 1;
                self.counts.footprint(footprint.cell, quad.tile(), &misses);
            }
        }
    }

    /// Asks the L2 for a line that is not on its way into the L1; says when it arrives there.
    #[inline(always)]
    fn fetch(&mut self, line: u32, misses: &mut FootprintMisses) -> u64 {
        let (now, tmu) = (self.now, self.tmu);
        let trip = self.trips.next(tmu.fetches_per_trip);
        // Without penalties nothing loops, so there is no later trip to wait for.
        let instant = tmu.l1_penalty_cycles == 0 && tmu.l2_penalty_cycles == 0;
        let wait = if instant {
            0
        } else {
            u64::from(trip) * u64::from(tmu.loop_cycles)
        };
        let in_l2 = match self.l2.look_up(line, now) {
            0 => now,
            NOT_ASKED => {
                misses.l2_lines += 1;
                let arrival = now + u64::from(tmu.l2_penalty_cycles);
                self.l2.enter(line, now, arrival);
                arrival
            }
            arrival => {
                misses.l2_secondary += 1;
                arrival
            }
        };
        let in_l1 = in_l2 + u64::from(tmu.l1_penalty_cycles) + wait;
        self.l1.enter(line, now, in_l1);
        in_l1
    }
}

impl Trips {
    /// The trip in which the next line is asked for.
    #[inline(always)]
    fn next(&mut self, fetches_per_trip: u32) -> u32 {
        let trip = self.full_trips;
        self.fetches += 1;
        let full = self.fetches == fetches_per_trip;
        self.fetches = select_unpredictable(full, 0, self.fetches);
        self.full_trips += u32::from(full);
        trip
    }
}
