//! The plan of a sweep, for schedulers: each point with its key, its estimated cost and whether it is done.

use super::columns::{Columns, columns_of};
use super::document::Document;
use super::sweep::LabelledTrace;
use super::table::{Style, Table};
use rayon::prelude::*;
use serde::Serialize;
use studies::experiment::{Plan, Point, Store, Subject, Task, point_key};

/// A sweep before it runs.
pub struct SweepPlan<'a> {
    /// The points of each trace.
    pub plan: &'a Plan,
    /// The traces.
    pub subjects: &'a [Subject<'a>],
    /// The points to run, by trace.
    pub tasks: &'a [Task],
    /// The rows of points that are done.
    pub store: &'a Store,
}

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct PlanJson<'a> {
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

impl Document for SweepPlan<'_> {
    const SCHEMA: &'static str = "replay.plan/2";
    const INDENTED: bool = false;

    fn content(&self) -> impl Serialize {
        let point = |task: &Task| {
            let (subject, point) = (&self.subjects[task.subject], &self.plan.points[task.point]);
            PlannedPoint {
                key: point_key(&subject.id, &point.config),
                scene: &subject.label,
                point: point.title(),
                pass: task.pass,
                cost: task.cost,
                done: self.store.find(&subject.id, &point.config).is_ok(),
            }
        };
        PlanJson {
            traces: self.subjects.iter().map(LabelledTrace::of).collect(),
            points: self.tasks.par_iter().map(point).collect(),
        }
    }

    fn rows(&self) -> Table {
        let columns = columns_of::<Point>().text("point", "point", |point| point.title());
        Table::new(&columns, &self.plan.points)
    }

    fn text(&self, _: Style) -> String {
        let titles: Vec<String> = self.plan.points.iter().map(Point::title).collect();
        titles.join("\n")
    }
}
