//! Replays the points of a plan on every trace.

use super::{Outcome, Plan, Point, Store, Subject};
use crate::engine::{ReplayError, replay};
use crate::result::RunResult;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};

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
    let replays = AtomicUsize::new(0);
    let groups = groups(&plan.points);
    let jobs: Vec<(&Subject, &[usize])> = subjects
        .iter()
        .flat_map(|subject| groups.iter().map(move |group| (subject, group.as_slice())))
        .collect();
    let answers: Vec<Result<RunResult, RunError>> = jobs
        .par_iter()
        .map(|&(subject, group)| {
            let point = &plan.points[group[0]];
            let kept = store.and_then(|s| s.load(&subject.id, &point.config));
            let answer = kept.map_or_else(|| one(subject, point, store, &replays), Ok);
            done(group.len() as u64);
            answer
        })
        .collect();
    let mut results = vec![RunResult::default(); subjects.len() * plan.points.len()];
    for (job, (answer, (_, group))) in answers.into_iter().zip(&jobs).enumerate() {
        let first = job / groups.len() * plan.points.len();
        let answer = answer?;
        for &index in *group {
            results[first + index].clone_from(&answer);
        }
    }
    Ok(Outcome::new(plan, subjects, results, replays.into_inner()))
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

fn one(
    subject: &Subject,
    point: &Point,
    store: Option<&Store>,
    replays: &AtomicUsize,
) -> Result<RunResult, RunError> {
    let result = replay(subject.source, &point.config).map_err(|error| RunError::Replay {
        label: subject.label.clone(),
        point: point.title(),
        source: Box::new(error),
    })?;
    replays.fetch_add(1, Ordering::Relaxed);
    store.map_or(Ok(result.clone()), |store| {
        store
            .save(&subject.id, &point.config, &result)
            .map_err(RunError::Store)
    })
}
