//! The scene that every loader fills and every renderer reads: model, loaders, cameras, displays.

pub mod cameras;
mod error;
mod files;
pub mod geometry;
mod gltf;
pub mod hmd;
pub mod images;
mod load;
mod model;
mod obj;
mod options;
#[cfg(test)]
mod real_scenes;
mod uri;
mod warnings;

pub use error::SceneError;
pub use load::{DEFAULT_SKY, complete, default_sun, load_file};
pub use model::{AlphaMode, Camera, Image, Instance, Light, Material, Mesh, Scene, TextureRef};
pub use options::{LoadOptions, Loaded};
