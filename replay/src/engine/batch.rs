//! Replays many configurations of a trace and shares work between them.
//!
//! Configurations with the same sampling, layout and mode form a *stream*: each frame is expanded to lines
//! once for all of them. In a stream, LRU caches without latencies that use the same order form a *group*,
//! which is simulated in a single pass ([`OnePass`]). Every other configuration (another policy, timed) is
//! a group of its own.

use super::counts::CacheCounts;
use super::fast::one_pass::{LevelGeometry, OnePass, geometry};
use super::functional::Functional;
use super::scheduler::{Stage, run_within_memory};
use super::wave::Wave;
use super::{AtOnce, Machine, ReplayError, threads};
use crate::access::{self, FrameClients};
use crate::config::{ConfigError, Mode, RunConfig, TmuConfig};
use crate::memory::{Caches, Hierarchy, MissPath};
use crate::result::{FirstLookups, MemoryResult, RunResult, Timeline, TmuResult};
use crate::stream::{Bins, Expander, LineMemory, TileSource};
use crate::tmu::PipelineStats;
use formats::layout::Layout;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Groups whose machines are kept from frame to frame. A stream with more groups is expanded again for the others.
const WAVE: usize = 256;

/// Configurations per group at most. Their counters are large, and several groups use several cores. It
/// does not depend on the number of cores, so that all shards of a sweep form the same groups.
const MOST_TOGETHER: usize = 256;

/// How much work a batch of replays shared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Configurations replayed.
    pub replays: usize,
    /// Groups, each simulated in one pass over the lines.
    pub passes: usize,
    /// How often a whole trace was expanded to lines.
    pub expansions: usize,
}

impl Work {
    /// Adds the counts of another batch.
    pub fn add(&mut self, other: &Self) {
        self.replays += other.replays;
        self.passes += other.passes;
        self.expansions += other.expansions;
    }

    /// Describes for the user what was shared and skipped among `points` points.
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

/// The counts of a machine for one configuration.
pub struct Outcome {
    /// Cache misses.
    pub counts: CacheCounts,
    /// Sum over texture units; none in functional mode.
    pub tmu: Option<TmuResult>,
    /// Cycles until the last core finished; none in functional mode.
    pub cycles: Option<u64>,
    /// First look-ups, for the model in which threads stop at their first miss.
    pub first_lookups: Option<FirstLookups>,
    /// Counts beside and below the L2.
    pub memory: MemoryResult,
    /// The replay over time, if recorded.
    pub timeline: Option<Timeline>,
}

impl Outcome {
    /// Combines the counts of texture units and caches.
    pub(super) fn timed(
        counts: CacheCounts,
        units: impl Iterator<Item = PipelineStats>,
        cycles: u64,
    ) -> Self {
        let mut sum = PipelineStats::default();
        units.for_each(|unit| sum.add(&unit));
        Self {
            first_lookups: None,
            counts,
            tmu: Some(TmuResult {
                utilization: sum.utilization(),
                wasted_issues: sum.wasted,
                threads: sum.threads,
                loops: sum.loops,
            }),
            cycles: Some(cycles),
            memory: MemoryResult::default(),
            timeline: None,
        }
    }
}

impl From<CacheCounts> for Outcome {
    fn from(counts: CacheCounts) -> Self {
        Self {
            first_lookups: None,
            counts,
            tmu: None,
            cycles: None,
            memory: MemoryResult::default(),
            timeline: None,
        }
    }
}

/// A trace and the configurations to replay it with.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The trace.
    pub trace: &'a dyn TileSource,
    /// The configurations.
    pub configs: &'a [RunConfig],
    /// Called with the index of a configuration and its result as soon as that is complete.
    pub finished: &'a (dyn Fn(usize, RunResult) + Sync),
}

/// Replays `trace` with every configuration.
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

