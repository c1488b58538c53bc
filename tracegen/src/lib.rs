//! Scene to trace: loads a scene, renders it for both eyes through Mesa and captures every
//! texture sample, or traces it and captures every ray.

mod captures;
pub mod cli;
mod cut_triangles;
mod hidden_mesh;
#[cfg(feature = "programs")]
mod openxr;
mod picture;
#[cfg(test)]
mod schemas;
mod study;
mod unstable_triangles;
