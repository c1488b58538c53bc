//! The files of a scene: reading them, and naming them in errors.

use crate::error::SceneError;
use std::path::{Path, PathBuf};

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
