//! From a name or a path to a [`Scene`]: dispatch, options and the errors of every loader.

use super::{Camera, Light, Scene, cameras, gltf, obj, procedural};
use glam::Vec3;
use std::path::{Path, PathBuf};

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

/// Why a scene could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Neither a built-in scene nor a file name with a known extension.
    #[error(
        "unknown scene '{spec}': expected a .gltf, .glb or .obj file or one of the built-in scenes ({known})"
    )]
    Unknown {
        /// As given.
        spec: String,
        /// Built-in names.
        known: String,
    },
    /// A file that cannot be read.
    #[error("{}: {place}: cannot read: {reason}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What refers to it.
        place: String,
        /// The system's error.
        reason: std::io::Error,
    },
    /// A file that is not what it claims to be.
    #[error("{}: {place}: expected {expected}, found {found}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// Where in it.
        place: String,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
}

/// A scene and what was odd about its file.
#[derive(Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// One sentence each; nothing here stops the scene from being used.
    pub warnings: Vec<String>,
}

/// Loads a built-in scene by name, or a glTF or OBJ file by path, with all its images.
///
/// # Errors
/// See [`SceneError`]; nothing in a file makes this panic.
pub fn load(spec: &str) -> Result<Scene, SceneError> {
    load_with(spec, &LoadOptions::ALL).map(|loaded| loaded.scene)
}

/// [`load`] with a choice of images, telling the warnings.
///
/// # Errors
/// See [`SceneError`].
pub fn load_with(spec: &str, options: &LoadOptions) -> Result<Loaded, SceneError> {
    if let Some(scene) = procedural::build(spec) {
        let warnings = Vec::new();
        return Ok(complete(Loaded { scene, warnings }));
    }
    let path = Path::new(spec);
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let mut loaded = match extension.as_deref() {
        Some("gltf" | "glb") => gltf::load(path, options)?,
        Some("obj") => obj::load(path, options)?,
        _ => {
            return Err(SceneError::Unknown {
                spec: spec.to_owned(),
                known: procedural::BUILTINS
                    .iter()
                    .map(|b| b.name)
                    .collect::<Vec<_>>()
                    .join(", "),
            });
        }
    };
    loaded.scene.name = path
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    if loaded.scene.triangle_count() == 0 {
        return Err(SceneError::Invalid {
            file: path.to_owned(),
            place: "scene".into(),
            expected: "at least one triangle".into(),
            found: "none".into(),
        });
    }
    Ok(complete(loaded))
}

/// Gives a scene what its file lacks: a camera, and the sun with a sky.
fn complete(mut loaded: Loaded) -> Loaded {
    let scene = &mut loaded.scene;
    if scene.cameras.is_empty() {
        scene.cameras.push(cameras::default_camera(scene));
    }
    make_names_unique(&mut scene.cameras);
    if scene.lights.is_empty() {
        scene.lights.push(default_sun());
        if scene.sky == Vec3::ZERO {
            scene.sky = DEFAULT_SKY;
        }
    }
    loaded
}

/// Sky radiance of a scene whose file has no lights: a clear day, dimmer than the sun by far.
pub const DEFAULT_SKY: Vec3 = Vec3::new(0.38, 0.47, 0.62);

/// The sun of a scene whose file has no lights.
///
/// It stands at 72 degrees of elevation, so that it reaches the floor of a narrow atrium with an
/// open roof and still shows relief, and off both horizontal axes, so that no axis-aligned wall is
/// exactly edge-on.
#[must_use]
pub fn default_sun() -> Light {
    Light::Directional {
        direction: Vec3::new(0.26, -1.0, 0.19).normalize(),
        color: Vec3::new(3.2, 3.0, 2.7),
    }
}

/// `name`, `name-2`, `name-3`, ... so that `--camera` can choose any of them.
fn make_names_unique(cameras: &mut [Camera]) {
    for i in 1..cameras.len() {
        let (before, rest) = cameras.split_at_mut(i);
        let taken = |name: &str| before.iter().any(|c| c.name == name);
        let base = rest[0].name.clone();
        let mut n = 2;
        while taken(&rest[0].name) {
            rest[0].name = format!("{base}-{n}");
            n += 1;
        }
    }
}

/// Names the file in every error of one loader.
#[derive(Clone, Debug)]
pub(crate) struct Origin {
    pub file: PathBuf,
}

impl Origin {
    pub fn new(file: &Path) -> Self {
        Self {
            file: file.to_owned(),
        }
    }

    pub fn invalid(
        &self,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> SceneError {
        SceneError::Invalid {
            file: self.file.clone(),
            place: place.into(),
            expected: expected.into(),
            found: found.into(),
        }
    }

    /// Resolves a reference relative to the file's folder.
    pub fn sibling(&self, relative: &Path) -> PathBuf {
        self.file
            .parent()
            .map_or_else(|| relative.to_owned(), |folder| folder.join(relative))
    }
}

/// Reads a whole file, saying what refers to it.
pub(crate) fn read_file(file: &Path, place: &str) -> Result<Vec<u8>, SceneError> {
    std::fs::read(file).map_err(|reason| SceneError::Io {
        file: file.to_owned(),
        place: place.to_owned(),
        reason,
    })
}
