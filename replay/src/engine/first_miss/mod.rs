//! The machine that the Z2 paper very probably simulates: a thread stops at its first footprint
//! that misses, and rates count first look-ups. `docs/paper-comparison.md` states the rules and
//! what speaks for them.
//!
//! A core's first stage takes one look-up a cycle: of the thread that runs, else of a thread that
//! is due again, else of a new one. Cores share the L2 and the list of items, which see them in the
//! order of time; of cores at the same cycle, the first one goes first.

mod memory;
mod thread;

use super::batch::Outcome;
use super::counts::CacheCounts;
use super::items::{Items, prefetch_upcoming};
use super::{Machine, OtherWork};
use crate::cache::{Delay, DelayedFill, Levels, MissPath};
use crate::config::{Assign, RunConfig, TmuConfig};
use crate::order::{Phase, WorkItem};
use crate::result::FirstLookups;
use crate::stream::{Cores, StreamError, furthest_behind};
use crate::tmu::PipelineStats;
use memory::{Memory, Seen};
use std::collections::VecDeque;
pub(super) use thread::Thread;

/// Cores whose threads stop at their first miss, over caches with delayed fill.
pub struct FirstMiss<D> {
    memory: Memory<D>,
    units: Vec<Unit>,
    tmu: TmuConfig,
    /// Cycles until the last core was done.
    cycles: u64,
}

/// A core's texture unit.
#[derive(Default)]
struct Unit {
    clock: u64,
    /// The thread that takes the slots, and the cycle at which this pass of it began.
    running: Option<(u64, Thread)>,
    /// Threads on their way back and the cycles at which they are there, which ascend: a pass begins
    /// after the one before has ended.
    waiting: VecDeque<(u64, Thread)>,
    /// Threads that are done: their memory is used again.
    spare: Vec<Thread>,
    drained: bool,
    stats: PipelineStats,
}

/// What the first stage does next.
enum Next {
    /// A thread has the slot.
    Run,
    /// The slot is free for a new thread.
    Free,
    /// No thread is left.
    Done,
}

impl Unit {
    /// Lets time pass until a thread has the slot, or a new one may have it.
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

impl<D: DelayedFill> FirstMiss<D> {
    /// Empty caches, a texture unit for each L1.
    pub fn new<C: Delay<Delayed = D>>(
        levels: Levels<C>,
        tmu: TmuConfig,
        counts: CacheCounts,
        path: MissPath,
    ) -> Self {
        let cores = levels.l1.len();
        Self {
            memory: Memory::new(levels, &tmu, counts, path),
            units: (0..cores).map(|_| Unit::default()).collect(),
            tmu,
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
            clocks[core] = self.run_core(core, until, work, &mut items)?;
        }
        Ok(())
    }

    /// Runs a core until it wants something shared after `until`: its cycle; the end of time if it
    /// is done.
    fn run_core(
        &mut self,
        core: usize,
        until: u64,
        work: &mut Cores<'_>,
        items: &mut Items<'_>,
    ) -> Result<u64, StreamError> {
        loop {
            let unit = &mut self.units[core];
            match unit.next(self.tmu.threads) {
                Next::Done => return Ok(u64::MAX),
                Next::Run => {
                    if !self.pass(core, until) {
                        return Ok(self.units[core].clock);
                    }
                }
                Next::Free => {
                    if let Some(quad) = work.next_quad(core) {
                        if quad.footprints > 0 {
                            unit.stats.threads += 1;
                            let mut thread = unit.spare.pop().unwrap_or_default();
                            thread.begin(quad);
                            unit.running = Some((unit.clock, thread));
                        }
                    } else if unit.clock > until {
                        return Ok(unit.clock);
                    } else if let Some(item) = items.next(core) {
                        work.load(core, item)?;
                        let now = unit.clock;
                        prefetch_upcoming(self.memory.l2(), work, items, core, now)?;
                    } else {
                        unit.drained = true;
                    }
                }
            }
        }
    }

    /// Runs the thread that has the slot until it misses or is done; false if it wants to ask the L2
    /// after `until`.
    fn pass(&mut self, core: usize, until: u64) -> bool {
        let unit = &mut self.units[core];
        let Some((began, mut thread)) = unit.running.take() else {
            return true;
        };
        while let Some(footprint) = thread.footprint() {
            let now = unit.clock;
            let seen = self.memory.look_up(core, now, footprint.lines);
            if seen == Seen::All || thread.has_kept(now) {
                self.memory.forwarded += u64::from(seen != Seen::All);
                unit.stats.useful += 1;
                unit.clock += 1;
                thread.advance();
            } else if now > until {
                unit.running = Some((began, thread));
                return false;
            } else {
                self.memory.ask(core, now, &mut thread);
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

impl<D: DelayedFill> Machine for FirstMiss<D> {
    /// A phase starts when the last core is done with the one before.
    fn run(
        &mut self,
        work: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
    ) -> Result<(), StreamError> {
        for phase in phases {
            for unit in &mut self.units {
                unit.drained = false;
                unit.clock = self.cycles;
            }
            self.run_phase(work, phase, assign)?;
            self.cycles = self.units.iter().map(|unit| unit.clock).max().unwrap_or(0);
        }
        Ok(())
    }

    fn flush(&mut self) {
        self.memory.flush();
    }

    fn lose(&mut self, other: OtherWork, l2_lines: u64) {
        self.memory.lose(other.lines(l2_lines), self.cycles);
    }

    fn outcome(&self, _config: &RunConfig) -> Outcome {
        let stats = self.units.iter().map(|unit| unit.stats);
        Outcome {
            path: self.memory.path_result(),
            ..Outcome::timed(self.memory.counts().clone(), stats, self.cycles)
        }
    }

    fn first_lookups(&self) -> Option<FirstLookups> {
        let useful = self.units.iter().map(|unit| unit.stats.useful).sum();
        Some(self.memory.first_lookups(useful))
    }
}
