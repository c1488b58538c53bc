//! Checks of captures: references in double precision, and extreme inputs.

pub mod stress;
pub mod traversal;
pub mod verify;
