//! Experiments: which points to replay, replaying them, and keeping their results.
//!
//! A point is a configuration with its provenance (which axes are set, which single change is
//! tried); a [`Plan`] is a list of points, checked before any work; [`run`] replays every point on
//! every trace, and its [`Outcome`] hands out rows that know their neighbours.

mod file;
mod outcome;
mod plan;
mod runner;
mod store;
mod subject;

pub use file::ExperimentFile;
pub use outcome::{Outcome, ResultRow};
pub use plan::{Axis, MOST_POINTS, Plan, PlanError, Point, Setting, plain};
pub use runner::{RunError, run};
pub use store::{POINT_SCHEMA, Store, StoredPoint, point_key};
pub use subject::{Subject, frame_count, has_shadow_maps, labels};

#[cfg(test)]
mod mutations;
#[cfg(test)]
mod tests;
