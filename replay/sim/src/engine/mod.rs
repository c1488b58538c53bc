//! Replays a trace: connects order, stream, caches and texture units.

mod batch;
mod counts;
mod error;
mod fast;
mod functional;
mod group;
mod lines;
mod machine;
mod outcome;
mod repeats;
mod scheduler;
mod summary;
#[cfg(test)]
mod tests;
mod threads;
mod wave;

pub use batch::{Work, replay, replay_all, replay_jobs};
pub use counts::Misses;
pub use error::ReplayError;
pub use error::check_other_work;
pub use group::{grouped, sharing};
pub use lines::{LineOutcome, LineReplay};
pub use wave::Job;
