//! Wavefront OBJ with MTL materials.

use super::load::{LoadOptions, Loaded, Origin, SceneError};
use std::path::Path;

/// Loads an OBJ file.
///
/// # Errors
/// See [`SceneError`].
pub fn load(path: &Path, _options: &LoadOptions) -> Result<Loaded, SceneError> {
    Err(Origin::new(path).invalid("file", "a glTF file", "an OBJ file"))
}
