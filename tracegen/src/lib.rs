//! Scene to trace: loads a scene, renders it for both eyes through Mesa and captures every
//! texture sample, or traces it and captures every ray.

pub mod captures;
pub mod cli;
mod doubtful;
mod hidden_mesh;
mod picture;
pub mod stress;
pub mod study;
pub mod verify;
