//! An independent reference that captures are compared with.
//!
//! A rasteriser and a texture unit in double precision that share only documented rules with the drivers:
//! vertices snapped to 1/256 pixel, the top-left rule, a depth test with `Greater` in submission order,
//! perspective-correct interpolation, levels of detail and filtering according to the specification. They
//! share the scene, the eyes' matrices, the list of draws and the compressed textures with the capture, and
//! the meaning of records with the trace's readers.

pub mod agreement;
pub mod alpha;
pub mod causes;
pub mod classes;
pub mod colour;
pub mod compare;
mod faults;
pub mod frame;
pub mod geometry;
mod lists;
pub mod lod;
pub mod lookups;
pub mod means;
mod meshes;
pub mod piece;
mod precision;
mod primitives;
pub mod reference;
pub mod report;
pub mod sampler;
pub mod shadows;
pub mod tables;
mod vertex_error;
mod views;
pub mod write;

#[cfg(test)]
mod tests;
