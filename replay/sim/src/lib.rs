//! Replays texture traces through caches, DRAM and a texture unit, in any tile order.
//!
//! | to | use |
//! | --- | --- |
//! | replay a trace with a configuration | [`replay`]; [`engine::replay_all`] shares work between many |
//! | describe a machine | [`RunConfig`]: caches, mode, order, layout, sampling |
//! | read what a replay counted | [`result::RunResult`] |
//! | write a replacement policy | [`memory::Policy`] and [`memory::Replacement::own`]: `examples/own_policy.rs` |
//! | write a tile order | [`order::Listed`] and [`order::Order::own`]: `examples/own_order.rs` |
//! | replay addresses of other tools | [`addresses`] |
//!
//! # Example
//!
//! ```no_run
#![doc = include_str!("../examples/own_policy.rs")]
//! ```

pub mod access;
pub mod addresses;
pub mod config;
pub mod engine;
pub mod figure;
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
pub mod sums;
pub mod tmu;

pub use config::RunConfig;
pub use engine::{ReplayError, replay};
pub use result::RunResult;
