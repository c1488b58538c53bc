//! The caches of a configuration, and the paths between them.

mod at_once;
mod below;
mod caches;
mod inclusion;
mod level;
mod other_work;
mod second_level;

pub use at_once::{Found, Hierarchy};
pub use caches::Caches;
pub use other_work::OtherWork;
pub use second_level::{Answer, MissPath, SecondLevel};
