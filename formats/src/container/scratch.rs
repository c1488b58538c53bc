//! A folder for temporary files.

use super::atomic::{Listed, unfinished};
use std::io;
use std::path::Path;
use tempfile::TempDir;

/// Start of a folder's name.
const PREFIX: &str = ".scratch-";

/// A uniquely named folder that only its owner may enter. It is removed with its content when it is dropped, and when a signal ends the
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
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o700));
        }
        let folder = builder.tempdir_in(parent)?;
        listed.insert(folder.path().to_owned());
        Ok(Self {
            _listed: Listed(folder.path().to_owned()),
            folder,
        })
    }

    /// Whether a path has the name of such a folder.
    pub fn has_name_of(path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default();
        name.as_encoded_bytes().starts_with(PREFIX.as_bytes())
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}
