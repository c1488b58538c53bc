//! Replays the points of a plan on every trace.

use super::store::Absent;
use super::{Outcome, Plan, Point, Store, Subject};
use rayon::prelude::*;
use sim::config::RunConfig;
use sim::engine::{Job, ReplayError, Work, grouped, replay_jobs};
use sim::model_version::MODEL_VERSION;
use sim::result::RunResult;
use sim::stream::LineMemory;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A point that failed.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The replay failed.
    #[error("{name}: {source}")]
    Replay {
        /// The trace's label, and the point's settings if it changes any.
        name: String,
        /// The error.
        source: Box<ReplayError>,
    },
    /// The result could not be stored.
    #[error("{0:#}")]
    Store(anyhow::Error),
}

/// Replays every point on every trace in parallel, except points in the store. `done` is called with the
/// number of points completed by each step.
///
/// # Errors
/// The first failing point in plan order. Results of other points are stored.
pub fn run<'a>(
    plan: &'a Plan,
    subjects: &'a [Subject<'a>],
    store: Option<&Store>,
    done: &(dyn Fn(u64) + Sync),
) -> Result<Outcome<'a>, RunError> {
    let groups = groups(&plan.points);
    let part = |subject| SubjectRun::new(plan, subject, groups.clone(), store, done);
    let answers = replayed(subjects.iter().map(part).collect());
    let mut results = Vec::with_capacity(subjects.len());
    let mut work = Work::default();
    for answer in answers {
        let (of_groups, of_subject) = answer?;
        work.add(&of_subject);
        results.push(of_groups);
    }
    Ok(outcome(plan, subjects, &groups, &results, work))
}

/// Replays the wanted points that are not in the store, and stores them. `wanted[subject]` lists distinct
/// configurations by their number in [`super::Split`].
///
/// # Errors
/// As [`run`].
pub fn run_part(
    plan: &Plan,
    subjects: &[Subject],
    store: &Store,
    wanted: &[Vec<usize>],
    done: &(dyn Fn(u64) + Sync),
) -> Result<Work, RunError> {
    let all = groups(&plan.points);
    let part = |(subject, wanted): (_, &Vec<usize>)| {
        let groups = wanted.iter().map(|&group| all[group].clone()).collect();
        SubjectRun::new(plan, subject, groups, Some(store), done)
    };
    let answers = replayed(subjects.iter().zip(wanted).map(part).collect());
    let mut work = Work::default();
    for answer in answers {
        work.add(&answer?.1);
    }
    Ok(work)
}

/// The outcome of a plan whose points are all in the store.
///
/// # Errors
/// All points that are not.
pub fn merge<'a>(
    plan: &'a Plan,
    subjects: &'a [Subject<'a>],
    store: &Store,
) -> Result<Outcome<'a>, Incomplete> {
    let groups = groups(&plan.points);
    let mut results = Vec::with_capacity(subjects.len());
    let mut absent = Vec::new();
    for subject in subjects {
        let find = |group: &Vec<usize>| store.find(&subject.id, &plan.points[group[0]].config);
        let found: Vec<_> = groups.par_iter().map(find).collect();
        let mut of_groups = Vec::with_capacity(groups.len());
        for (group, found) in groups.iter().zip(found) {
            let point = &plan.points[group[0]];
            match found {
                Ok(result) => of_groups.push(result),
                Err(why) => absent.push(AbsentPoint {
                    name: format!("{}, {}", subject.label, point.title()),
                    why,
                }),
            }
        }
        results.push(of_groups);
    }
    if !absent.is_empty() {
        return Err(Incomplete {
            expected: groups.len() * subjects.len(),
            absent,
            damages: store.damages().to_vec(),
            foreign: store.foreign().clone(),
        });
    }
    Ok(outcome(plan, subjects, &groups, &results, Work::default()))
}

/// Assigns each point its group's result; `results[subject]` has one result per group.
fn outcome<'a>(
    plan: &'a Plan,
    subjects: &'a [Subject<'a>],
    groups: &[Vec<usize>],
    results: &[Vec<RunResult>],
    work: Work,
) -> Outcome<'a> {
    let mut of_all = Vec::with_capacity(subjects.len() * plan.points.len());
    for of_groups in results {
        let mut of_points = vec![RunResult::default(); plan.points.len()];
        for (group, result) in groups.iter().zip(of_groups) {
            for &point in group {
                of_points[point].clone_from(result);
            }
        }
        of_all.append(&mut of_points);
    }
    Outcome::new(plan, subjects, of_all, work)
}

/// Points of a plan that are not in the store.
#[derive(Debug, thiserror::Error)]
pub struct Incomplete {
    /// Number of distinct points of the plan.
    pub expected: usize,
    /// The missing points.
    pub absent: Vec<AbsentPoint>,
    /// Rows of the store that were skipped.
    pub damages: Vec<String>,
    /// Number of rows of each other model version.
    pub foreign: BTreeMap<u32, usize>,
}

