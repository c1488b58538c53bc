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
mod batches;
pub mod capture;
pub mod cascades;
mod distant;
pub mod draws;
pub mod drivers;
pub mod error;
pub mod frame;
pub mod geometry;
mod groups;
pub mod lavapipe;
pub mod lighting;
mod occlude;
#[cfg(feature = "osmesa")]
mod osmesa;
mod roles;
mod seen;
mod shader;
mod skips;
pub mod truth;
mod uniforms;
mod vertices;
mod view;

pub use vertices::VERTEX_STRIDE;
