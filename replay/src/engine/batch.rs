//! Many configurations of one trace: who shares what.
//!
//! Configurations of one sampling, layout and mode are a *stream*: frame by frame its lines are expanded
//! once and read by all. Of those, LRU caches without latencies that see the same order share a
//! *pass* ([`OnePass`]); every other configuration (another policy, timed) is a pass of its own.

use super::counts::CacheCounts;
use super::first_miss::FirstMiss;
use super::functional::Functional;
use super::one_pass::{LevelGeometry, OnePass, geometry};
use super::summary::summary;
use super::timed::Timed;
use super::{Machine, ReplayError};
use crate::cache::Levels;
use crate::config::{BetweenFrames, CacheConfig, Mode, Order, RunConfig, TmuConfig};
use crate::order::{self, Phase};
use crate::result::{RunResult, TmuResult};
use crate::stream::{Cores, Expander, LineMemory, TileSource, TraceCounts, shaded};
use rayon::prelude::*;
use std::collections::HashMap;

/// Passes whose machines are kept from frame to frame; beyond them a stream is expanded again.
const WAVE: usize = 256;

/// Configurations that share a pass at most: their counters are large, and several passes keep several cores busy.
/// It does not depend on the number of cores, so that shards of a sweep agree.
const MOST_TOGETHER: usize = 256;

/// What a batch of replays shared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Configurations replayed.
    pub replays: usize,
    /// Passes over the lines of an order that answered them.
    pub passes: usize,
    /// Times that a whole trace was expanded to lines.
    pub expansions: usize,
}

impl Work {
    /// Adds another batch's.
    pub fn add(&mut self, other: &Self) {
        self.replays += other.replays;
        self.passes += other.passes;
        self.expansions += other.expansions;
    }

    /// What was shared and skipped of so many points, for whoever waited for them.
    #[must_use]
    pub fn told(&self, points: usize) -> String {
        let Self {
            replays,
            passes,
            expansions,
        } = self;
        let mut text = format!(
            "{points} points: {replays} replayed in {passes} passes over {expansions} expanded traces"
        );
        if let skipped @ 1.. = points.saturating_sub(*replays) {
            text += &format!(", {skipped} known or equal to one of these");
        }
        text
    }
}

/// What a machine yields for one configuration.
pub struct Outcome {
    /// What missed.
    pub counts: CacheCounts,
    /// Texture units together; none in functional mode.
    pub tmu: Option<TmuResult>,
    /// Cycles until the last core was done; none in functional mode.
    pub cycles: Option<u64>,
}

impl From<CacheCounts> for Outcome {
    fn from(counts: CacheCounts) -> Self {
        Self {
            counts,
            tmu: None,
            cycles: None,
        }
    }
}

/// Replays `trace` under every configuration, in parallel; `finished` is told each result, by the
/// index of its configuration, as soon as it is there.
///
/// # Errors
/// An impossible configuration or a trace that cannot be read, with the index of the first
/// configuration that it concerns.
pub fn replay_all(
    trace: &dyn TileSource,
    configs: &[RunConfig],
    memory: &LineMemory,
    finished: &(dyn Fn(usize, RunResult) + Sync),
) -> Result<Work, (usize, ReplayError)> {
    for (index, config) in configs.iter().enumerate() {
        config.validate().map_err(|error| (index, error.into()))?;
    }
    let streams = grouped(0..configs.len(), |&index| stream_key(&configs[index]));
    let waves: Vec<Vec<Pass>> = streams
        .into_iter()
        .flat_map(|stream| {
            let mut passes = passes(configs, stream);
            let mut waves = Vec::new();
            while !passes.is_empty() {
                let rest = passes.split_off(passes.len().min(WAVE));
                waves.push(std::mem::replace(&mut passes, rest));
            }
            waves
        })
        .collect();
    let work = Work {
        replays: configs.len(),
        passes: waves.iter().map(Vec::len).sum(),
        expansions: waves.len(),
    };
    let run = |wave: Vec<Pass>| {
        let first = wave[0].points[0];
        let done = Wave {
            trace,
            configs,
            memory,
            finished,
        };
        done.run(wave).map_err(|error| (first, error))
    };
    let outcomes: Vec<_> = waves.into_par_iter().map(run).collect();
    outcomes.into_iter().collect::<Result<(), _>>()?;
    Ok(work)
}

