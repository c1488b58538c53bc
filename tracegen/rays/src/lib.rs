//! Ray tracing: renders a scene for both eyes and records every ray's work in the hierarchy.

pub mod bvh;
mod cast;
pub mod frame;
mod light;
mod material;
pub mod picture;
pub mod precision;
pub mod ray;
pub mod reference;
pub mod reference_tree;
pub mod reference_walk;
pub mod robustness;
mod sampling;
pub mod scene;
pub mod soup;
mod texture;
pub mod tracer;

pub use material::SLOTS as TEXTURE_SLOTS;

#[cfg(test)]
mod tests;
