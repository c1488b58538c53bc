//! Timed replay: each core's texture unit runs on its own cycle clock, and the clocks decide in
//! which order the cores' misses reach the shared L2.

mod asking;
mod memory;
mod timeline;

use super::batch::Outcome;
use super::counts::CacheCounts;
use super::items::{Items, prefetch_upcoming};
use super::{Machine, OtherWork};
use crate::cache::{Delay, DelayedFill, Levels, MissPath};
use crate::config::{Assign, RunConfig, TmuConfig};
use crate::order::{Phase, WorkItem};
use crate::stream::{Cores, StreamError, furthest_behind};
use crate::tmu::{Pipeline, Turn};
use memory::{Found, Memory};
use timeline::Recorder;

/// Texture units, and the caches that they share.
pub struct Timed<D> {
    memory: Memory<D>,
    units: Vec<Pipeline>,
    /// Cycles until the last core was done.
    cycles: u64,
    /// What `--timeline` shows.
    recorder: Option<Recorder>,
}

impl<D: DelayedFill> Timed<D> {
    /// Empty caches, a texture unit for each L1.
    pub fn new<C: Delay<Delayed = D>>(
        levels: Levels<C>,
        tmu: TmuConfig,
        counts: CacheCounts,
        path: MissPath,
    ) -> Self {
        let cores = levels.l1.len();
        Self {
            memory: Memory::new(levels, tmu, counts, path),
            units: vec![Pipeline::new(tmu); cores],
            cycles: 0,
            recorder: None,
        }
    }

    /// Also records which core works on which tiles when.
    pub fn with_timeline(mut self, is_wanted: bool) -> Self {
        self.recorder = is_wanted.then(|| Recorder::new(self.units.len()));
        self
    }

    /// What the cores share, the L2 and the list of items, sees them in the order of time: it is
    /// the turn of the core whose clock is furthest behind. All else a core does on its own, so it
    /// runs on until it wants something shared and another core is behind.
    fn run_phase(
        &mut self,
        work: &mut Cores<'_>,
        phase: &[WorkItem],
        assign: Assign,
    ) -> Result<(), StreamError> {
        let mut items = Items::new(phase, assign, self.units.len());
        // A core that is done is at the end of time.
        let mut clocks: Vec<u64> = self.units.iter().map(Pipeline::clock).collect();
        // Cores whose thread has been looked up and is to ask the L2.
        let mut asking = vec![false; self.units.len()];
        while let Some((core, until)) = furthest_behind(&clocks) {
            let unit = &mut self.units[core];
            if std::mem::take(&mut asking[core])
                && let Some(quad) = work.quad(core)
            {
                let waiting = self.memory.ask(core, unit.clock(), &quad);
                unit.start(quad.footprints, waiting);
            }
            clocks[core] = loop {
                match unit.turn() {
                    Turn::Looped => {}
                    Turn::Done => break u64::MAX,
                    Turn::Free => {
                        let now = unit.clock();
                        if let Some(quad) = work.next_quad(core) {
                            if quad.footprints == 0 {
                                continue;
                            }
                            match self.memory.look_up(core, now, &quad) {
                                Found::All | Found::InFlight => {
                                    unit.start(quad.footprints, self.memory.waiting(core));
                                }
                                Found::NotAll if now > until => {
                                    asking[core] = true;
                                    break now;
                                }
                                Found::NotAll => {
                                    let waiting = self.memory.ask(core, now, &quad);
                                    unit.start(quad.footprints, waiting);
                                }
                            }
                        } else if now > until {
                            break now;
                        } else if let Some(item) = items.next(core) {
                            if let Some(recorder) = &mut self.recorder {
                                recorder.start(core, now, unit.stats(), item);
                            }
                            work.load(core, item)?;
                            prefetch_upcoming(self.memory.l2(), work, &items, core, now)?;
                        } else {
                            unit.drain();
                        }
                    }
                }
            };
        }
        Ok(())
    }
}

impl<D: DelayedFill> Machine for Timed<D> {
    /// A phase starts when the last core is done with the one before.
    fn run(
        &mut self,
        work: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
    ) -> Result<(), StreamError> {
        for phase in phases {
            let cycles = self.cycles;
            self.units.iter_mut().for_each(|unit| unit.resume(cycles));
            self.run_phase(work, phase, assign)?;
            if let Some(recorder) = &mut self.recorder {
                for (core, unit) in self.units.iter().enumerate() {
                    recorder.end(core, unit.clock(), unit.stats());
                }
            }
            self.cycles = self.units.iter().map(Pipeline::clock).max().unwrap_or(0);
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
        let stats = self.units.iter().map(Pipeline::stats);
        Outcome {
            path: self.memory.path_result(),
            timeline: (self.recorder.as_ref())
                .map(|recorder| recorder.timeline(self.memory.fetched_lines())),
            ..Outcome::timed(self.memory.counts().clone(), stats, self.cycles)
        }
    }
}
