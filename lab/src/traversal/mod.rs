//! Checks of the ray tracer's traversal: a reference in double precision, and the cost of precision.

pub mod precision;
pub mod reference;
