//! The caches as texture units see them: a thread's first trip looks up every footprint's tags, and
//! what is missing is fetched.
//!
//! While a thread is looked up nothing arrives, so each of its distinct lines is there, on its way or
//! neither, once for all its footprints; and what its look-ups leave behind in the L1 depends only on
//! the order of each line's last one. So the distinct lines are looked up, in that order, and
//! footprints only where one of them was not there.

use super::super::counts::{CacheCounts, FootprintMisses};
use crate::cache::{Cache, InFlight, Levels};
use crate::config::TmuConfig;
use crate::stream::QuadLines;
use crate::tmu::Pending;
use std::cmp::Reverse;

/// A cache and what is on its way into it.
struct Level<C> {
    cache: C,
    in_flight: InFlight,
}

impl<C: Cache> Level<C> {
    fn new(cache: C, usual_cycles: u64) -> Self {
        Self {
            cache,
            in_flight: InFlight::new(usual_cycles),
        }
    }

    fn clear(&mut self) {
        self.cache.clear();
        self.in_flight.clear();
    }

    #[inline(always)]
    fn arrive(&mut self, now: u64) {
        self.in_flight.arrive(now, &mut self.cache);
    }

    /// Fills a line at once, or when it arrives.
    #[inline]
    fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        if arrival <= now {
            self.cache.fill(line);
        } else {
            self.in_flight.request(line, now, arrival);
        }
    }
}

/// When a line arrives that nobody has asked for.
const UNKNOWN: u64 = u64::MAX;

/// A core's L1, and the thread that was looked up last.
struct First<C> {
    level: Level<C>,
    /// Its distinct lines that are not there: index and arrival.
    missing: Vec<(u32, u64)>,
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
pub struct Memory<C> {
    l1: Vec<First<C>>,
    l2: Level<C>,
    tmu: TmuConfig,
    counts: CacheCounts,
    /// What the current thread waits for, the latest first.
    pending: Vec<Pending>,
    /// Lines that it had to ask for.
    fetches: u32,
    /// Of a segment the lines that nobody has asked for: first use and index.
    absent: Vec<(u32, u32)>,
    /// Of a segment the footprints that wait, by cycle, the latest first.
    waiting: Vec<(u64, u32)>,
}

impl<C: Cache> Memory<C> {
    /// Empty caches.
    pub fn new(levels: Levels<C>, tmu: TmuConfig, counts: CacheCounts) -> Self {
        let memory_cycles = u64::from(tmu.l1_penalty_cycles) + u64::from(tmu.l2_penalty_cycles);
        // Later trips of threads that miss many lines included.
        let usual_cycles = memory_cycles + 8 * u64::from(tmu.loop_cycles);
        let first = |cache| First {
            level: Level::new(cache, usual_cycles),
            missing: Vec::new(),
        };
        Self {
            l1: levels.l1.into_iter().map(first).collect(),
            l2: Level::new(levels.l2, memory_cycles),
            tmu,
            counts,
            pending: Vec::new(),
            fetches: 0,
            absent: Vec::new(),
            waiting: Vec::new(),
        }
    }

    /// What missed.
    pub fn counts(&self) -> &CacheCounts {
        &self.counts
    }

    /// Empties all caches. Nobody waits for what is on its way.
    pub fn flush(&mut self) {
        self.l1.iter_mut().for_each(|first| first.level.clear());
        self.l2.clear();
    }

    /// Looks up all lines of a thread that enters `now`, in its core's own cache. Unless all are
    /// there, [`Self::ask`] says what it waits for.
    #[inline(always)]
    pub fn look_up(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) -> Found {
        let First { level, missing } = &mut self.l1[core];
        level.arrive(now);
        if self.tmu.l1_penalty_cycles == 0 || quad.distinct.is_empty() {
            missing.clear();
            return Found::NotAll;
        }
        match level.cache.lookup_all(quad.distinct) {
            None => Found::All,
            Some(index) => Self::others(level, missing, quad, index),
        }
    }

    /// The distinct line at `index` is not there: looks up the rest of them.
    #[inline(never)]
    fn others(
        level: &mut Level<C>,
        missing: &mut Vec<(u32, u64)>,
        quad: &QuadLines<'_>,
        mut index: usize,
    ) -> Found {
        missing.clear();
        let mut latest = 0;
        loop {
            let arrival = level.in_flight.arrival(quad.distinct[index]);
            let arrival = arrival.unwrap_or(UNKNOWN);
            latest = latest.max(arrival);
            missing.push((index as u32, arrival));
            let rest = index + 1;
            match level.cache.lookup_all(&quad.distinct[rest..]) {
                Some(next) => index = rest + next,
                None if latest == UNKNOWN => return Found::NotAll,
                None => return Found::OnTheirWay,
            }
        }
    }

    /// Asks for the lines that are missing, once it is the core's turn at the L2: the footprints
    /// that have to wait, the latest first.
    #[inline(never)]
    pub fn ask(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) -> &[Pending] {
        self.pending.clear();
        self.fetches = 0;
        let mut missing = std::mem::take(&mut self.l1[core].missing);
        if missing.is_empty() {
            self.one_by_one(core, now, quad);
        }
        let (mut rest, mut segments) = (&*missing, 0);
        for end in quad.segments() {
            if rest.is_empty() {
                break;
            }
            let inside = |(index, _): &&(u32, u64)| (*index as usize) < end;
            let (own, others) = rest.split_at(rest.iter().take_while(inside).count());
            self.segment(core, now, quad, own);
            rest = others;
            segments += 1;
        }
        if segments != 1 {
            self.pending.sort_unstable_by_key(|p| Reverse(p.ready));
        }
        missing.clear();
        self.l1[core].missing = missing;
        &self.pending
    }

