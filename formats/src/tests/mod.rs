//! Tests of the whole crate.

mod specification;
