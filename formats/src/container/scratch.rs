//! A folder for files that nobody needs once the work is done.

use super::atomic::{Listed, unfinished};
use std::io;
use std::path::Path;
use tempfile::TempDir;

/// A folder of a name of its own, removed with all that it holds when it is dropped, and when a signal ends
/// the program.
#[derive(Debug)]
pub struct ScratchFolder {
    // Removed before it is taken off the list.
    folder: TempDir,
    _listed: Listed,
}

impl ScratchFolder {
    /// Makes one inside `parent`.
    ///
    /// # Errors
    /// `parent` does not exist or may not be written.
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

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}