/// Replays all jobs in parallel, and returns the work that each shared.
///
/// # Errors
/// Per job, an impossible configuration or an unreadable trace, with the index of the first configuration affected.
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
        // Smallest last, so that all threads finish at nearly the same time.
        let records: Vec<u64> = jobs.iter().map(|job| job.trace.records()).collect();
        waves.sort_by_key(|(_, (_, job, _))| std::cmp::Reverse(records[*job]));
    }
    // All threads expand the tiles of a stream. A stream with fewer tiles leaves some threads idle.
    let enough = Expander::CHUNK * rayon::current_num_threads();
    let failed = Mutex::new(Vec::new());
    let run = |(index, job, groups): (usize, usize, Vec<Group<'_>>),
               report_stage: &(dyn Fn(Stage) + Sync)| {
        let first = groups[0].points[0];
        let wave = Wave {
            job: jobs[job],
            memory,
            report_stage,
        };
        if let Err(error) = wave.run(groups) {
            let mut failed = failed.lock().unwrap_or_else(PoisonError::into_inner);
            failed.push((index, job, first, error));
        }
    };
    run_within_memory(waves, enough, || memory.half_is_left(), run);
    let mut failed = failed.into_inner().unwrap_or_else(PoisonError::into_inner);
    // Each job reports its first error.
    failed.sort_by_key(|(index, ..)| std::cmp::Reverse(*index));
    for (_, job, first, error) in failed {
        answers[job] = Err((first, error));
    }
    answers
}

/// Checks the configurations of a job.
fn checked(job: &Job<'_>) -> Result<Work, (usize, ReplayError)> {
    for (index, config) in job.configs.iter().enumerate() {
        config.validate().map_err(|error| (index, error.into()))?;
        if config.frame.is_some() && job.trace.geometry().is_none() {
            return Err((index, access::missing().into()));
        }
    }
    Ok(Work {
        replays: job.configs.len(),
        ..Work::default()
    })
}

/// The groups of a job, by wave.
fn of_job<'a>(job: &Job<'a>) -> Vec<Vec<Group<'a>>> {
    let configs = job.configs;
    let streams = grouped(0..configs.len(), |&index| stream_key(&configs[index]));
    let waves = |stream| {
        let mut groups = groups(configs, stream);
        let mut waves = Vec::new();
        while !groups.is_empty() {
            let rest = groups.split_off(groups.len().min(WAVE));
            waves.push(std::mem::replace(&mut groups, rest));
        }
        waves
    };
    streams.into_iter().flat_map(waves).collect()
}

/// Number of tiles in the largest frame.
fn tiles_of_a_frame(trace: &dyn TileSource) -> usize {
    let mut tiles: HashMap<u32, usize> = HashMap::new();
    for pass in &trace.tables().passes {
        *tiles.entry(pass.frame).or_default() += pass.tile_count() as usize;
    }
    tiles.into_values().max().unwrap_or(0)
}

/// The groups, by stream. A group lists indices of configurations.
#[must_use]
pub fn sharing(configs: &[RunConfig]) -> Vec<Vec<Vec<usize>>> {
    let streams = grouped(0..configs.len(), |&index| stream_key(&configs[index]));
    let points = |stream| {
        groups(configs, stream)
            .into_iter()
            .map(|group| group.points)
    };
    streams
        .into_iter()
        .map(|stream| points(stream).collect())
        .collect()
}

/// Groups the indices by equal keys, in order of first member.
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

/// The configuration reduced to the settings that determine the stream.
fn stream_key(config: &RunConfig) -> RunConfig {
    let usual = RunConfig::default();
    let model = config.tmu_model().unwrap_or_default();
    RunConfig {
        order: usual.order,
        level: usual.level,
        seed: usual.seed,
        cores: usual.cores,
        assign: usual.assign,
        between_frames: usual.between_frames,
        prefetch: None,
        dram: None,
        tmu: TmuConfig { model, ..usual.tmu },
        ..group_key(config)
    }
}

/// The configuration reduced to the settings that must agree within a group.
fn group_key(config: &RunConfig) -> RunConfig {
    let usual = RunConfig::default();
    let mut level = usual.level;
    if config.between_frames.lost_percent().is_some() {
        // Caches of several associativities share stacks, which other work would fill differently.
        level.l2.ways = config.level.l2.ways;
    }
    RunConfig {
        // If the order depends on the L2's size, the resolved name contains that size.
        order: config.order.resolved(config.level.l2.size_bytes),
        level,
        memory_cycles: usual.memory_cycles,
        tmu: usual.tmu,
        tile_maps: false,
        frame: None,
        ..*config
    }
}

/// A group of configurations that one machine simulates.
pub(super) struct Group<'a> {
    pub(super) points: Vec<usize>,
    configs: &'a [RunConfig],
    /// Built on first use.
    pub(super) machine: Option<Box<dyn Machine>>,
    /// The other clients of memory, if a configuration has a `[frame]` table.
    pub(super) clients: Option<FrameClients<'a>>,
}

