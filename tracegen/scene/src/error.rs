//! Why a scene could not be loaded.

use std::path::PathBuf;

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
