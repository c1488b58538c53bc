//! Many configurations of one trace: who shares what.
//!
//! Configurations of one sampling, layout and mode are a *stream*: frame by frame its lines are expanded
//! once and read by all. Of those, LRU caches without latencies that see the same order share a
//! *pass* ([`OnePass`]); every other configuration (another policy, timed) is a pass of its own.

use super::counts::CacheCounts;
use super::first_miss::FirstMiss;
use super::functional::Functional;
use super::one_pass::{LevelGeometry, OnePass, geometry};
use super::prefetch_fifo::PrefetchFifo;
use super::scheduler::{Stage, run_within_memory};
use super::timed::Timed;
use super::wave::Wave;
use super::{Machine, ReplayError};
use crate::cache::{Delay, Levels, MissPath, MissPathResult};
use crate::config::{Allocation, CacheConfig, Mode, RunConfig, TmuConfig};
use crate::result::{RunResult, Timeline, TmuResult};
use crate::stream::{Expander, LineMemory, TileSource};
use crate::tmu::PipelineStats;
use crate::whole_frame;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

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

    /// What was shared and skipped of so many points, as a line for the user.
    #[must_use]
    pub fn summary(&self, points: usize) -> String {
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
    /// What was counted beside and below the L2.
    pub path: MissPathResult,
    /// The replay over time, where it was recorded.
    pub timeline: Option<Timeline>,
}

impl Outcome {
    /// What texture units and caches counted.
    pub(super) fn timed(
        counts: CacheCounts,
        units: impl Iterator<Item = PipelineStats>,
        cycles: u64,
    ) -> Self {
        let mut sum = PipelineStats::default();
        units.for_each(|unit| sum.add(&unit));
        Self {
            counts,
            tmu: Some(TmuResult {
                utilization: sum.utilization(),
                wasted_issues: sum.wasted,
                threads: sum.threads,
                loops: sum.loops,
            }),
            cycles: Some(cycles),
            path: MissPathResult::default(),
            timeline: None,
        }
    }
}

impl From<CacheCounts> for Outcome {
    fn from(counts: CacheCounts) -> Self {
        Self {
            counts,
            tmu: None,
            cycles: None,
            path: MissPathResult::default(),
            timeline: None,
        }
    }
}

/// Configurations to replay a trace under.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The trace.
    pub trace: &'a dyn TileSource,
    /// The configurations.
    pub configs: &'a [RunConfig],
    /// Called with each result and the index of its configuration, as soon as it is complete.
    pub finished: &'a (dyn Fn(usize, RunResult) + Sync),
}

/// Replays `trace` under every configuration, as one job.
///
/// # Errors
/// As [`replay_jobs`].
pub fn replay_all(
    trace: &dyn TileSource,
    configs: &[RunConfig],
    memory: &LineMemory,
    finished: &(dyn Fn(usize, RunResult) + Sync),
) -> Result<Work, (usize, ReplayError)> {
    let job = Job {
        trace,
        configs,
        finished,
    };
    let answers = replay_jobs(&[job], memory);
    answers
        .into_iter()
        .next()
        .unwrap_or_else(|| Ok(Work::default()))
}

/// Replays all jobs, in parallel: what each shared.
///
/// # Errors
/// Of each job: an impossible configuration or a trace that cannot be read, with the index of the first
/// configuration that it concerns.
pub fn replay_jobs(
    jobs: &[Job<'_>],
    memory: &LineMemory,
) -> Vec<Result<Work, (usize, ReplayError)>> {
    let mut answers: Vec<Result<Work, _>> = jobs.iter().map(checked).collect();
    let mut waves = Vec::new();
    for (job, answer) in (0..).zip(&mut answers) {
        let Ok(work) = answer else {
            continue;
        };
        let tiles = tiles_of_a_frame(jobs[job].trace);
        for wave in of_job(&jobs[job]) {
            work.passes += wave.len();
            work.expansions += 1;
            waves.push((tiles, (waves.len(), job, wave)));
        }
    }
    if jobs.len() > 1 {
        // The smallest last, so that all threads are done at nearly the same time.
        let records: Vec<u64> = jobs.iter().map(|job| job.trace.records()).collect();
        waves.sort_by_key(|(_, (_, job, _))| std::cmp::Reverse(records[*job]));
    }
    // A stream's tiles are expanded by all threads: what has fewer leaves some of them idle.
    let enough = Expander::CHUNK * rayon::current_num_threads();
    let failed = Mutex::new(Vec::new());
    let run = |(index, job, passes): (usize, usize, Vec<Pass<'_>>),
               report_stage: &(dyn Fn(Stage) + Sync)| {
        let first = passes[0].points[0];
        let wave = Wave {
            job: jobs[job],
            memory,
            report_stage,
        };
        if let Err(error) = wave.run(passes) {
            let mut failed = failed.lock().unwrap_or_else(PoisonError::into_inner);
            failed.push((index, job, first, error));
        }
    };
    run_within_memory(waves, enough, || memory.half_is_left(), run);
    let mut failed = failed.into_inner().unwrap_or_else(PoisonError::into_inner);
    // Each job reports its first failure.
    failed.sort_by_key(|(index, ..)| std::cmp::Reverse(*index));
    for (_, job, first, error) in failed {
        answers[job] = Err((first, error));
    }
    answers
}

/// What is shared of a job so far: nothing.
fn checked(job: &Job<'_>) -> Result<Work, (usize, ReplayError)> {
    for (index, config) in job.configs.iter().enumerate() {
        config.validate().map_err(|error| (index, error.into()))?;
        if config.frame.is_some() && job.trace.geometry().is_none() {
            return Err((index, whole_frame::missing().into()));
        }
    }
    Ok(Work {
        replays: job.configs.len(),
        ..Work::default()
    })
}

/// The passes of a job, those of a wave together.
fn of_job<'a>(job: &Job<'a>) -> Vec<Vec<Pass<'a>>> {
    let configs = job.configs;
    let streams = grouped(0..configs.len(), |&index| stream_key(&configs[index]));
    let waves = |stream| {
        let mut passes = passes(configs, stream);
        let mut waves = Vec::new();
        while !passes.is_empty() {
            let rest = passes.split_off(passes.len().min(WAVE));
            waves.push(std::mem::replace(&mut passes, rest));
        }
        waves
    };
    streams.into_iter().flat_map(waves).collect()
}

