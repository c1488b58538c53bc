//! Experiments: which points to replay, replaying them, and keeping their results.
//!
//! A point is a configuration with its provenance (which axes are set, which single change is
//! tried); a [`Plan`] is a list of points, checked before any work; [`run`] replays every point on
//! every trace, and its [`Outcome`] hands out rows that know their neighbours. A [`Split`] deals the
//! points out to machines, [`run_part`] replays what one of them has to, and [`merge`] puts what
//! all have kept together.

mod calibration;
mod file;
mod outcome;
mod plan;
mod rows;
mod runner;
mod split;
mod store;
mod subject;

pub use calibration::{Objective, SceneCaptures, SceneFit, Trial, is_of_the_table, trials};
pub use file::{ExperimentFile, parse_config};
pub use outcome::{Outcome, ResultRow};
pub use plan::{Axis, MOST_POINTS, Plan, PlanError, Point, Setting, plain};
pub use runner::{AbsentPoint, Incomplete, RunError, merge, run, run_part};
pub use split::{Split, Task};
pub use store::{Absent, POINT_SCHEMA, Store, StoredPoint, point_key};
pub use subject::{Subject, frame_count, has_shadow_maps, labels, scene_label};

#[cfg(test)]
mod mutations;
#[cfg(test)]
mod tests;
