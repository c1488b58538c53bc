//! A texture unit with a prefetching FIFO (Igehy, Eldridge and Proudfoot, Graphics Hardware 1998, section
//! 3). Tags are checked in order, one footprint per cycle. Missing lines are requested immediately, and the
//! footprint waits in a FIFO, which it leaves in order when its lines have arrived. A missing line is
//! allocated a way when it is requested. A line evicted in flight still arrives, and look-ups until then
//! merge with its fetch.

use super::first_miss::Thread;
use super::{CoreRun, Shared, ThreadModel};
use crate::config::{RunConfig, TmuConfig};
use crate::engine::counts::FootprintMisses;
use crate::memory::{DelayedFill, NOT_IN_FLIGHT};
use crate::stream::StreamError;
use crate::tmu::PipelineStats;
use std::collections::VecDeque;

/// The texture units of all cores.
pub struct PrefetchFifo {
    units: Vec<FifoUnit>,
    tmu: TmuConfig,
    /// Start of the phase, and footprints that had left each FIFO before it.
    phase: (u64, Vec<u64>),
}

/// A core's texture unit.
#[derive(Default)]
struct FifoUnit {
    /// Cycle of the next footprint's tag check.
    clock: u64,
    /// The quad whose footprints come next.
    quad: Thread,
    /// Cycle at which each footprint leaves the FIFO, ascending.
    exits: VecDeque<u64>,
    /// Cycle at which the most recent footprint leaves the FIFO.
    last_exit: u64,
    stats: PipelineStats,
}

impl PrefetchFifo {
    /// One texture unit per core.
    pub fn new(config: &RunConfig, cores: usize) -> Self {
        Self {
            units: (0..cores).map(|_| FifoUnit::default()).collect(),
            tmu: config.tmu,
            phase: (0, Vec::new()),
        }
    }

    /// Puts the core's next footprint into the FIFO, or advances time until there is room.
    fn check_tags<D: DelayedFill>(&mut self, shared: &mut Shared<D>, core: usize) {
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
        let mut misses = FootprintMisses::default();
        let mut ready = now;
        for &line in footprint.lines {
            let arrival = match shared.l1[core].look_up(line, now) {
                NOT_IN_FLIGHT => {
                    misses.l1_lines += 1;
                    let answer = shared.l2.request(core, line, now);
                    let arrival = misses.count_l2_answer(answer, now) + shared.l2_cycles;
                    shared.l1[core].enter(line, now, arrival);
                    arrival
                }
                arrival => {
                    misses.l1_secondary += u32::from(arrival > 0);
                    arrival
                }
            };
            ready = ready.max(arrival);
        }
        shared
            .counts
            .footprint(footprint.cell, footprint.tile, &misses);
        unit.quad.advance();
        unit.last_exit = ready.max(unit.last_exit + 1).max(now + 1);
        unit.exits.push_back(unit.last_exit);
        unit.stats.useful += 1;
        unit.clock += 1;
        shared.follow_evictions(now);
    }
}

impl ThreadModel for PrefetchFifo {
    fn units(&self) -> Vec<(u64, PipelineStats)> {
        let units = self.units.iter();
        units.map(|unit| (unit.clock, unit.stats)).collect()
    }

    fn start_phase(&mut self, cycle: u64) {
        self.phase = (
            cycle,
            self.units.iter().map(|unit| unit.stats.useful).collect(),
        );
        for unit in &mut self.units {
            (unit.clock, unit.last_exit) = (cycle, cycle);
            unit.exits.clear();
        }
    }

    fn run_core<D: DelayedFill>(&mut self, mut run: CoreRun<D>) -> Result<u64, StreamError> {
        let (core, until) = (run.core, run.until);
        loop {
            let unit = &mut self.units[core];
            let now = unit.clock;
            if now > until {
                return Ok(now);
            }
            if unit.quad.footprint().is_some() {
                self.check_tags(run.shared, core);
            } else if let Some(quad) = run.work.next_quad(core) {
                unit.stats.threads += u64::from(quad.footprints > 0);
                unit.quad.begin(quad);
            } else if run.start_item(now)?.is_none() {
                return Ok(u64::MAX);
            }
        }
    }

    fn end_phase(&mut self) -> u64 {
        let (start, before) = &self.phase;
        for (unit, before) in self.units.iter_mut().zip(before) {
            unit.stats.idle += unit.last_exit - start - (unit.stats.useful - before);
        }
        let exits = self.units.iter().map(|unit| unit.last_exit);
        exits.max().unwrap_or(*start)
    }
}
