//! The Z2 paper's experiment: cache configurations times orders on each trace (Table 2, Fig. 5).
//!
//! [`model`] turns replay results into rows; tables, plots and the page only print those rows.

pub mod experiment;
pub mod model;
pub mod page;
pub mod plots;
pub mod tables;

#[cfg(test)]
pub(crate) mod testing;
