//! Why a scene could not be loaded.

use formats::text::printable;
use std::path::{Path, PathBuf};

/// Why a scene could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A name that has no known extension and is not a built-in scene.
    #[error("unknown scene '{spec}': expected a .gltf, .glb or .obj file{or_built_in}")]
    Unknown {
        /// The name as given.
        spec: String,
        /// Names of the built-in scenes; empty where they are not allowed.
        or_built_in: String,
    },
    /// A built-in scene with an invalid parameter.
    #[error("scene '{spec}': expected {expected}")]
    Parameter {
        /// The name as given.
        spec: String,
        /// The valid parameters.
        expected: String,
    },
    /// A file that cannot be read.
    #[error("{}: {place}: cannot read: {reason}", path(file))]
    Io {
        /// The file.
        file: PathBuf,
        /// The place that refers to it.
        place: String,
        /// The system's error.
        reason: std::io::Error,
    },
    /// A file with invalid contents.
    #[error("{}: {place}: expected {expected}, found {found}", path(file))]
    Invalid {
        /// The file.
        file: PathBuf,
        /// The place in the file.
        place: String,
        /// What is expected.
        expected: String,
        /// What was found.
        found: String,
    },
}

/// What is expected and found where a file needs a decoder that this program is built without.
#[cfg(not(all(feature = "basis", feature = "draco", feature = "meshopt")))]
pub(crate) fn without_feature(feature: &str) -> (String, String) {
    let expected = format!("a program with the feature `{feature}` (`make build`)");
    (expected, "one without it".to_owned())
}

/// A path as shown in a message. A scene file may name paths with any characters in them.
fn path(file: &Path) -> String {
    printable(&file.to_string_lossy()).into_owned()
}
