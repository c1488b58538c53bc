//! A texture unit with a prefetching FIFO (Igehy, Eldridge and Proudfoot, Graphics Hardware 1998, section 3): tags are checked in
//! order, a footprint per cycle; what misses is requested at once, and the footprint waits in a FIFO. It leaves, in order, when its
//! lines are there. A miss takes its way when it is requested. A line that is evicted in flight still arrives, and look-ups until then
//! are merged with its fetch.

use super::batch::Outcome;
use super::counts::{CacheCounts, FootprintMisses};
use super::first_miss::Thread;
use super::items::{Items, prefetch_upcoming};
use super::{Machine, OtherWork};
use crate::cache::{Answer, Delay, DelayedFill, Levels, MissPath, NOT_IN_FLIGHT, SharedLevel};
use crate::config::{Assign, RunConfig, TmuConfig};
use crate::order::{Phase, WorkItem};
use crate::stream::{Cores, StreamError, furthest_behind};
use crate::tmu::PipelineStats;
use std::collections::VecDeque;

/// Texture units, and the caches that they share.
pub struct PrefetchFifo<D> {
    l1: Vec<D>,
    l2: SharedLevel<D>,
    units: Vec<Unit>,
    tmu: TmuConfig,
    counts: CacheCounts,
    /// Cycles until the last core was done.
    cycles: u64,
}

/// A core's texture unit.
#[derive(Default)]
struct Unit {
    /// When the next footprint's tags are checked.
    clock: u64,
    /// The quad whose footprints are next.
    quad: Thread,
    /// When each footprint in the FIFO leaves it; ascending.
    exits: VecDeque<u64>,
    /// When the last footprint so far leaves the FIFO.
    last_exit: u64,
    stats: PipelineStats,
}

impl<D: DelayedFill> PrefetchFifo<D> {
    /// Empty caches, a texture unit for each L1.
    pub fn new<C: Delay<Delayed = D>>(
        levels: Levels<C>,
        tmu: TmuConfig,
        counts: CacheCounts,
        path: MissPath,
    ) -> Self {
        let [l1_cycles, l2_cycles] = [tmu.l1_penalty_cycles, tmu.l2_penalty_cycles].map(u64::from);
        let Levels { l1, l2 } = levels.delayed(l1_cycles + l2_cycles, l2_cycles);
        Self {
            units: l1.iter().map(|_| Unit::default()).collect(),
            l1,
            l2: SharedLevel::new(l2, path),
            tmu,
            counts,
            cycles: 0,
        }
    }

    fn run_phase(
        &mut self,
        work: &mut Cores<'_>,
        phase: &[WorkItem],
        assign: Assign,
    ) -> Result<(), StreamError> {
        let mut items = Items::new(phase, assign, self.units.len());
        // A core that is done is at the end of time.
        let mut clocks: Vec<u64> = self.units.iter().map(|unit| unit.clock).collect();
        while let Some((core, until)) = furthest_behind(&clocks) {
            clocks[core] = loop {
                let unit = &mut self.units[core];
                let now = unit.clock;
                if now > until {
                    break now;
                }
                if unit.quad.footprint().is_some() {
                    self.check_tags(core);
                } else if let Some(quad) = work.next_quad(core) {
                    unit.stats.threads += u64::from(quad.footprints > 0);
                    unit.quad.begin(quad);
                } else if let Some(item) = items.next(core) {
                    work.load(core, item)?;
                    prefetch_upcoming(&mut self.l2, work, &items, core, now)?;
                } else {
                    break u64::MAX;
                }
            };
        }
        Ok(())
    }

    /// The core's next footprint enters the FIFO, or time passes until there is room for it.
    fn check_tags(&mut self, core: usize) {
        let unit = &mut self.units[core];
        let now = unit.clock;
        while unit.exits.front().is_some_and(|&exit| exit <= now) {
            unit.exits.pop_front();
        }
        if unit.exits.len() >= self.tmu.fifo_footprints as usize {
            unit.clock = unit.exits.front().copied().unwrap_or(now);
            return;
        }
        let Some(footprint) = unit.quad.footprint() else {
            return;
        };
        let l1 = &mut self.l1[core];
        let mut misses = FootprintMisses::default();
        let mut ready = now;
        for &line in footprint.lines {
            let arrival = match l1.look_up(line, now) {
                NOT_IN_FLIGHT => {
                    misses.l1_lines += 1;
                    let in_l2 = match self.l2.request(line, now) {
                        Answer::Hit => now,
                        Answer::InFlight(arrival) => {
                            misses.l2_secondary += 1;
                            arrival
                        }
                        Answer::Miss(arrival) => {
                            misses.l2_lines += 1;
                            arrival
                        }
                    };
                    let arrival = in_l2 + u64::from(self.tmu.l1_penalty_cycles);
                    l1.enter(line, now, arrival);
                    arrival
                }
                arrival => {
                    misses.l1_secondary += u32::from(arrival > 0);
                    arrival
                }
            };
            ready = ready.max(arrival);
        }
        self.counts
            .footprint(footprint.cell, footprint.tile, &misses);
        unit.quad.advance();
        unit.last_exit = ready.max(unit.last_exit + 1).max(now + 1);
        unit.exits.push_back(unit.last_exit);
        unit.stats.useful += 1;
        unit.clock += 1;
        let caches = &mut self.l1;
        self.l2.invalidate_l1(|line| {
            let removed = caches.iter_mut().map(|l1| l1.remove(line, now));
            removed.map(u64::from).sum()
        });
    }
}

impl<D: DelayedFill> Machine for PrefetchFifo<D> {
    /// A phase starts when the last core is done with the one before.
    fn run(
        &mut self,
        work: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
    ) -> Result<(), StreamError> {
        for phase in phases {
            let start = self.cycles;
            let before: Vec<u64> = self.units.iter().map(|unit| unit.stats.useful).collect();
            for unit in &mut self.units {
                (unit.clock, unit.last_exit) = (start, start);
                unit.exits.clear();
            }
            self.run_phase(work, phase, assign)?;
            for (unit, before) in self.units.iter_mut().zip(before) {
                let useful = unit.stats.useful - before;
                unit.stats.idle += unit.last_exit - start - useful;
            }
            let exits = self.units.iter().map(|unit| unit.last_exit);
            self.cycles = exits.max().unwrap_or(start);
        }
        Ok(())
    }

    fn flush(&mut self) {
        self.l1.iter_mut().for_each(D::clear);
        self.l2.clear();
    }

    fn lose(&mut self, other: OtherWork, l2_lines: u64) {
        self.l1.iter_mut().for_each(D::clear);
        self.l2.fill_with(other.lines(l2_lines), self.cycles);
    }

    fn outcome(&self, _config: &RunConfig) -> Outcome {
        let stats = self.units.iter().map(|unit| unit.stats);
        Outcome {
            path: self.l2.result(),
            ..Outcome::timed(self.counts.clone(), stats, self.cycles)
        }
    }
}