/// Tiles of the largest frame.
fn tiles_of_a_frame(trace: &dyn TileSource) -> usize {
    let mut tiles: HashMap<u32, usize> = HashMap::new();
    for pass in &trace.tables().passes {
        *tiles.entry(pass.frame).or_default() += pass.tile_count() as usize;
    }
    tiles.into_values().max().unwrap_or(0)
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
        prefetch: None,
        level: usual.level,
        dram: None,
        ..pass_key(config)
    }
}

/// The configuration without what LRU caches that share a pass may differ in.
fn pass_key(config: &RunConfig) -> RunConfig {
    const ANY: CacheConfig = CacheConfig::lru(0);
    RunConfig {
        // Where the L2's size decides the order, its number stands in the name.
        order: config.order.resolved(config.l2.size_bytes),
        l1: ANY,
        // Caches of several associativities share stacks, which other work that fills part of each would fill differently.
        l2: CacheConfig {
            ways: match config.between_frames.lost_percent() {
                Some(_) => config.l2.ways,
                None => ANY.ways,
            },
            ..ANY
        },
        tmu: TmuConfig::default(),
        tile_maps: false,
        frame: None,
        ..*config
    }
}

/// Configurations, by index, that one machine answers together.
pub(super) struct Pass<'a> {
    pub(super) points: Vec<usize>,
    configs: &'a [RunConfig],
    /// Built when it first runs.
    pub(super) machine: Option<Box<dyn Machine>>,
}

/// The passes of a stream's configurations.
fn passes(configs: &[RunConfig], stream: Vec<usize>) -> Vec<Pass<'_>> {
    let shared = |index: &usize| {
        let config = &configs[*index];
        shares_passes(config) && geometry(config).is_some()
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
    pub(super) fn config(&self) -> &RunConfig {
        &self.configs[self.points[0]]
    }

    fn geometries(&self) -> Option<Vec<LevelGeometry>> {
        let of = |&index: &usize| geometry(&self.configs[index]);
        self.points.iter().map(of).collect()
    }

    /// The fewest sets of an L1, if all are LRU caches in which a footprint's lines cannot crowd each other
    /// out, and in which no other level invalidates them: its repeats find all of them then.
    pub(super) fn least_sets(&self) -> Option<u32> {
        if self.config().levels_depend_on_evictions() {
            return None;
        }
        let l1 = self.geometries()?.into_iter().map(|(l1, _)| l1);
        let sets = l1.map(|(sets, ways)| (ways >= 4).then_some(sets));
        sets.min().flatten()
    }

    pub(super) fn build(&self, expander: &Expander<'_>) -> Result<Box<dyn Machine>, ReplayError> {
        let config = self.config();
        let bins = expander.bins();
        let counts = || CacheCounts::new(bins, config.tile_maps);
        let geometries = self.geometries().filter(|_| shares_passes(config));
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
        let path = MissPath::build(config)?;
        if config.mode == Mode::Functional {
            return Ok(match levels.all_four_way() {
                Ok(levels) => Box::new(Functional::new(levels, counts(), path)),
                Err(levels) => Box::new(Functional::new(levels, counts(), path)),
            });
        }
        if config.tmu.allocation == Allocation::OnMiss || config.mode == Mode::PrefetchFifo {
            return Ok(with_latencies(
                config,
                levels.allocate_on_miss(),
                counts(),
                path,
            ));
        }
        Ok(match levels.all_four_way() {
            Ok(levels) => with_latencies(config, levels, counts(), path),
            Err(levels) => with_latencies(config, levels, counts(), path),
        })
    }
}

/// A shared pass does not see the misses of one L2 in their order.
fn shares_passes(config: &RunConfig) -> bool {
    matches!(config.mode, Mode::Functional) && !config.follows_l2_misses()
}

/// The machine of a configuration where time passes.
fn with_latencies<C: Delay>(
    config: &RunConfig,
    levels: Levels<C>,
    counts: CacheCounts,
    path: MissPath,
) -> Box<dyn Machine>
where
    C::Delayed: 'static,
{
    match config.mode {
        Mode::FirstMiss => Box::new(FirstMiss::new(levels, config.tmu, counts, path)),
        Mode::PrefetchFifo => Box::new(PrefetchFifo::new(levels, config.tmu, counts, path)),
        _ => Box::new(Timed::new(levels, config.tmu, counts, path).with_timeline(config.timeline)),
    }
}
