//! Replays the points of a plan on every trace.

use super::{Outcome, Plan, Point, Store, Subject};
use crate::config::RunConfig;
use crate::engine::{ReplayError, Work, replay_all};
use crate::result::RunResult;
use crate::stream::LineMemory;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A point failed.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The replay failed.
    #[error("{label}, {point}: {source}")]
    Replay {
        /// The trace's label.
        label: String,
        /// The point's settings.
        point: String,
        /// What went wrong.
        source: Box<ReplayError>,
    },
    /// The result could not be kept.
    #[error("{0:#}")]
    Store(anyhow::Error),
}

/// Replays every point on every trace, in parallel, taking what the store has; `done` is told how
/// many points are done with each step.
///
/// # Errors
/// The first point, in the plan's order, that fails; results of other points are kept.
pub fn run<'a>(
    plan: &'a Plan,
    subjects: &'a [Subject<'a>],
    store: Option<&Store>,
    done: &(dyn Fn(u64) + Sync),
) -> Result<Outcome<'a>, RunError> {
    let groups = groups(&plan.points);
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let one = |subject| replayed(plan, &groups, subject, store, &memory, done);
    let answers: Vec<Result<_, RunError>> = subjects.par_iter().map(one).collect();
    let mut results = Vec::with_capacity(subjects.len() * plan.points.len());
    let mut work = Work::default();
    for answer in answers {
        let (of_groups, of_subject) = answer?;
        work.add(&of_subject);
        let mut of_points = vec![RunResult::default(); plan.points.len()];
        for (group, result) in groups.iter().zip(&of_groups) {
            for &point in group {
                of_points[point].clone_from(result);
            }
        }
        results.append(&mut of_points);
    }
    Ok(Outcome::new(plan, subjects, results, work))
}

/// Points, by index, that one replay of a trace answers together: those with the same
/// configuration (a change may try the value that the base has).
fn groups(points: &[Point]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for (index, point) in points.iter().enumerate() {
        let config = serde_json::to_string(&point.config).unwrap_or_default();
        let group = *known.entry(config).or_insert(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
        }
        groups[group].push(index);
    }
    groups
}

/// A result for each group of points, from the store or from the engine.
fn replayed(
    plan: &Plan,
    groups: &[Vec<usize>],
    subject: &Subject,
    store: Option<&Store>,
    memory: &LineMemory,
    done: &(dyn Fn(u64) + Sync),
) -> Result<(Vec<RunResult>, Work), RunError> {
    let config = |group: &Vec<usize>| plan.points[group[0]].config;
    let load = |group| store.and_then(|store| store.load(&subject.id, &config(group)));
    let kept: Vec<Option<RunResult>> = groups.par_iter().map(load).collect();
    let missing: Vec<usize> = (0..groups.len()).filter(|&g| kept[g].is_none()).collect();
    let points = |groups: &mut dyn Iterator<Item = &Vec<usize>>| -> u64 {
        groups.map(|group| group.len() as u64).sum()
    };
    let answered = groups.iter().zip(&kept).filter(|(_, kept)| kept.is_some());
    done(points(&mut answered.map(|(group, _)| group)));

    let configs: Vec<RunConfig> = missing.iter().map(|&g| config(&groups[g])).collect();
    let results = Mutex::new(kept);
    let unkept = Mutex::new(None);
    let finished = |index: usize, mut result: RunResult| {
        let group = missing[index];
        if let Some(store) = store {
            match store.save(&subject.id, &configs[index], &result) {
                Ok(saved) => result = saved,
                Err(error) => *locked(&unkept) = Some(error),
            }
        }
        locked(&results)[group] = Some(result);
        done(groups[group].len() as u64);
    };
    let replayed = replay_all(subject.source, &configs, memory, &finished);
    let work = replayed.map_err(|(index, error)| RunError::Replay {
        label: subject.label.clone(),
        point: plan.points[groups[missing[index]][0]].title(),
        source: Box::new(error),
    })?;
    if let Some(error) = locked(&unkept).take() {
        return Err(RunError::Store(error));
    }
    let results = std::mem::take(&mut *locked(&results));
    Ok((results.into_iter().flatten().collect(), work))
}

/// A thread that panicked while it held the lock ends the whole run; until then nothing is lost.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
