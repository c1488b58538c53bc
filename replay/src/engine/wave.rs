//! Runs the groups of a stream, frame by frame.

use super::batch::{Job, Pass};
use super::scheduler::Stage;
use super::summary::summary;
use super::{Machine, ReplayError, check_other_work};
use crate::config::{BetweenFrames, Order, RunConfig, TmuModel};
use crate::memory::OtherWork;
use crate::order::parts::Eyes;
use crate::order::{self, Counters, Interleave, Known, Phase};
use crate::result::RunResult;
use crate::stream::{Cores, Expander, Frame, LineMemory, TileSource, TraceCounts, rendered};
use formats::textrace::TraceMeta;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Groups that read the same lines, and what they need.
pub(super) struct Wave<'a> {
    pub(super) job: Job<'a>,
    pub(super) memory: &'a LineMemory,
    /// Reports the stages of a frame: lines loaded, last replay started.
    pub(super) report_stage: &'a (dyn Fn(Stage) + Sync),
}

impl<'a> Wave<'a> {
    /// Runs at least one group. While a frame is replayed, the next one is expanded if there is memory for it.
    pub(super) fn run(&self, mut passes: Vec<Pass<'a>>) -> Result<(), ReplayError> {
        let rendered = rendered(self.job.trace, passes[0].config())?;
        let trace_passes = &rendered.tables().passes;
        let expander = expander_for(Expander::new(&rendered, passes[0].config())?, &passes);
        let lost = |pass: &Pass<'_>| pass.config().between_frames.lost_percent();
        if passes.iter().filter_map(lost).next().is_some() {
            check_other_work(expander.lines())?;
        }
        let mut counts = TraceCounts::new(expander.bins());
        let mut frames: Vec<u32> = trace_passes.iter().map(|pass| pass.frame).collect();
        frames.sort_unstable();
        frames.dedup();
        let orders = Orders::of(&passes);
        let meta = &rendered.tables().meta;
        let mut counters = None;
        let mut ahead = None;
        for (index, &number) in frames.iter().enumerate() {
            let frame = match ahead.take() {
                Some(frame) => frame,
                None => expander.frame(number, self.memory, &mut counts)?,
            };
            (self.report_stage)(Stage::Loaded);
            let counted = match orders.need_counters() {
                true => {
                    let known = Known::new(passes[0].config(), meta);
                    Some(frame.counters(trace_passes, number, &known)?)
                }
                false => None,
            };
            let last = counters.take().or_else(|| counted.clone());
            let plans = orders.plans(trace_passes, number, meta, last.as_ref());
            counters = counted;
            let waiting = AtomicUsize::new(passes.len());
            let is_last = index + 1 == frames.len();
            let replay = |pass: &mut Pass<'a>, frame: &Frame<'_>| {
                if waiting.fetch_sub(1, Ordering::Relaxed) == 1 && is_last {
                    (self.report_stage)(Stage::LastReplayStarted);
                }
                let config = *pass.config();
                let mut machine = self.machine(pass, &expander, index)?;
                let mut cores = Cores::new(frame, config.cores as usize);
                if let Some(clients) = &mut pass.clients {
                    clients.start_frame(number)?;
                    machine.client_accesses(clients);
                }
                let phases = orders.plan(&plans, &config);
                machine.run(&mut cores, phases, config.dispatch(), pass.clients.as_mut())?;
                if let Some(clients) = &mut pass.clients {
                    clients.end_frame();
                    machine.client_accesses(clients);
                }
                Ok::<_, ReplayError>(machine)
            };
            // The last group to finish frees the frame's memory, even while this thread is busy.
            let frame = Arc::new(frame);
            let share = |pass| (pass, Arc::clone(&frame));
            let all: Vec<_> = passes.iter_mut().map(share).collect();
            drop(frame);
            // Started in order as threads become free, because the first groups take longest.
            let all = all.into_iter().par_bridge();
            let Some(&next) = frames.get(index + 1) else {
                return all.try_for_each(|(pass, frame)| {
                    let machine = replay(pass, &frame)?;
                    drop(frame);
                    self.finish(pass, &*machine, &rendered, &expander, &counts)
                });
            };
            let keep = || {
                all.try_for_each(|(pass, frame)| {
                    pass.machine = Some(replay(pass, &frame)?);
                    Ok::<(), ReplayError>(())
                })
            };
            let expand = || {
                let room = self.memory.half_is_left();
                room.then(|| expander.frame(next, self.memory, &mut counts))
            };
            let (kept, expanded) = rayon::join(keep, expand);
            kept?;
            ahead = expanded.transpose()?;
        }
        // The trace has no frames.
        for pass in &passes {
            self.finish(
                pass,
                &*pass.build(&expander)?,
                &rendered,
                &expander,
                &counts,
            )?;
        }
        Ok(())
    }

