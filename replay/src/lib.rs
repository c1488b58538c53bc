//! Replays texture traces through caches and a texture unit in any tile order, and ray traces
//! through a model of a mobile ray-tracing GPU.

mod access;
pub mod accuracy;
pub mod addresses;
pub mod cli;
pub mod compare;
pub mod config;
pub mod engine;
pub mod experiment;
pub mod files;
pub mod line_list;
pub mod locality;
pub mod memory;
pub mod model_version;
pub mod notices;
pub mod order;
pub mod orders_study;
mod palette;
pub mod paper;
pub mod preset;
pub mod records;
mod registry;
pub mod report;
pub mod result;
#[cfg(test)]
mod schemas;
pub mod sgrt;
pub mod size;
pub mod stream;
pub mod techniques;
mod tmu;
