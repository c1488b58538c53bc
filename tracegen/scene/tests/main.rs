//! Tests of the loaders on whole files, in one program.

mod conformance;
mod containers;
mod poses;
