//! Settings of techniques, and the layers of the frames that they produce.
//!
//! This crate depends only on displays and angles, not on drivers and scenes. A driver renders the
//! [`layer::Layer`]s.

pub mod distance;
mod error;
mod eye;
pub mod far_field;
pub mod foveation;
pub mod gaze;
mod hidden_area;
pub mod hidden_mesh;
pub mod layer;
pub mod least_work;
mod mask;
mod patch;
pub mod plan;
mod planner;
pub mod settings;
pub mod shading_reuse;
pub mod skips;
pub mod start;
pub mod timewarp;

pub use error::SettingsError;
pub use gaze::Gaze;
pub use layer::{Layer, Stage};
pub use mask::Mask;
pub use plan::FramePlan;
pub use planner::Planner;
pub use settings::Settings;
pub use skips::Skips;
pub use start::Start;
