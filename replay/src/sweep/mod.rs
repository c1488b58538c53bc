//! Parameter sweeps: plan, run, resume.

mod output;
mod plan;
mod run;
mod store;

pub use output::{SWEEP_SCHEMA, SweepReport, csv, page, table};
pub use plan::{Axis, Experiment, PlanError, Point};
pub use run::{SweepError, SweepOutcome, run};
pub use store::{POINT_SCHEMA, Store, StoredPoint, point_key};
