//! Captures texture samples: a stereo raster pass through a Mesa driver.
//!
//! ```text
//! scene -> DrawList -> backend (instrumented shader) -> raw quad records, one region at a time
//!       -> binning by tile -> in-order alpha-test replay -> fixed point -> encoded tiles -> file
//! ```
//!
//! Draws keep the file's order, opaque and alpha-masked ones first, then blended ones. A trace must
//! not depend on a sort by distance, which differs between the eyes.

pub mod backend;
pub mod batches;
pub mod capture;
pub mod cascades;
pub mod culling_truth;
mod distant;
pub mod draws;
pub mod error;
pub mod frame;
pub mod geometry;
mod groups;
pub mod lavapipe;
pub mod lighting;
mod occlude;
pub mod roles;
mod seen;
pub mod shader;
mod skips;
pub mod uniforms;
pub mod vertices;
mod view;
