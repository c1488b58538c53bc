//! An independent reference that captures are held against.
//!
//! A rasteriser and a texture unit in double precision that share nothing with the drivers but their documented
//! rules: vertices snapped to 1/256 pixel, the top-left rule, a depth test with `Less` in submission order,
//! perspective-correct interpolation, levels of detail and filtering as the specification has them. With the
//! capture they share the scene, the eyes' matrices, the list of draws and the compressed textures; with the
//! trace's readers what a record means.

pub mod agreement;
pub mod alpha;
pub mod causes;
pub mod classes;
pub mod colour;
pub mod compare;
pub mod frame;
pub mod geometry;
pub mod lod;
pub mod means;
pub mod piece;
mod precision;
pub mod reference;
pub mod report;
pub mod sampler;
pub mod tables;
mod views;
pub mod write;

#[cfg(test)]
mod tests;