    /// The machine of a group at the start of a frame: a new one, or the last frame's with what remains in its caches.
    fn machine(
        &self,
        pass: &mut Pass<'a>,
        expander: &Expander,
        index: usize,
    ) -> Result<Box<dyn Machine>, ReplayError> {
        let Some(mut machine) = pass.machine.take() else {
            pass.build_clients(self.job.trace, expander)?;
            return pass.build(expander);
        };
        let config = pass.config();
        match config.between_frames {
            BetweenFrames::Keep => {}
            BetweenFrames::Flush => machine.flush(),
            BetweenFrames::Lose(percent) => {
                machine.lose(OtherWork::after(index, percent, config));
            }
        }
        Ok(machine)
    }

    fn finish(
        &self,
        pass: &Pass<'_>,
        machine: &dyn Machine,
        rendered: &dyn TileSource,
        expander: &Expander<'_>,
        counts: &TraceCounts,
    ) -> Result<(), ReplayError> {
        let tables = rendered.tables();
        for &index in &pass.points {
            let config = &self.job.configs[index];
            let outcome = machine.outcome(config);
            let (tmu, cycles) = (outcome.tmu, outcome.cycles);
            let mut result = RunResult {
                tmu,
                cycles,
                timeline: outcome.timeline,
                first_lookups: outcome.first_lookups,
                ..summary(tables, expander.bins(), counts, &outcome.counts, config)
            };
            let l2_misses = result.l2.counters.line_misses;
            result.external_bytes = outcome.memory.external_bytes(l2_misses, config.line_bytes);
            result.memory = outcome.memory;
            if let Some(clients) = &pass.clients {
                let (traffic, geometry) = clients.result(result.external_bytes);
                (result.clients, result.geometry) = (traffic, Some(geometry));
            }
            (self.job.finished)(index, result);
        }
        Ok(())
    }
}

/// Configures the expander to list what the groups read.
fn expander_for<'a>(expander: Expander<'a>, passes: &[Pass<'_>]) -> Expander<'a> {
    let in_halves =
        |pass: &Pass<'_>| pass.config().order.parts().eyes == Eyes::OneCore(Interleave::Halves);
    let expander = expander.in_halves(passes.iter().any(in_halves));
    let at_once = |pass: &Pass<'_>| pass.config().misses_change_caches_at_once();
    match passes[0].config().tmu_model() {
        None => match passes.iter().map(Pass::least_sets).min() {
            Some(Some(sets)) => expander.without_idle_accesses(sets),
            _ => expander,
        },
        Some(TmuModel::FirstMiss | TmuModel::PrefetchFifo) => expander,
        // If a miss fills the cache immediately, the timed machine looks footprints up one by one.
        Some(TmuModel::Looping) if passes.iter().any(at_once) => expander.with_distinct_lines(true),
        Some(TmuModel::Looping) => expander.only_distinct_lines(),
    }
}

/// The distinct orders of some groups, each with the configuration of the first group that has it.
struct Orders(Vec<RunConfig>);

impl Orders {
    /// The settings that a plan depends on.
    fn key(config: &RunConfig) -> (Order, u64, u32) {
        let order = config.order.resolved(config.level.l2.size_bytes);
        (order, config.seed, config.cores)
    }

    fn of(passes: &[Pass<'_>]) -> Self {
        let mut orders: Vec<RunConfig> = Vec::new();
        for pass in passes {
            let key = Self::key(pass.config());
            if !orders.iter().any(|other| Self::key(other) == key) {
                orders.push(*pass.config());
            }
        }
        Self(orders)
    }

    fn need_counters(&self) -> bool {
        let mut orders = self.0.iter();
        orders.any(|config| config.order.parts().needs_counters())
    }

    /// The plan of each order for a frame.
    fn plans(
        &self,
        trace_passes: &[formats::textrace::Pass],
        frame: u32,
        meta: &TraceMeta,
        last: Option<&Counters>,
    ) -> Vec<Vec<Phase>> {
        let plan = |config: &RunConfig| {
            let known = Known {
                last,
                ..Known::new(config, meta)
            };
            order::plan_frame(config.order, &known, trace_passes, frame)
        };
        self.0.par_iter().map(plan).collect()
    }

    fn plan<'p>(&self, plans: &'p [Vec<Phase>], config: &RunConfig) -> &'p [Phase] {
        let key = Self::key(config);
        let index = self.0.iter().position(|other| Self::key(other) == key);
        index.map_or(&[], |index| &plans[index])
    }
}
