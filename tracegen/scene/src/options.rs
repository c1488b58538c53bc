//! Options and results of a loader.

use crate::{Scene, TextureSlots};
use std::path::PathBuf;

/// Options of a loader.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadOptions {
    /// Which textures of the materials to keep. The images of the others are not read.
    pub slots: TextureSlots,
    /// The material variant to show (KHR_materials_variants), or the file's own materials.
    pub variant: Option<String>,
    /// The animation to play: a name, an index, `all` or `none`. The default is the file's first one.
    pub animation: Option<String>,
    /// The time of the pose, seconds from the start of the animation.
    pub time_s: f64,
}

impl LoadOptions {
    /// All textures.
    pub const ALL: Self = Self {
        slots: TextureSlots::ALL,
        variant: None,
        animation: None,
        time_s: 0.0,
    };
}

impl LoadOptions {
    /// The animation chosen by name or index. A scene without animations has none.
    pub fn named_animation(&self) -> Option<&str> {
        let named = self.animation.as_deref();
        named.filter(|name| !["all", "none"].contains(name))
    }
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self::ALL
    }
}

/// A scene, and warnings about its file.
#[derive(Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// One sentence each. None of them prevents the scene from being used.
    pub warnings: Vec<String>,
    /// Every file that the scene refers to, read or not, its own first. Empty for a built-in scene.
    pub files: Vec<PathBuf>,
    /// Names of the file's animations.
    pub animations: Vec<String>,
}