/// Who shares what: by stream, the passes that its configurations, by index, are answered in.
#[must_use]
pub fn sharing(configs: &[RunConfig]) -> Vec<Vec<Vec<usize>>> {
    let streams = grouped(0..configs.len(), |&index| stream_key(&configs[index]));
    let points = |stream| passes(configs, stream).into_iter().map(|pass| pass.points);
    streams
        .into_iter()
        .map(|stream| points(stream).collect())
        .collect()
}

/// Groups of equal keys, each in the order of its first member.
fn grouped(
    indexes: impl IntoIterator<Item = usize>,
    key: impl Fn(&usize) -> RunConfig,
) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for index in indexes {
        let key = serde_json::to_string(&key(&index)).unwrap_or_default();
        let group = *known.entry(key).or_insert(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
        }
        groups[group].push(index);
    }
    groups
}

/// The configuration without what the lines that are listed do not depend on.
fn stream_key(config: &RunConfig) -> RunConfig {
    let usual = RunConfig::default();
    RunConfig {
        order: usual.order,
        seed: usual.seed,
        cores: usual.cores,
        assign: usual.assign,
        between_frames: usual.between_frames,
        ..pass_key(config)
    }
}

/// The configuration without what LRU caches that share a pass may differ in.
fn pass_key(config: &RunConfig) -> RunConfig {
    const ANY: CacheConfig = CacheConfig::lru(0);
    RunConfig {
        l1: ANY,
        l2: ANY,
        tmu: TmuConfig::default(),
        tile_maps: false,
        ..*config
    }
}

/// Configurations, by index, that one machine answers together.
struct Pass<'a> {
    points: Vec<usize>,
    configs: &'a [RunConfig],
    /// Built when it first runs.
    machine: Option<Box<dyn Machine>>,
}

/// The passes of a stream's configurations.
fn passes(configs: &[RunConfig], stream: Vec<usize>) -> Vec<Pass<'_>> {
    let shared = |index: &usize| {
        let config = &configs[*index];
        config.mode == Mode::Functional && geometry(config).is_some()
    };
    let (together, alone): (Vec<usize>, Vec<usize>) = stream.into_iter().partition(shared);
    let mut groups: Vec<Vec<usize>> = alone.into_iter().map(|index| vec![index]).collect();
    for mut group in grouped(together, |&index| pass_key(&configs[index])) {
        // Neighbours share most.
        group.sort_by_key(|&index| geometry(&configs[index]));
        groups.extend(group.chunks(MOST_TOGETHER).map(<[usize]>::to_vec));
    }
    groups.sort_by_key(|points| points.iter().copied().min());
    let pass = |points| Pass {
        points,
        configs,
        machine: None,
    };
    groups.into_iter().map(pass).collect()
}

impl Pass<'_> {
    /// What all its configurations agree on.
    fn config(&self) -> &RunConfig {
        &self.configs[self.points[0]]
    }

    fn geometries(&self) -> Option<Vec<LevelGeometry>> {
        let of = |&index: &usize| geometry(&self.configs[index]);
        self.points.iter().map(of).collect()
    }

    /// The fewest sets of an L1, if all are LRU caches in which a footprint's lines cannot crowd each other
    /// out: its repeats find all of them then.
    fn least_sets(&self) -> Option<u32> {
        let l1 = self.geometries()?.into_iter().map(|(l1, _)| l1);
        let sets = l1.map(|(sets, ways)| (ways >= 4).then_some(sets));
        sets.min().flatten()
    }

    fn build(&self, expander: &Expander<'_>) -> Result<Box<dyn Machine>, ReplayError> {
        let config = self.config();
        let bins = expander.bins();
        let counts = || CacheCounts::new(bins, config.tile_maps);
        let geometries = self
            .geometries()
            .filter(|_| config.mode == Mode::Functional);
        if let Some(geometries) = geometries {
            let maps = self.points.iter().any(|&p| self.configs[p].tile_maps);
            return Ok(Box::new(OnePass::new(
                bins,
                config.cores,
                maps,
                &geometries,
            )));
        }
        let levels = Levels::build(config)?;
        Ok(match (config.mode, levels.all_four_way()) {
            (Mode::Timed, Ok(levels)) => Box::new(Timed::new(levels, config.tmu, counts())),
            (Mode::Timed, Err(levels)) => Box::new(Timed::new(levels, config.tmu, counts())),
            (Mode::FirstMiss, Ok(levels)) => Box::new(FirstMiss::new(levels, config.tmu, counts())),
            (Mode::FirstMiss, Err(levels)) => {
                Box::new(FirstMiss::new(levels, config.tmu, counts()))
            }
            (Mode::Functional, Ok(levels)) => Box::new(Functional::new(levels, counts())),
            (Mode::Functional, Err(levels)) => Box::new(Functional::new(levels, counts())),
        })
    }
}

