//! Runs the groups of a stream, frame by frame.

use super::counts::CacheCounts;
use super::error::{ReplayError, check_other_work};
use super::group::Group;
use super::machine::{FrameWork, Machine};
use super::outcome::MachineOutcome;
use super::repeats::Repeats;
use super::scheduler::Stage;
use super::summary::summary;
use crate::config::{Order, RunConfig, TmuModel};
use crate::order::parts::Eyes;
use crate::order::{Interleave, Phase};
use crate::result::RunResult;
use crate::stream::{
    Cores, Expander, Frame, FramePlan, LineMemory, StreamError, TileSource, TraceCounts, Walk,
    rendered,
};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A trace and the configurations to replay it with.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The trace.
    pub trace: &'a dyn TileSource,
    /// The configurations.
    pub configs: &'a [RunConfig],
    /// Called with the index of a configuration and its result as soon as that is complete.
    pub finished: &'a (dyn Fn(usize, RunResult) + Sync),
    /// Called after each frame with the index of a configuration, the frame's number, and the result so far.
    pub after_frame: Option<AfterFrame<'a>>,
}

/// A receiver of results of the frames so far.
pub type AfterFrame<'a> = &'a (dyn Fn(usize, u32, RunResult) + Sync);

/// Groups that read the same lines, and what they need.
pub(super) struct Wave<'a> {
    pub(super) job: Job<'a>,
    pub(super) memory: &'a LineMemory,
    /// Reports the stages of a frame: lines loaded, last replay started.
    pub(super) report_stage: &'a (dyn Fn(Stage) + Sync),
}

impl<'a> Wave<'a> {
    /// Runs at least one group. While a frame is replayed, the next one is expanded if there is memory for it.
    pub(super) fn run(&self, mut groups: Vec<Group<'a>>) -> Result<(), ReplayError> {
        let rendered = rendered(self.job.trace, groups[0].config())?;
        let expander = expander_for(Expander::new(&rendered, groups[0].config())?, &groups);
        let seen = (&rendered as &dyn TileSource, &expander);
        if groups.iter().any(Group::loses_lines) {
            check_other_work(expander.lines())?;
        }
        let orders = Orders::of(&groups);
        let mut walk = Walk::new(
            &expander,
            self.memory,
            groups[0].config(),
            orders.0.iter().map(|config| config.order),
        );
        let frames = walk.frames();
        let repeats = Repeats::of(self.job.trace, &frames);
        let mut ahead = None;
        for (index, &number) in frames.iter().enumerate() {
            let is_last = index + 1 == frames.len();
            if repeats.is_repeat(index)
                && let Some(plan) = walk.plan_uncounted(number)
            {
                let plans = orders.plans(&plan);
                let identity = |group: &Group<'_>| {
                    let phases = orders.plan(&plans, group.config());
                    repeats.identity(index, phases)
                };
                let known = |group: &Group<'_>| {
                    let work = group.machine.as_ref().zip(identity(group));
                    work.is_some_and(|(machine, identity)| machine.knows(identity))
                };
                let first = frames[repeats.first(index)];
                if groups.iter().all(known) && walk.repeat(number, first) {
                    (self.report_stage)(Stage::Loaded);
                    if is_last {
                        (self.report_stage)(Stage::LastReplayStarted);
                    }
                    groups.par_iter_mut().try_for_each(|group| {
                        let mut machine = self.machine(group, &expander)?;
                        identity(group)
                            .into_iter()
                            .for_each(|of| machine.repeat(of));
                        self.report(group, Some(number), &*machine, seen, walk.counts());
                        if is_last {
                            self.report(group, None, &*machine, seen, walk.counts());
                        } else {
                            keep(group, machine, index);
                        }
                        Ok::<(), ReplayError>(())
                    })?;
                    if is_last {
                        return Ok(());
                    }
                    continue;
                }
            }
            let frame = match ahead.take() {
                Some(frame) => frame,
                None => expand(&mut walk, number, repeats.recurs(index))?,
            };
            (self.report_stage)(Stage::Loaded);
            let plans = orders.plans(&walk.plan(&frame)?);
            // The next frame is expanded while this one is replayed.
            let so_far = self.job.after_frame.map(|_| walk.counts().clone());
            let waiting = AtomicUsize::new(groups.len());
            let replay = |group: &mut Group<'a>, frame: &Frame<'_>| {
                if waiting.fetch_sub(1, Ordering::Relaxed) == 1 && is_last {
                    (self.report_stage)(Stage::LastReplayStarted);
                }
                let config = *group.config();
                let mut machine = self.machine(group, &expander)?;
                let mut cores = Cores::new(frame, config.cores as usize);
                if let Some(clients) = &mut group.clients {
                    clients.start_frame(number)?;
                    machine.client_accesses(clients);
                }
                let phases = orders.plan(&plans, &config);
                machine.run(FrameWork {
                    cores: &mut cores,
                    phases,
                    assign: config.dispatch(),
                    clients: group.clients.as_mut(),
                    identity: repeats.identity(index, phases),
                })?;
                if let Some(clients) = &mut group.clients {
                    clients.end_frame();
                    machine.client_accesses(clients);
                }
                if let Some(counts) = &so_far {
                    self.report(group, Some(number), &*machine, seen, counts);
                }
                Ok::<_, ReplayError>(machine)
            };
            // The last group to finish frees the frame's memory, even while this thread is busy.
            let frame = Arc::new(frame);
            let share = |group| (group, Arc::clone(&frame));
            let all: Vec<_> = groups.iter_mut().map(share).collect();
            drop(frame);
            // Started in order as threads become free, because the first groups take longest.
            let all = all.into_iter().par_bridge();
            if is_last {
                return all.try_for_each(|(group, frame)| {
                    let machine = replay(group, &frame)?;
                    drop(frame);
                    self.report(group, None, &*machine, seen, walk.counts());
                    Ok(())
                });
            }
            let replay_and_keep = || {
                all.try_for_each(|(group, frame)| {
                    let machine = replay(group, &frame)?;
                    keep(group, machine, index);
                    Ok::<(), ReplayError>(())
                })
            };
            let expand_next = || {
                // A repeated frame may need no lines.
                let expands = self.memory.half_is_left() && !repeats.is_repeat(index + 1);
                let recurs = repeats.recurs(index + 1);
                expands.then(|| expand(&mut walk, frames[index + 1], recurs))
            };
            let (kept, expanded) = rayon::join(replay_and_keep, expand_next);
            kept?;
            ahead = expanded.transpose()?;
        }
        // The trace has no frames.
        for group in &groups {
            self.report(group, None, &*group.build(&expander)?, seen, walk.counts());
        }
        Ok(())
    }

    /// The machine of a group at the start of a frame: the last frame's, or a new one.
    fn machine(
        &self,
        group: &mut Group<'a>,
        expander: &Expander,
    ) -> Result<Box<dyn Machine>, ReplayError> {
        if let Some(machine) = group.machine.take() {
            return Ok(machine);
        }
        group.build_clients(self.job.trace, expander)?;
        group.build(expander)
    }

    /// Passes on the results of a group: those of the frames up to the number `after` if they were asked for, or, without
    /// a number, those of the whole trace.
    fn report(
        &self,
        group: &Group<'_>,
        after: Option<u32>,
        machine: &dyn Machine,
        (rendered, expander): (&dyn TileSource, &Expander<'_>),
        counts: &TraceCounts,
    ) {
        if after.is_some() && self.job.after_frame.is_none() {
            return;
        }
        for &index in &group.points {
            let config = &self.job.configs[index];
            let tables = rendered.tables();
            let result = result(group, config, machine.outcome(config), |counted| {
                summary(tables, expander.bins(), counts, counted, config)
            });
            match after.zip(self.job.after_frame) {
                Some((number, after_frame)) => after_frame(index, number, result),
                None => (self.job.finished)(index, result),
            }
        }
    }
}

