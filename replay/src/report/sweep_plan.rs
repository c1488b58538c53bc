//! What a sweep would do, for schedulers: a line a point with its key, its cost and whether it is
//! done.

use crate::experiment::{Plan, Store, Subject, Task, point_key};
use crate::model_version::MODEL_VERSION;
use crate::result::{TOOL, TraceId};
use rayon::prelude::*;
use serde::Serialize;

/// Schema of a plan's JSON.
pub const PLAN_SCHEMA: &str = "replay.plan/1";

#[derive(Serialize)]
struct Document<'a> {
    schema: &'a str,
    tool: &'a str,
    model_version: u32,
    /// Labels and traces.
    traces: Vec<(&'a str, &'a TraceId)>,
    points: Vec<PlannedPoint<'a>>,
}

#[derive(Serialize)]
struct PlannedPoint<'a> {
    /// Key of its row in a file of `points/`.
    key: String,
    scene: &'a str,
    /// What is set at the point.
    point: String,
    /// Points with this number share a pass: they are best replayed together.
    pass: usize,
    /// Estimated share of the work, in no unit.
    cost: u64,
    /// Whether its result is there.
    done: bool,
}

/// A plan's tasks as one JSON object.
///
/// # Errors
/// None that a plan can cause.
pub fn json(
    plan: &Plan,
    subjects: &[Subject],
    tasks: &[Task],
    store: &Store,
) -> serde_json::Result<String> {
    let point = |task: &Task| {
        let (subject, point) = (&subjects[task.subject], &plan.points[task.point]);
        PlannedPoint {
            key: point_key(&subject.id, &point.config),
            scene: &subject.label,
            point: point.title(),
            pass: task.pass,
            cost: task.cost,
            done: store.find(&subject.id, &point.config).is_ok(),
        }
    };
    serde_json::to_string(&Document {
        schema: PLAN_SCHEMA,
        tool: TOOL,
        model_version: MODEL_VERSION,
        traces: subjects.iter().map(|s| (s.label.as_str(), &s.id)).collect(),
        points: tasks.par_iter().map(point).collect(),
    })
}
