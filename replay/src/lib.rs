//! Command line of `replay`: replays texture traces through caches and a texture unit in any tile order, and ray traces
//! through a model of a mobile ray-tracing GPU.

pub mod cli;
pub mod files;
pub mod records;
#[cfg(test)]
mod schemas;

pub use report::notices;
pub use sim::{
    addresses, config, engine, line_list, memory, model_version, order, paper, preset, registry,
    result, size, stream,
};
pub use studies::{accuracy, compare, experiment, orders_study, techniques};
pub use {locality, report, sgrt};
