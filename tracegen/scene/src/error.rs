//! Why a scene could not be loaded.

use formats::text::printable;
use std::path::{Path, PathBuf};

/// Why a scene could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A name without a known extension that is no built-in scene's.
    #[error("unknown scene '{spec}': expected a .gltf, .glb or .obj file{or_built_in}")]
    Unknown {
        /// As given.
        spec: String,
        /// Names the built-in scenes, or is empty where they are not meant.
        or_built_in: String,
    },
    /// A built-in scene with a parameter that it cannot have.
    #[error("scene '{spec}': expected {expected}")]
    Parameter {
        /// As given.
        spec: String,
        /// What can be asked for.
        expected: String,
    },
    /// A file that cannot be read.
    #[error("{}: {place}: cannot read: {reason}", path(file))]
    Io {
        /// The file.
        file: PathBuf,
        /// What refers to it.
        place: String,
        /// The system's error.
        reason: std::io::Error,
    },
    /// A file that is not what it claims to be.
    #[error("{}: {place}: expected {expected}, found {found}", path(file))]
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

/// A path as a message shows it: a scene file may name paths with anything in them.
fn path(file: &Path) -> String {
    printable(&file.to_string_lossy()).into_owned()
}
