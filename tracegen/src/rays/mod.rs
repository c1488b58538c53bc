//! Ray tracing: a scene seen by both eyes, with every ray's work in the hierarchy recorded.

pub mod bvh;
pub mod ray;
pub mod reference;
