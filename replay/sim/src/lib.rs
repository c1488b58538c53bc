//! Replays texture traces through caches, DRAM and a texture unit, in any tile order.

pub mod access;
pub mod addresses;
pub mod config;
pub mod engine;
pub mod line_list;
pub mod memory;
pub mod model_version;
pub mod order;
pub mod palette;
pub mod paper;
pub mod preset;
pub mod registry;
pub mod result;
#[cfg(feature = "testing")]
pub mod schemas;
pub mod size;
pub mod stream;
mod sums;
pub mod tmu;
