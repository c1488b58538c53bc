//! What a frame may leave out or do more coarsely, and the layers that it is then rendered as.
//!
//! Knows displays and angles, and neither drivers nor scenes: a driver renders the [`layer::Layer`]s.

pub mod far_field;
pub mod gaze;
pub mod layer;
pub mod least_work;
pub mod mask;
pub mod plan;
pub mod settings;

pub use gaze::Gaze;
pub use layer::{Layer, Stage};
pub use mask::Mask;
pub use plan::FramePlan;
pub use settings::{Settings, SettingsError};
