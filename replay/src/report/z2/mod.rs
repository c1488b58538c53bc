//! The Z2 paper's experiment: cache configurations times orders on each trace (Table 2, Fig. 5).
//!
//! [`model`] takes an outcome apart; tables, plots and the page only print its rows.

mod cores;
pub mod model;
pub mod page;
pub mod plots;
pub mod tables;
mod whole_frame;

#[cfg(test)]
pub(crate) mod testing;
