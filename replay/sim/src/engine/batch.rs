//! Replays many configurations of a trace and shares work between them.
//!
//! Configurations with the same sampling, layout and mode form a *stream*: each frame is expanded to lines
//! once for all of them. In a stream, LRU caches without latencies that use the same order form a *group*,
//! which is simulated in a single pass (`OnePass`). Every other configuration (another policy, timed) is a group
//! of its own.

use super::error::ReplayError;
use super::group::{Group, grouped, groups, stream_key};
use super::scheduler::{Stage, run_within_memory};
use super::wave::{Job, Wave};
use crate::access;
use crate::config::RunConfig;
use crate::result::RunResult;
use crate::stream::{Expander, LineMemory, TileSource};
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// Groups whose machines are kept from frame to frame. A stream with more groups is expanded again for the others.
const WAVE: usize = 256;

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
        formats::add_fields!(self, other, replays, passes, expansions);
    }

    /// Describes for the user what was shared and skipped among `points` points.
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

/// Replays `trace` with `config`.
///
/// # Errors
/// An impossible configuration, or an unreadable trace.
pub fn replay(trace: &dyn TileSource, config: &RunConfig) -> Result<RunResult, ReplayError> {
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let answer = Mutex::new(RunResult::default());
    let keep = |_, result| {
        if let Ok(mut answer) = answer.lock() {
            *answer = result;
        }
    };
    replay_all(trace, &[*config], &memory, &keep).map_err(|(_, error)| error)?;
    Ok(answer.into_inner().unwrap_or_default())
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
        after_frame: None,
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
