//! Ray tracing: renders a scene for both eyes and records every ray's work in the hierarchy.

pub mod bvh;
mod cast;
pub mod frame;
mod light;
mod material;
pub mod moved;
pub mod picture;
pub mod ray;
mod sampling;
pub mod scene;
pub mod soup;
mod texture;
pub mod tracer;

pub use material::SLOTS as TEXTURE_SLOTS;

// Files that the benches share name this crate as they do.
#[cfg(test)]
extern crate self as rays;

#[cfg(test)]
mod tests;
