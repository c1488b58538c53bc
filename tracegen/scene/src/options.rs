//! What a loader is asked for and what it hands over.

use crate::Scene;

/// What a loader reads besides geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadOptions {
    /// Decode the images. Without it an image has its size (from the file's header) and no texels.
    pub images: bool,
    /// Which of [`super::Material::textures`] to keep, in that order; the others become `None` and
    /// their images are not read.
    pub slots: [bool; 6],
}

impl LoadOptions {
    /// Everything.
    pub const ALL: Self = Self {
        images: true,
        slots: [true; 6],
    };
    /// Geometry, materials and image sizes, no texels.
    pub const NO_IMAGES: Self = Self {
        images: false,
        slots: [true; 6],
    };
    /// Base colour images only.
    pub const BASE_COLOR: Self = Self {
        images: true,
        slots: [true, false, false, false, false, false],
    };
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self::ALL
    }
}

/// A scene and what was odd about its file.
#[derive(Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// One sentence each; nothing here stops the scene from being used.
    pub warnings: Vec<String>,
}