/// What the passes of a wave need.
struct Wave<'a> {
    trace: &'a dyn TileSource,
    configs: &'a [RunConfig],
    memory: &'a LineMemory,
    finished: &'a (dyn Fn(usize, RunResult) + Sync),
}

impl Wave<'_> {
    /// Runs the passes, frame after frame.
    fn run(&self, mut passes: Vec<Pass<'_>>) -> Result<(), ReplayError> {
        let trace_passes = &self.trace.tables().passes;
        let shaded = shaded(self.trace, passes[0].config().hsr)?;
        let expander = Expander::new(&shaded, passes[0].config())?;
        let instant = |pass: &Pass<'_>| pass.config().tmu.l1_penalty_cycles == 0;
        let expander = match passes[0].config().mode {
            Mode::Functional => match passes.iter().map(Pass::least_sets).min() {
                Some(Some(sets)) => expander.without_idle_accesses(sets),
                _ => expander,
            },
            Mode::FirstMiss => expander,
            // Where a miss fills at once, the timed machine looks footprints up one by one.
            Mode::Timed if passes.iter().any(instant) => expander.with_distinct_lines(true),
            Mode::Timed => expander.only_distinct_lines(),
        };
        let mut counts = TraceCounts::new(expander.bins());
        let mut frames: Vec<u32> = trace_passes.iter().map(|pass| pass.frame).collect();
        frames.sort_unstable();
        frames.dedup();
        let mut orders: Vec<(Order, u64)> = Vec::new();
        for pass in &passes {
            let order = (pass.config().order, pass.config().seed);
            if !orders.contains(&order) {
                orders.push(order);
            }
        }
        for &number in &frames {
            let frame = expander.frame(number, self.memory, &mut counts)?;
            let plan = |&(order, seed): &(Order, u64)| -> Vec<Phase> {
                order::plan_frame(&*order.build(seed), trace_passes, number)
            };
            let plans: Vec<Vec<Phase>> = orders.par_iter().map(plan).collect();
            let last = frames.last() == Some(&number);
            passes.par_iter_mut().with_max_len(1).try_for_each(|pass| {
                let config = *pass.config();
                let order = (config.order, config.seed);
                let phases = orders.iter().position(|o| *o == order).map(|i| &plans[i]);
                let mut machine = match pass.machine.take() {
                    Some(mut machine) => {
                        if config.between_frames == BetweenFrames::Flush {
                            machine.flush();
                        }
                        machine
                    }
                    None => pass.build(&expander)?,
                };
                let mut cores = Cores::new(&frame, config.cores as usize);
                machine.run(&mut cores, phases.map_or(&[], |p| &**p), config.assign)?;
                if last {
                    self.finish(pass, &*machine, &expander, &counts);
                } else {
                    pass.machine = Some(machine);
                }
                Ok::<(), ReplayError>(())
            })?;
        }
        if frames.is_empty() {
            for pass in &passes {
                self.finish(pass, &*pass.build(&expander)?, &expander, &counts);
            }
        }
        Ok(())
    }

    fn finish(
        &self,
        pass: &Pass<'_>,
        machine: &dyn Machine,
        expander: &Expander<'_>,
        counts: &TraceCounts,
    ) {
        let tables = self.trace.tables();
        for &index in &pass.points {
            let config = &self.configs[index];
            let outcome = machine.outcome(config);
            let (tmu, cycles) = (outcome.tmu, outcome.cycles);
            let result = RunResult {
                tmu,
                cycles,
                first_lookups: machine.first_lookups(),
                ..summary(tables, expander.bins(), counts, &outcome.counts, config)
            };
            (self.finished)(index, result);
        }
    }
}