/// Divides the configurations of a stream into groups.
pub(super) fn groups(configs: &[RunConfig], stream: Vec<usize>) -> Vec<Group<'_>> {
    let shared = |index: &usize| {
        let config = &configs[*index];
        shares_passes(config) && geometry(config).is_some()
    };
    let (together, alone): (Vec<usize>, Vec<usize>) = stream.into_iter().partition(shared);
    let mut members: Vec<Vec<usize>> = alone.into_iter().map(|index| vec![index]).collect();
    for mut group in grouped(together, |&index| group_key(&configs[index])) {
        // Similar geometries share most work.
        group.sort_by_key(|&index| geometry(&configs[index]));
        members.extend(group.chunks(MOST_TOGETHER).map(<[usize]>::to_vec));
    }
    members.sort_by_key(|points| points.iter().copied().min());
    let group = |points| Group {
        points,
        configs,
        machine: None,
        clients: None,
    };
    members.into_iter().map(group).collect()
}

impl<'a> Group<'a> {
    /// The settings that all configurations of the group share.
    pub(super) fn config(&self) -> &RunConfig {
        &self.configs[self.points[0]]
    }

    fn geometries(&self) -> Option<Vec<LevelGeometry>> {
        let of = |&index: &usize| geometry(&self.configs[index]);
        self.points.iter().map(of).collect()
    }

    /// The fewest sets of any L1, if repeated footprints always hit: all caches are LRU, the lines of a
    /// footprint cannot evict each other, and no other level invalidates them.
    pub(super) fn least_sets(&self) -> Option<u32> {
        if self.config().level.depend_on_evictions() {
            return None;
        }
        let l1 = self.geometries()?.into_iter().map(|(l1, _)| l1);
        let sets = l1.map(|(sets, ways)| (ways >= 4).then_some(sets));
        sets.min().flatten()
    }

    /// The clients other than the texture units.
    pub(super) fn build_clients(
        &mut self,
        source: &'a dyn TileSource,
        expander: &Expander<'_>,
    ) -> Result<(), ReplayError> {
        let config = *self.config();
        if let Some(machine) = config.frame {
            let texture_bytes = expander.lines() * u64::from(config.line_bytes);
            let clients = FrameClients::new(source, &config, machine, texture_bytes)?;
            self.clients = Some(clients);
        }
        Ok(())
    }

    pub(super) fn build(&self, expander: &Expander<'_>) -> Result<Box<dyn Machine>, ReplayError> {
        let config = self.config();
        let layout = config.prefetch.and_then(|_| expander.layout(config));
        let layout = layout.as_ref();
        if config.mode == Mode::Timed {
            let counts = CacheCounts::new(expander.bins(), config.tile_maps);
            return Ok(threads::machine(config, counts, layout)?);
        }
        Ok(self.build_at_once(expander.bins(), layout)?)
    }

    /// The machine of configurations whose caches fill immediately.
    pub(super) fn build_at_once(
        &self,
        bins: &Bins,
        layout: Option<&Arc<Layout>>,
    ) -> Result<Box<dyn AtOnce>, ConfigError> {
        let config = self.config();
        if shares_passes(config)
            && let Some(geometries) = self.geometries()
        {
            let maps = self.points.iter().any(|&p| self.configs[p].tile_maps);
            let one_pass = OnePass::new(bins, config.cores, maps, &geometries);
            return Ok(Box::new(one_pass));
        }
        self.build_alone(bins, layout)
    }

    /// The machine of a configuration that is a group of its own.
    pub(super) fn build_alone(
        &self,
        bins: &Bins,
        layout: Option<&Arc<Layout>>,
    ) -> Result<Box<dyn AtOnce>, ConfigError> {
        let config = self.config();
        let counts = CacheCounts::new(bins, config.tile_maps);
        let path = MissPath::build(config, layout)?;
        Ok(match Caches::build(config)?.all_four_way() {
            Ok(caches) => Box::new(Functional::new(Hierarchy::new(caches, path), counts)),
            Err(caches) => Box::new(Functional::new(Hierarchy::new(caches, path), counts)),
        })
    }
}

/// A single pass does not produce the misses of one L2 in order.
fn shares_passes(config: &RunConfig) -> bool {
    config.mode == Mode::Functional && !config.follows_l2_misses() && config.frame.is_none()
}
