//! Finds the best techniques: the cheapest combination within an error budget, or the least error within a
//! time budget, checked on every frame of the path.

mod budget;
mod choose;
mod guard;
mod judge;
mod objective;
mod record;
mod schedule;
mod search;
#[cfg(test)]
mod tests;

pub use budget::Budget;
pub use choose::{choose, search_frames};
pub use guard::{Held, hold};
pub use judge::{Known, SearchBench};
pub use objective::Objective;
pub use record::AutoRecord;
pub use schedule::Schedule;
use search::search;
