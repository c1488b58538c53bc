//! The scene model, filled by every loader and read by every renderer: model, loaders, cameras,
//! paths, displays.

mod animation;
pub mod blocks;
pub mod cameras;
pub mod channels;
mod coarse;
mod containers;
mod error;
mod files;
pub mod geometry;
mod gltf;
pub mod hmd;
pub mod image;
mod image_files;
pub mod light;
mod load;
mod lookup;
mod model;
mod motion;
mod obj;
mod options;
mod origin;
pub mod paths;
#[cfg(test)]
#[path = "tests/real_scenes.rs"]
mod real_scenes;
pub mod srgb;
mod suggest;
mod texture_slot;
pub mod units;
mod uri;
mod warnings;

pub use animation::Animation;
pub use error::SceneError;
pub use image::Image;
pub use image_files::MAX_SIZE as MAX_IMAGE_SIZE;
pub use load::{complete, load_file};
pub use model::{AlphaMode, Camera, Instance, Light, Material, Mesh, Scene, TextureRef};
pub use motion::{Motion, Movement};
pub use options::{LoadOptions, Loaded};
pub use texture_slot::{TextureSlot, TextureSlots, Textures};
