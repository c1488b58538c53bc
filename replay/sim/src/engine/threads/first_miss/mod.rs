//! The machine that the Z2 paper probably simulates: a thread stops at its first footprint that misses, and
//! rates count first look-ups. `docs/models/z2.md` states the rules and the evidence for them.
//!
//! A core's first stage performs one look-up per cycle: for the running thread, else for a returning
//! thread, else for a new one. In the same cycle, cores with lower numbers go first.

mod memory;
mod thread;

use super::{CoreRun, Shared, ThreadModel};
use crate::config::{RunConfig, TmuConfig};
use crate::engine::outcome::MachineOutcome;
use crate::memory::DelayedFill;
use crate::stream::StreamError;
use crate::tmu::PipelineStats;
use memory::{FirstMissMemory, Seen};
use std::collections::VecDeque;
pub(super) use thread::Thread;

/// Cores whose threads stop at their first miss.
pub struct FirstMiss {
    memory: FirstMissMemory,
    units: Vec<FirstMissUnit>,
    tmu: TmuConfig,
}

/// A core's texture unit.
#[derive(Default)]
struct FirstMissUnit {
    clock: u64,
    /// The running thread, and the cycle at which its current trip began.
    running: Option<(u64, Thread)>,
    /// Returning threads and the cycles of their return, which ascend, because trips do not overlap.
    waiting: VecDeque<(u64, Thread)>,
    /// Finished threads, whose allocations are reused.
    spare: Vec<Thread>,
    drained: bool,
    stats: PipelineStats,
}

/// State of the first stage.
enum Next {
    /// A thread occupies the slot.
    Run,
    /// A new thread can use the slot.
    Free,
    /// No threads are left.
    Done,
}

impl FirstMissUnit {
    /// Advances time until a thread occupies the slot or a new one can.
    fn next(&mut self, threads: u32) -> Next {
        if self.running.is_some() {
            return Next::Run;
        }
        let full = self.drained || self.waiting.len() >= threads as usize;
        match self.waiting.front() {
            Some(&(back, _)) if back <= self.clock || full => {
                self.stats.idle += back.saturating_sub(self.clock);
                self.stats.loops += 1;
                self.clock = self.clock.max(back);
                let now = self.clock;
                self.running = self.waiting.pop_front().map(|(_, thread)| (now, thread));
                Next::Run
            }
            None if self.drained => Next::Done,
            _ => Next::Free,
        }
    }
}

impl FirstMiss {
    /// One texture unit per core.
    pub fn new(config: &RunConfig, cores: usize) -> Self {
        Self {
            units: (0..cores).map(|_| FirstMissUnit::default()).collect(),
            memory: FirstMissMemory::new(cores),
            tmu: config.tmu,
        }
    }

    /// Runs the current thread until it misses or finishes. Returns false if it must access the L2 later than `until`.
    fn pass<D: DelayedFill>(&mut self, shared: &mut Shared<D>, core: usize, until: u64) -> bool {
        let unit = &mut self.units[core];
        let Some((began, mut thread)) = unit.running.take() else {
            return true;
        };
        while let Some(footprint) = thread.footprint() {
            let now = unit.clock;
            let seen = self.memory.look_up(shared, core, now, footprint.lines);
            if seen == Seen::All || thread.has_kept(now) {
                self.memory.first.forwarded += u64::from(seen != Seen::All);
                unit.stats.useful += 1;
                unit.clock += 1;
                thread.advance();
            } else if now > until {
                unit.running = Some((began, thread));
                return false;
            } else {
                self.memory.request(shared, core, now, &mut thread);
                unit.stats.wasted += 1;
                unit.clock += 1;
                let back = began + u64::from(self.tmu.loop_cycles);
                unit.waiting.push_back((back.max(unit.clock), thread));
                return true;
            }
        }
        unit.spare.push(thread);
        true
    }
}

impl ThreadModel for FirstMiss {
    fn units(&self) -> Vec<(u64, PipelineStats)> {
        let units = self.units.iter();
        units.map(|unit| (unit.clock, unit.stats)).collect()
    }

    fn start_phase(&mut self, cycle: u64) {
        for unit in &mut self.units {
            (unit.drained, unit.clock) = (false, cycle);
        }
    }

    fn run_core<D: DelayedFill>(&mut self, mut run: CoreRun<D>) -> Result<u64, StreamError> {
        let (core, until) = (run.core, run.until);
        loop {
            let unit = &mut self.units[core];
            match unit.next(self.tmu.threads) {
                Next::Done => return Ok(u64::MAX),
                Next::Run => {
                    if !self.pass(run.shared, core, until) {
                        return Ok(self.units[core].clock);
                    }
                }
                Next::Free => {
                    if let Some(quad) = run.work.next_quad(core) {
                        if quad.footprints > 0 {
                            unit.stats.threads += 1;
                            let mut thread = unit.spare.pop().unwrap_or_default();
                            thread.begin(quad);
                            unit.running = Some((unit.clock, thread));
                        }
                    } else if unit.clock > until {
                        return Ok(unit.clock);
                    } else if run.start_item(unit.clock)?.is_none() {
                        unit.drained = true;
                    }
                }
            }
        }
    }

    fn complete<D: DelayedFill>(&self, _shared: &Shared<D>, outcome: &mut MachineOutcome) {
        let useful = self.units.iter().map(|unit| unit.stats.useful).sum();
        outcome.first_lookups = Some(self.memory.first.over(useful));
    }
}
