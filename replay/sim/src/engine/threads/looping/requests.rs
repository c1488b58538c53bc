//! Requests the lines of a thread that are neither resident nor in flight, in the order of its footprints
//! and a limited number per trip.

use crate::config::TmuConfig;
use crate::engine::counts::{CacheCounts, FootprintMisses};
use crate::memory::{DelayedFill, NOT_IN_FLIGHT, SecondLevel};
use crate::stream::{QuadLines, Use};
use crate::tmu::{Pending, Waiting};
use std::hint::select_unpredictable;

/// A line that is neither resident nor in flight, and its uses.
#[derive(Clone, Copy, Debug, Default)]
pub struct Absent {
    pub line: u32,
    pub of: Use,
}

/// Requests of a thread so far, a limited number per trip.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Trips {
    fetches: u32,
    full_trips: u32,
}

/// The requests of a thread for its lines.
pub struct Requests<'m, D> {
    pub core: usize,
    pub l1: &'m mut D,
    pub l2: &'m mut SecondLevel<D>,
    /// Cycles in which a line travels from the L2 to the L1.
    pub l2_cycles: u64,
    /// True if lines arrive in the cycle of their request.
    pub is_instant: bool,
    pub tmu: &'m TmuConfig,
    pub counts: &'m mut CacheCounts,
    pub waiting: &'m mut Waiting,
    pub now: u64,
    pub trips: Trips,
}

impl<D: DelayedFill> Requests<'_, D> {
    /// Requests the `absent` lines of a segment in the order of their first use.
    #[inline(always)]
    pub fn segment(
        &mut self,
        quad: &QuadLines<'_>,
        absent: &[Absent],
        segment: u32,
        by_first_use: &mut [Absent; Use::FIRST_LINES],
    ) {
        // One bit per first use.
        let mut first_uses = [0_u64; Use::FIRST_LINES / 64];
        for one in absent {
            let first = one.of.first_line();
            first_uses[first / 64] |= 1 << (first % 64);
            by_first_use[first] = *one;
        }
        let mut last_user = 0;
        // Whether the requesting footprint has fetched a line, and one from memory.
        let mut missed = [false; 2];
        for (by_first_use, mut rest) in by_first_use.chunks_exact(64).zip(first_uses) {
            while rest != 0 {
                let Absent { line, of } = by_first_use[rest.trailing_zeros() as usize];
                rest &= rest - 1;
                let users = of.footprints();
                let first_user = users & users.wrapping_neg();
                missed = missed.map(|missed| missed & (first_user == last_user));
                last_user = first_user;
                // Another segment or cell of the quad may have requested the line in this cycle.
                let known = match of.may_be_listed() {
                    true => self.l1.arrival(line, self.now),
                    false => NOT_IN_FLIGHT,
                };
                let cell = quad.cell_of(of);
                let ready = if known == NOT_IN_FLIGHT {
                    let mut misses = FootprintMisses {
                        l1_lines: 1,
                        l1_secondary: users.count_ones() - 1,
                        ..FootprintMisses::default()
                    };
                    let ready = self.fetch(line, &mut misses);
                    self.counts.fetched(cell, quad.tile(), &misses, &mut missed);
                    ready
                } else {
                    self.counts.secondary(cell, users.count_ones());
                    known
                };
                self.waiting.push(Pending::new(ready, users, segment));
            }
        }
    }

    /// Looks up one footprint at a time. Used if a miss can change a cache immediately and if distinct
    /// lines are not listed.
    #[inline(never)]
    pub fn one_by_one(&mut self, quad: &QuadLines<'_>) {
        let now = self.now;
        let mut number = 0;
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                let mut misses = FootprintMisses::default();
                let mut latest = now;
                for &line in footprint.lines {
                    let ready = match self.l1.look_up(line, now) {
                        NOT_IN_FLIGHT => {
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

    /// Requests a line from the L2 that is not in flight into the L1. Returns its arrival at the L1.
    #[inline(always)]
    fn fetch(&mut self, line: u32, misses: &mut FootprintMisses) -> u64 {
        let now = self.now;
        let trip = self.trips.next(self.tmu.fetches_per_trip);
        let wait = if self.is_instant {
            0
        } else {
            u64::from(trip) * u64::from(self.tmu.loop_cycles)
        };
        let in_l2 = misses.count_l2_answer(self.l2.request(self.core, line, now), now);
        let in_l1 = in_l2 + self.l2_cycles + wait;
        self.l1.enter(line, now, in_l1);
        in_l1
    }
}

impl Trips {
    /// The trip of the next request.
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