/// The result of a configuration from the outcome of its machine; `summary` adds up its cache counts.
fn result(
    group: &Group<'_>,
    config: &RunConfig,
    outcome: MachineOutcome,
    summary: impl FnOnce(&CacheCounts) -> RunResult,
) -> RunResult {
    let mut result = summary(&outcome.counts);
    (result.tmu, result.cycles) = (outcome.tmu, outcome.cycles);
    result.timeline = outcome.timeline;
    result.first_lookups = outcome.first_lookups;
    let l2_misses = result.l2.counters.line_misses;
    result.external_bytes = outcome.memory.external_bytes(l2_misses, config.line_bytes);
    result.memory = outcome.memory;
    if let Some(clients) = &group.clients {
        let (traffic, geometry) = clients.result(result.external_bytes);
        (result.clients, result.geometry) = (traffic, Some(geometry));
    }
    result
}

/// Expands a frame, which may be repeated if it recurs.
fn expand<'e>(walk: &mut Walk<'e>, number: u32, recurs: bool) -> Result<Frame<'e>, StreamError> {
    match recurs {
        true => walk.expand_to_repeat(number),
        false => walk.expand(number),
    }
}

/// Keeps a group's machine after the frame with this index, as the next frame starts with it.
fn keep(group: &mut Group<'_>, mut machine: Box<dyn Machine>, index: usize) {
    machine.between_frames(index + 1, group.config());
    group.machine = Some(machine);
}

/// Configures the expander to list what the groups read.
fn expander_for<'a>(expander: Expander<'a>, groups: &[Group<'_>]) -> Expander<'a> {
    let in_halves =
        |group: &Group<'_>| group.config().order.parts().eyes == Eyes::OneCore(Interleave::Halves);
    let expander = expander.in_halves(groups.iter().any(in_halves));
    let at_once = |group: &Group<'_>| group.config().misses_change_caches_at_once();
    match groups[0].config().tmu_model() {
        None => match groups.iter().map(Group::least_sets).min() {
            Some(Some(sets)) => expander.without_idle_accesses(sets),
            _ => expander,
        },
        Some(TmuModel::FirstMiss | TmuModel::PrefetchFifo) => expander,
        // If a miss fills the cache immediately, the timed machine looks footprints up one by one.
        Some(TmuModel::Looping) if groups.iter().any(at_once) => expander.with_distinct_lines(true),
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

    fn of(groups: &[Group<'_>]) -> Self {
        let mut orders: Vec<RunConfig> = Vec::new();
        for group in groups {
            let key = Self::key(group.config());
            if !orders.iter().any(|other| Self::key(other) == key) {
                orders.push(*group.config());
            }
        }
        Self(orders)
    }

    /// The plan of each order for a frame.
    fn plans(&self, plan: &FramePlan<'_>) -> Vec<Vec<Phase>> {
        let phases = |config: &RunConfig| plan.phases(config);
        self.0.par_iter().map(phases).collect()
    }

    fn plan<'p>(&self, plans: &'p [Vec<Phase>], config: &RunConfig) -> &'p [Phase] {
        let key = Self::key(config);
        let index = self.0.iter().position(|other| Self::key(other) == key);
        index.map_or(&[], |index| &plans[index])
    }
}
