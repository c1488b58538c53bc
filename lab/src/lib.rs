//! Checks of captures: a reference in double precision, and extreme inputs.

pub mod stress;
pub mod verify;
