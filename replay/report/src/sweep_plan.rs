//! The plan of a sweep, for schedulers: each point with its key, its estimated cost and whether it is done.

use super::sweep::LabelledTrace;
use rayon::prelude::*;
use serde::Serialize;
use sim::model_version::MODEL_VERSION;
use sim::result::TOOL;
use studies::experiment::{Plan, Store, Subject, Task, point_key};

/// Schema of a plan's JSON.
pub const PLAN_SCHEMA: &str = "replay.plan/2";

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct PlanJson<'a> {
    schema: &'a str,
    tool: &'a str,
    model_version: u32,
    traces: Vec<LabelledTrace<'a>>,
    points: Vec<PlannedPoint<'a>>,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct PlannedPoint<'a> {
    /// Key of its row in a file of `points/`.
    key: String,
    scene: &'a str,
    /// Settings of the point.
    point: String,
    /// Number of the pass. Points of the same pass are replayed together, so splitting them costs time.
    pass: usize,
    /// Estimated cost, without a unit.
    cost: u64,
    /// Whether its result exists.
    done: bool,
}

/// A plan's tasks as one JSON object.
///
/// # Errors
/// None for valid plans.
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
    serde_json::to_string(&PlanJson {
        schema: PLAN_SCHEMA,
        tool: TOOL,
        model_version: MODEL_VERSION,
        traces: subjects.iter().map(LabelledTrace::of).collect(),
        points: tasks.par_iter().map(point).collect(),
    })
}

/// The schema of the JSON object.
#[cfg(feature = "testing")]
pub fn schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<PlanJson<'_>>(PLAN_SCHEMA)
}
