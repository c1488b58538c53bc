//! A thread requests all missing lines of its footprints and loops through the pipeline until they are
//! filled ("looping for the next chance").

mod memory;
mod requests;
mod timeline;

use super::{Items, Shared, ThreadModel, start_item};
use crate::config::RunConfig;
use crate::engine::counts::CacheCounts;
use crate::engine::outcome::Outcome;
use crate::memory::{Caches, Delay, DelayedFill, MissPath};
use crate::stream::{Cores, StreamError};
use crate::tmu::{Pipeline, Turn};
use memory::{Found, Memory};
use timeline::Recorder;

/// Texture units and their shared caches.
pub struct Looping<D> {
    memory: Memory<D>,
    units: Vec<Pipeline>,
    /// Per core, whether its thread has been looked up and has requests for the L2.
    is_requesting: Vec<bool>,
    /// Records the timeline, if requested.
    recorder: Option<Recorder>,
}

impl<D: DelayedFill> Looping<D> {
    /// Empty caches, and one texture unit per L1.
    pub fn new<C: Delay<Delayed = D>>(
        caches: Caches<C>,
        config: &RunConfig,
        counts: CacheCounts,
        path: MissPath,
    ) -> Self {
        let cores = caches.l1.len();
        Self {
            memory: Memory::new(caches, config, counts, path),
            units: vec![Pipeline::new(config.tmu); cores],
            is_requesting: vec![false; cores],
            recorder: config.timeline.then(|| Recorder::new(cores)),
        }
    }
}

impl<D: DelayedFill> ThreadModel for Looping<D> {
    type L1 = D;

    fn shared(&mut self) -> &mut Shared<D> {
        self.memory.shared()
    }

    fn start_phase(&mut self, cycle: u64) {
        self.units.iter_mut().for_each(|unit| unit.resume(cycle));
    }

    fn clocks(&self) -> Vec<u64> {
        self.units.iter().map(Pipeline::clock).collect()
    }

    fn run_core(
        &mut self,
        core: usize,
        until: u64,
        work: &mut Cores<'_>,
        items: &mut Items<'_, '_>,
    ) -> Result<u64, StreamError> {
        let unit = &mut self.units[core];
        if std::mem::take(&mut self.is_requesting[core])
            && let Some(quad) = work.quad(core)
        {
            let waiting = self.memory.request(core, unit.clock(), &quad);
            unit.start(quad.footprints, waiting);
        }
        loop {
            match unit.turn() {
                Turn::Looped => {}
                Turn::Done => return Ok(u64::MAX),
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
                                self.is_requesting[core] = true;
                                return Ok(now);
                            }
                            Found::NotAll => {
                                let waiting = self.memory.request(core, now, &quad);
                                unit.start(quad.footprints, waiting);
                            }
                        }
                    } else if now > until {
                        return Ok(now);
                    } else if let Some(item) = items.next(core) {
                        if let Some(recorder) = &mut self.recorder {
                            recorder.start(core, now, unit.stats(), item);
                        }
                        start_item(self.memory.l2(), work, items, core, item, now)?;
                    } else {
                        unit.drain();
                    }
                }
            }
        }
    }

    fn end_phase(&mut self) -> u64 {
        if let Some(recorder) = &mut self.recorder {
            for (core, unit) in self.units.iter().enumerate() {
                recorder.end(core, unit.clock(), unit.stats());
            }
        }
        self.units.iter().map(Pipeline::clock).max().unwrap_or(0)
    }

    fn outcome(&self, cycles: u64) -> Outcome {
        let stats = self.units.iter().map(Pipeline::stats);
        Outcome {
            memory: self.memory.result(),
            timeline: (self.recorder.as_ref())
                .map(|recorder| recorder.timeline(self.memory.fetched_lines())),
            ..Outcome::timed(self.memory.counts().clone(), stats, cycles)
        }
    }
}
