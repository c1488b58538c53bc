//! A folder of files under keys that does not exceed a size: what caches between runs share.
//!
//! Files are written under a temporary name, renamed, and never changed, so any number of processes can share
//! the folder without a lock. Opening a file sets its modification time. When a new file exceeds the size
//! limit, the least recently used files are removed until an eighth of the limit is free.
//!
//! The folder has no errors: one that cannot be read or written is treated as empty.

use crate::container::{AtomicFile, open_regular};
use std::fs::{self, File};
use std::io;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime};

/// Age after which an unfinished file counts as left behind by a killed run.
pub const ABANDONED: Duration = Duration::from_secs(24 * 3600);

/// See the module.
#[derive(Debug)]
pub struct BoundedFolder {
    folder: PathBuf,
    extension: &'static str,
    limit_bytes: u64,
    /// Size of the folder's files in bytes as far as this process knows; `None` before the first check.
    used_bytes: Mutex<Option<u64>>,
}

impl BoundedFolder {
    /// Files with an extension in `folder`, which is created with the first file, of at most `limit_bytes`
    /// bytes together.
    pub fn new(folder: PathBuf, extension: &'static str, limit_bytes: u64) -> Self {
        Self {
            folder,
            extension,
            limit_bytes,
            used_bytes: Mutex::new(None),
        }
    }

    /// The path of a key's file.
    pub fn path(&self, key: u128) -> PathBuf {
        self.folder.join(format!("{key:032x}.{}", self.extension))
    }

    /// Opens a key's file for reading.
    pub fn open(&self, key: u128) -> Option<File> {
        open_regular(&self.path(key)).ok()
    }

    /// Marks a file as used. Only eviction uses this, so a failure has no effect here.
    pub fn mark_used(file: &File) {
        let _ = file.set_modified(SystemTime::now());
    }

    /// Whether a file of this size may be stored.
    pub fn holds(&self, bytes: u64) -> bool {
        bytes <= self.limit_bytes
    }

    /// Stores a file of `bytes` bytes, which `write` writes. A failure is ignored.
    pub fn store(
        &self,
        key: u128,
        bytes: u64,
        write: impl FnOnce(&mut AtomicFile) -> io::Result<()>,
    ) {
        if !self.holds(bytes) || fs::create_dir_all(&self.folder).is_err() {
            return;
        }
        let mut used = self
            .used_bytes
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if used.is_none_or(|used| used + bytes > self.limit_bytes) {
            *used = Some(self.make_room(bytes));
        }
        let written = AtomicFile::create(&self.path(key)).and_then(|mut file| {
            write(&mut file)?;
            file.persist()
        });
        if written.is_ok() {
            *used = used.map(|used| used + bytes);
        }
    }

    /// If `needed_bytes` more would exceed the limit, removes the least recently used files until an eighth
    /// of the limit is also free. Returns the size of the remaining files.
    fn make_room(&self, needed_bytes: u64) -> u64 {
        let now = SystemTime::now();
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            let Ok(metadata) = entry.metadata() else {
                continue;
            };
            let modified = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            let path = entry.path();
            if path.extension().is_some_and(|e| e == self.extension) && metadata.is_file() {
                files.push((modified, path, metadata.len()));
            } else if path.extension().is_some_and(|e| e == "part")
                && now
                    .duration_since(modified)
                    .is_ok_and(|age| age > ABANDONED)
            {
                let _ = fs::remove_file(path);
            }
        }
        let mut used: u64 = files.iter().map(|(.., bytes)| bytes).sum();
        if used + needed_bytes <= self.limit_bytes {
            return used;
        }
        files.sort();
        let allowed = (self.limit_bytes - self.limit_bytes / 8).saturating_sub(needed_bytes);
        for (_, path, bytes) in files {
            if used <= allowed {
                break;
            }
            if fs::remove_file(path).is_ok() {
                used -= bytes;
            }
        }
        used
    }
}
