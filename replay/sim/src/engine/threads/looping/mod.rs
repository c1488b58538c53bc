//! A thread requests all missing lines of its footprints and loops through the pipeline until they are
//! filled ("looping for the next chance").

mod memory;
mod requests;
mod timeline;

use super::{CoreRun, Shared, ThreadModel};
use crate::config::RunConfig;
use crate::engine::outcome::MachineOutcome;
use crate::memory::DelayedFill;
use crate::stream::StreamError;
use crate::tmu::{Pipeline, PipelineStats, Turn};
use memory::{LoopingMemory, QuadLookup};
use timeline::Recorder;

/// The texture units of all cores.
pub struct Looping {
    memory: LoopingMemory,
    units: Vec<Pipeline>,
    /// Per core, whether its thread has been looked up and has requests for the L2.
    is_requesting: Vec<bool>,
    /// Records the timeline, if requested.
    recorder: Option<Recorder>,
}

impl Looping {
    /// One texture unit per core.
    pub fn new(config: &RunConfig, cores: usize) -> Self {
        Self {
            memory: LoopingMemory::new(config, cores),
            units: vec![Pipeline::new(config.tmu); cores],
            is_requesting: vec![false; cores],
            recorder: config.timeline.then(|| Recorder::new(cores)),
        }
    }
}

impl ThreadModel for Looping {
    fn units(&self) -> Vec<(u64, PipelineStats)> {
        self.units
            .iter()
            .map(|unit| (unit.clock(), unit.stats()))
            .collect()
    }

    fn start_phase(&mut self, cycle: u64) {
        self.units.iter_mut().for_each(|unit| unit.resume(cycle));
    }

    fn run_core<D: DelayedFill>(&mut self, mut run: CoreRun<D>) -> Result<u64, StreamError> {
        let (core, until) = (run.core, run.until);
        let unit = &mut self.units[core];
        if std::mem::take(&mut self.is_requesting[core])
            && let Some(quad) = run.work.quad(core)
        {
            let waiting = self.memory.request(run.shared, core, unit.clock(), &quad);
            unit.start(quad.footprints, waiting);
        }
        loop {
            match unit.turn() {
                Turn::Looped => {}
                Turn::Done => return Ok(u64::MAX),
                Turn::Free => {
                    let now = unit.clock();
                    if let Some(quad) = run.work.next_quad(core) {
                        if quad.footprints == 0 {
                            continue;
                        }
                        match self.memory.look_up(run.shared, core, now, &quad) {
                            QuadLookup::All | QuadLookup::InFlight => {
                                unit.start(quad.footprints, self.memory.waiting(core));
                            }
                            QuadLookup::NotAll if now > until => {
                                self.is_requesting[core] = true;
                                return Ok(now);
                            }
                            QuadLookup::NotAll => {
                                let waiting = self.memory.request(run.shared, core, now, &quad);
                                unit.start(quad.footprints, waiting);
                            }
                        }
                    } else if now > until {
                        return Ok(now);
                    } else if let Some(item) = run.start_item(now)? {
                        if let Some(recorder) = &mut self.recorder {
                            recorder.start(core, now, unit.stats(), item);
                        }
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

    fn complete<D: DelayedFill>(&self, shared: &Shared<D>, outcome: &mut MachineOutcome) {
        let recorder = self.recorder.as_ref();
        outcome.timeline = recorder.map(|of| of.timeline(&shared.l2));
    }
}
