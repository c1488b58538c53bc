//! A folder for temporary files.

use super::atomic::{Listed, unfinished};
use std::io;
use std::path::Path;
use tempfile::TempDir;

/// A uniquely named folder. It is removed with its content when it is dropped, and when a signal ends the
/// program.
#[derive(Debug)]
pub struct ScratchFolder {
    // The folder is removed before its entry in the list.
    folder: TempDir,
    _listed: Listed,
}

impl ScratchFolder {
    /// Creates a folder inside `parent`.
    ///
    /// # Errors
    /// `parent` does not exist or is not writable.
    pub fn create_in(parent: &Path) -> io::Result<Self> {
        let mut listed = unfinished();
        let folder = tempfile::Builder::new()
            .prefix(".scratch-")
            .tempdir_in(parent)?;
        listed.insert(folder.path().to_owned());
        Ok(Self {
            _listed: Listed(folder.path().to_owned()),
            folder,
        })
    }

    /// Path of the folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}
