//! The caches as texture units see them: a thread's first trip looks up every footprint's tags, and
//! what is missing is fetched.
//!
//! While a thread is looked up nothing arrives, so each of its distinct lines is there, on its way or
//! neither, once for all its footprints; and what its look-ups leave behind in the L1 depends only on
//! the order of each line's last one. So the distinct lines are looked up, in that order, and
//! footprints only where one of them was not there.

use super::super::counts::{CacheCounts, FootprintMisses};
use crate::cache::{Delay, DelayedFill, Levels, Missing, NOT_ASKED};
use crate::config::TmuConfig;
use crate::stream::{QuadLines, Use};
use crate::tmu::Pending;
use std::hint::select_unpredictable;

/// A core's L1, and the thread that was looked up last.
struct First<D> {
    cache: D,
    /// Its distinct lines that are not there.
    missing: Vec<Missing>,
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
    /// What the current thread waits for.
    pending: Vec<Pending>,
    /// Of a segment the lines that nobody has asked for: index by first use.
    absent: [u32; Use::FIRST_LINES],
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
            missing: Vec::new(),
        };
        Self {
            l1: l1.into_iter().map(first).collect(),
            l2,
            tmu,
            counts,
            pending: Vec::new(),
            absent: [0; Use::FIRST_LINES],
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

    /// Looks up all lines of a thread that enters `now`, in its core's own cache. Unless all are
    /// there, [`Self::ask`] says what it waits for.
    #[inline(always)]
    pub fn look_up(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) -> Found {
        let First { cache, missing } = &mut self.l1[core];
        missing.clear();
        if self.tmu.l1_penalty_cycles == 0 || quad.distinct.is_empty() {
            return Found::NotAll;
        }
        match cache.look_up_all(quad.distinct, now, missing) {
            0 => Found::All,
            NOT_ASKED => Found::NotAll,
            _ => Found::OnTheirWay,
        }
    }

    /// Asks for the lines that are missing, once it is the core's turn at the L2: what the thread's
    /// footprints wait for.
    #[inline(never)]
    pub fn ask(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) -> &mut Vec<Pending> {
        self.pending.clear();
        let mut trips = Trips::default();
        let missing = std::mem::take(&mut self.l1[core].missing);
        if missing.is_empty() {
            self.one_by_one(core, now, quad, &mut trips);
        } else if quad.is_one_segment() {
            // Nearly all quads: nothing to search for where a segment ends.
            self.segment(core, now, quad, &missing, 0, &mut trips);
        } else {
            let mut rest = &*missing;
            for (segment, end) in (0..).zip(quad.segments()) {
                if rest.is_empty() {
                    break;
                }
                let inside = |missing: &&Missing| (missing.index as usize) < end;
                let (own, others) = rest.split_at(rest.iter().take_while(inside).count());
                self.segment(core, now, quad, own, segment, &mut trips);
                rest = others;
            }
        }
        self.l1[core].missing = missing;
        &mut self.pending
    }

    /// Lines of a segment are not there: asks for those that nobody has asked for, and says who
    /// waits for them.
    #[inline(always)]
    fn segment(
        &mut self,
        core: usize,
        now: u64,
        quad: &QuadLines<'_>,
        missing: &[Missing],
        segment: u32,
        trips: &mut Trips,
    ) {
        let mut absent = 0_u128;
        for &Missing { index, arrival } in missing {
            let of = quad.uses[index as usize];
            if arrival == NOT_ASKED {
                absent |= 1 << of.first_line();
                self.absent[of.first_line()] = index;
            } else {
                let cell = quad.distinct_cell(index as usize);
                self.counts.secondary(cell, of.footprints().count_ones());
                self.pending.push(Pending {
                    ready: arrival,
                    footprints: of.footprints(),
                    segment,
                });
            }
        }
        if absent != 0 {
            self.fetch_absent(core, now, quad, absent, segment, trips);
        }
    }

    /// Asks for the absent lines of a segment, a bit for the first use of each, in the order in which
    /// the footprints do.
    #[inline(always)]
    fn fetch_absent(
        &mut self,
        core: usize,
        now: u64,
        quad: &QuadLines<'_>,
        mut absent: u128,
        segment: u32,
        trips: &mut Trips,
    ) {
        let mut asking = 0;
        let mut misses = FootprintMisses::default();
        let mut cell = 0;
        while absent != 0 {
            let index = self.absent[absent.trailing_zeros() as usize] as usize;
            absent &= absent - 1;
            let (line, of) = (quad.distinct[index], quad.uses[index]);
            let users = of.footprints();
            let first_user = users & users.wrapping_neg();
            if first_user != asking {
                if asking != 0 {
                    self.counts.footprint(cell, quad.tile(), &misses);
                }
                misses = FootprintMisses::default();
                asking = first_user;
                cell = quad.distinct_cell(index);
            }
            // Another segment, or another cell of this one, may have asked for it just now.
            let known = match of.may_be_listed() {
                true => self.l1[core].cache.arrival(line, now),
                false => NOT_ASKED,
            };
            let ready = if known == NOT_ASKED {
                misses.l1_lines += 1;
                misses.l1_secondary += users.count_ones() - 1;
                self.fetch(core, now, line, &mut misses, trips)
            } else {
                misses.l1_secondary += users.count_ones();
                known
            };
            self.pending.push(Pending {
                ready,
                footprints: users,
                segment,
            });
        }
        self.counts.footprint(cell, quad.tile(), &misses);
    }

    /// Looks up footprint after footprint: where a miss may fill at once, and where distinct lines
    /// are not listed.
    #[inline(never)]
    fn one_by_one(&mut self, core: usize, now: u64, quad: &QuadLines<'_>, trips: &mut Trips) {
        let mut number = 0;
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                let mut misses = FootprintMisses::default();
                let mut latest = now;
                for &line in footprint.lines {
                    let ready = match self.l1[core].cache.look_up(line, now) {
                        NOT_ASKED => {
                            misses.l1_lines += 1;
                            self.fetch(core, now, line, &mut misses, trips)
                        }
                        arrival => {
                            misses.l1_secondary += u32::from(arrival > 0);
                            arrival
                        }
                    };
                    latest = latest.max(ready);
                }
                if latest > now {
                    self.pending.push(Pending {
                        ready: latest,
                        footprints: 1 << (number % 32),
                        segment: number / 32,
                    });
                }
                number += 1;
                self.counts.footprint(footprint.cell, quad.tile(), &misses);
            }
        }
    }

    /// Asks the L2 for a line that is not on its way into the L1; says when it arrives there.
    #[inline(always)]
    fn fetch(
        &mut self,
        core: usize,
        now: u64,
        line: u32,
        misses: &mut FootprintMisses,
        trips: &mut Trips,
    ) -> u64 {
        let tmu = &self.tmu;
        let trip = trips.next(tmu.fetches_per_trip);
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
        self.l1[core].cache.enter(line, now, in_l1);
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