/// A point that is not in the store.
#[derive(Debug)]
pub struct AbsentPoint {
    /// Trace and settings.
    pub name: String,
    /// The reason.
    pub why: Absent,
}

impl fmt::Display for Incomplete {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        /// Longer lists are cut; `--plan --json` prints all points.
        const LISTED: usize = 50;
        let (expected, found) = (self.expected, self.absent.len());
        write!(f, "{found} of {expected} points are missing:")?;
        for AbsentPoint { name, why } in self.absent.iter().take(LISTED) {
            write!(f, "\n  {name}: {why}")?;
        }
        if let Some(more @ 1..) = found.checked_sub(LISTED) {
            write!(f, "\n  and {more} more (--plan --json lists all)")?;
        }
        for damage in self.damages.iter().take(LISTED) {
            write!(f, "\n  skipped: {damage}")?;
        }
        for (version, rows) in &self.foreign {
            write!(
                f,
                "\n  skipped: {rows} rows of model version {version}, expected {MODEL_VERSION}"
            )?;
        }
        Ok(())
    }
}

/// Groups points, by index, with the same configuration, which need one replay per trace. (A change may try
/// the base's value.)
pub(super) fn groups(points: &[Point]) -> Vec<Vec<usize>> {
    grouped(0..points.len(), |&index| points[index].config)
}

/// The wanted groups of a trace: stored results, and results of the engine.
struct SubjectRun<'p> {
    plan: &'p Plan,
    subject: &'p Subject<'p>,
    groups: Vec<Vec<usize>>,
    store: Option<&'p Store>,
    done: &'p (dyn Fn(u64) + Sync),
    /// Groups that are not in the store, and their configurations.
    missing: Vec<usize>,
    configs: Vec<RunConfig>,
    /// By group.
    results: Mutex<Vec<Option<RunResult>>>,
    unkept: Mutex<Option<anyhow::Error>>,
}

impl<'p> SubjectRun<'p> {
    /// Reads the stored results.
    fn new(
        plan: &'p Plan,
        subject: &'p Subject<'p>,
        groups: Vec<Vec<usize>>,
        store: Option<&'p Store>,
        done: &'p (dyn Fn(u64) + Sync),
    ) -> Self {
        let config = |group: &Vec<usize>| plan.points[group[0]].config;
        let load = |group| store.and_then(|store| store.find(&subject.id, &config(group)).ok());
        let kept: Vec<Option<RunResult>> = groups.par_iter().map(load).collect();
        let answered = groups.iter().zip(&kept).filter(|(_, kept)| kept.is_some());
        done(answered.map(|(group, _)| group.len() as u64).sum());
        let missing: Vec<usize> = (0..groups.len()).filter(|&g| kept[g].is_none()).collect();
        Self {
            configs: missing.iter().map(|&g| config(&groups[g])).collect(),
            missing,
            plan,
            subject,
            groups,
            store,
            done,
            results: Mutex::new(kept),
            unkept: Mutex::new(None),
        }
    }

    /// Stores a result of the engine.
    fn finished(&self, index: usize, mut result: RunResult) {
        let group = self.missing[index];
        if let Some(store) = self.store {
            match store.save(&self.subject.id, &self.configs[index], &result) {
                Ok(saved) => result = saved,
                Err(error) => *locked(&self.unkept) = Some(error),
            }
        }
        locked(&self.results)[group] = Some(result);
        (self.done)(self.groups[group].len() as u64);
    }

    /// One result per group.
    fn end(
        self,
        replayed: Result<Work, (usize, ReplayError)>,
    ) -> Result<(Vec<RunResult>, Work), RunError> {
        let work = replayed.map_err(|(index, error)| {
            let point = &self.plan.points[self.groups[self.missing[index]][0]];
            let label = &self.subject.label;
            RunError::Replay {
                name: match point.is_base() {
                    true => label.clone(),
                    false => format!("{label}, {}", point.title()),
                },
                source: Box::new(error),
            }
        })?;
        if let Some(error) = locked(&self.unkept).take() {
            return Err(RunError::Store(error));
        }
        let results = std::mem::take(&mut *locked(&self.results));
        Ok((results.into_iter().flatten().collect(), work))
    }
}

/// Replays the missing groups of each part.
fn replayed(parts: Vec<SubjectRun<'_>>) -> Vec<Result<(Vec<RunResult>, Work), RunError>> {
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let tell = |part| move |index, result| SubjectRun::finished(part, index, result);
    let finished: Vec<_> = parts.iter().map(tell).collect();
    let mut jobs: Vec<Job<'_>> = Vec::with_capacity(parts.len());
    for (part, finished) in parts.iter().zip(&finished) {
        jobs.push(Job {
            trace: part.subject.source,
            configs: &part.configs,
            finished,
            after_frame: None,
        });
    }
    let answers = replay_jobs(&jobs, &memory);
    parts
        .into_iter()
        .zip(answers)
        .map(|(part, answer)| part.end(answer))
        .collect()
}

/// A thread that panics while holding the lock ends the whole run, so the data is still valid.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
