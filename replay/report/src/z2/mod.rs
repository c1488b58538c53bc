//! The Z2 paper's experiment: cache configurations times orders on each trace (Table 2, Fig. 5).
//!
//! [`model`] turns an outcome into rows; tables, plots and the page print them.

mod cores;
pub mod model;
pub mod page;
pub mod plots;
pub mod tables;
pub(crate) mod whole_frame;

#[cfg(test)]
pub(crate) mod testing;