    /// Lines of a segment are not there: asks for those that nobody has asked for, and says who
    /// waits for them.
    #[inline(always)]
    fn segment(&mut self, core: usize, now: u64, quad: &QuadLines<'_>, missing: &[(u32, u64)]) {
        self.waiting.clear();
        self.absent.clear();
        for &(index, arrival) in missing {
            let of = quad.uses[index as usize];
            if arrival == UNKNOWN {
                self.absent.push((of.first_line() as u32, index));
            } else {
                let cell = quad.distinct_cell(index as usize);
                self.counts.secondary(cell, of.footprints().count_ones());
                wait(&mut self.waiting, arrival, of.footprints());
            }
        }
        if !self.absent.is_empty() {
            self.fetch_absent(core, now, quad);
        }
        // A footprint waits for the last of its lines.
        let mut counted = 0;
        for &(ready, users) in &self.waiting {
            let footprints = (users & !counted).count_ones();
            counted |= users;
            if footprints > 0 {
                self.pending.push(Pending { ready, footprints });
            }
        }
    }

    /// Asks for the absent lines of a segment, in the order in which the footprints do.
    fn fetch_absent(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) {
        self.absent.sort_unstable();
        let mut asking = 0;
        let mut misses = FootprintMisses::default();
        let mut cell = 0;
        for at in 0..self.absent.len() {
            let (_, index) = self.absent[at];
            let (line, users) = (
                quad.distinct[index as usize],
                quad.uses[index as usize].footprints(),
            );
            let first_user = users & users.wrapping_neg();
            if first_user != asking {
                if asking != 0 {
                    self.counts.footprint(cell, quad.tile(), &misses);
                }
                misses = FootprintMisses::default();
                asking = first_user;
                cell = quad.distinct_cell(index as usize);
            }
            // Another segment, or another cell of this one, may have asked for it just now.
            let known = match self.fetches {
                0 => None,
                _ => self.l1[core].level.in_flight.arrival(line),
            };
            let ready = if let Some(ready) = known {
                misses.l1_secondary += users.count_ones();
                ready
            } else {
                misses.l1_lines += 1;
                misses.l1_secondary += users.count_ones() - 1;
                self.fetch(core, now, line, &mut misses)
            };
            wait(&mut self.waiting, ready, users);
        }
        self.counts.footprint(cell, quad.tile(), &misses);
    }

    /// Looks up footprint after footprint: where a miss may fill at once, and where distinct lines
    /// are not listed.
    #[inline(never)]
    fn one_by_one(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) {
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                let mut misses = FootprintMisses::default();
                let mut latest = now;
                for &line in footprint.lines {
                    if self.l1[core].level.cache.lookup(line) {
                        continue;
                    }
                    let ready = match self.l1[core].level.in_flight.arrival(line) {
                        Some(arrival) => {
                            misses.l1_secondary += 1;
                            arrival
                        }
                        None => {
                            misses.l1_lines += 1;
                            self.fetch(core, now, line, &mut misses)
                        }
                    };
                    latest = latest.max(ready);
                }
                if latest > now {
                    self.wait(latest, 1);
                }
                self.counts.footprint(footprint.cell, quad.tile(), &misses);
            }
        }
    }

    /// Footprints of the current thread wait until a cycle.
    fn wait(&mut self, ready: u64, footprints: u32) {
        match self.pending.last_mut() {
            Some(last) if last.ready == ready => last.footprints += footprints,
            _ => self.pending.push(Pending { ready, footprints }),
        }
    }

    /// Asks the L2 for a line that is not on its way into the L1; says when it arrives there.
    #[inline(never)]
    fn fetch(&mut self, core: usize, now: u64, line: u32, misses: &mut FootprintMisses) -> u64 {
        let tmu = &self.tmu;
        let trip = u64::from(self.fetches / tmu.fetches_per_trip);
        self.fetches += 1;
        // Without penalties nothing loops, so there is no later trip to wait for.
        let instant = tmu.l1_penalty_cycles == 0 && tmu.l2_penalty_cycles == 0;
        let wait = if instant {
            0
        } else {
            trip * u64::from(tmu.loop_cycles)
        };
        self.l2.arrive(now);
        let in_l2 = if self.l2.cache.lookup(line) {
            now
        } else if let Some(arrival) = self.l2.in_flight.arrival(line) {
            misses.l2_secondary += 1;
            arrival
        } else {
            misses.l2_lines += 1;
            let arrival = now + u64::from(tmu.l2_penalty_cycles);
            self.l2.enter(line, now, arrival);
            arrival
        };
        let in_l1 = in_l2 + u64::from(tmu.l1_penalty_cycles) + wait;
        self.l1[core].level.enter(line, now, in_l1);
        in_l1
    }
}

/// Footprints wait until a cycle; the list has the latest first.
#[inline(always)]
fn wait(waiting: &mut Vec<(u64, u32)>, ready: u64, footprints: u32) {
    let later = waiting.iter().take_while(|(cycle, _)| *cycle > ready);
    let at = later.count();
    match waiting.get_mut(at) {
        Some((cycle, others)) if *cycle == ready => *others |= footprints,
        _ => waiting.insert(at, (ready, footprints)),
    }
}
