//! Finds the techniques that are worth it: the cheapest combination inside an error budget, or the
//! least error inside a time budget, and holds the promise on every frame of the path.

mod budget;
mod choose;
mod guard;
mod judge;
mod record;
mod search;
#[cfg(test)]
mod tests;

pub use budget::Budget;
pub use choose::{Choice, choose};
pub use guard::{Held, hold};
pub use judge::Bench;
pub use record::AutoRecord;
pub use search::{Elsewhere, Found, Infeasible, Judge, Verdict, search};
