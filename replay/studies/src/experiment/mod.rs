//! Experiments: planning, replaying and storing points.
//!
//! A point is a configuration together with the axis values and the single change that produced it. A
//! [`Plan`] is a list of points, checked before any work. [`run`] replays every point on every trace; its
//! [`Outcome`] provides rows with references to their comparison points. A [`Split`] distributes points to
//! machines, [`run_part`] replays one machine's points, and [`merge`] combines the stored results.

mod calibration;
mod file;
mod keys;
mod l2_content;
mod outcome;
mod plan;
mod rows;
mod runner;
mod split;
mod store;
mod subject;
mod texels;
mod tiles;

pub use calibration::{Objective, SceneCaptures, SceneFit, Trial, is_of_the_table, trials};
pub use file::{ExperimentFile, parse_config};
pub use keys::CACHES;
pub use l2_content::{FULL, FrameContent, L2Content, STEPS, Share};
pub use outcome::{Outcome, ResultRow};
pub use plan::{Axis, MOST_POINTS, Plan, PlanError, Point, Setting, plain};
pub use runner::{AbsentPoint, Incomplete, RunError, merge, run, run_part};
pub use split::{Split, Task};
#[cfg(feature = "testing")]
pub use store::point_schema;
pub use store::{Absent, POINT_SCHEMA, Store, StoredPoint, point_key};
pub use subject::{Subject, frame_count, has_shadow_maps, labels, scene_label};
pub use texels::{LevelReads, level_reads};
pub use tiles::{BOTH_EYES, Counts, FrameTiles, PassTiles, Read, frame_tiles};

#[cfg(test)]
mod tests;
