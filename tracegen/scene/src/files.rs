//! The files of a scene: reading them, and naming them in errors.

use crate::error::SceneError;
use formats::container::{kind_of, open_regular};
use formats::text::printable;
use memmap2::Mmap;
use std::fs::Metadata;
use std::io::Read;
use std::ops::{Deref, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;

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

    /// An error whose parts may hold text from the file.
    pub fn invalid(
        &self,
        place: impl AsRef<str>,
        expected: impl AsRef<str>,
        found: impl AsRef<str>,
    ) -> SceneError {
        SceneError::Invalid {
            file: self.file.clone(),
            place: shown(place.as_ref()),
            expected: shown(expected.as_ref()),
            found: shown(found.as_ref()),
        }
    }

    /// The folder that references are relative to.
    pub fn folder(&self) -> &Path {
        self.file.parent().unwrap_or(Path::new(""))
    }

    /// Resolves a reference relative to the file's folder.
    pub fn sibling(&self, relative: &Path) -> PathBuf {
        self.folder().join(relative)
    }
}

/// Most characters of a file's text that a message quotes.
const QUOTED: usize = 300;

/// Text from a file as shown in a message: printable in a terminal and of bounded length.
pub(crate) fn shown(text: &str) -> String {
    match text.char_indices().nth(QUOTED) {
        Some((end, _)) => format!("{}...", printable(&text[..end])),
        None => printable(text).into_owned(),
    }
}

/// Every byte as the character of the same number.
pub(crate) fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&b| char::from(b)).collect()
}

/// Reads a whole regular file of at most `max_bytes`. Errors name `place`, which refers to it.
pub(crate) fn read_file(file: &Path, place: &str, max_bytes: u64) -> Result<Vec<u8>, SceneError> {
    let length = check_regular(file, place)?.len();
    if length > max_bytes {
        return Err(Origin::new(file).invalid(
            place,
            format!("a file of at most {max_bytes} bytes"),
            format!("{length} bytes"),
        ));
    }
    read(file, place, length)
}

/// The first `wanted` bytes of a regular file, or all of a shorter one. Also returns its length.
pub(crate) fn read_start(
    file: &Path,
    place: &str,
    wanted: u64,
) -> Result<(Bytes, u64), SceneError> {
    let length = check_regular(file, place)?.len();
    let bytes = length.min(wanted);
    if bytes < MAPPED_FROM_BYTES {
        return Ok((Bytes::Held(read(file, place, bytes)?), length));
    }
    let failed = |e| cannot_read(file, place, e);
    let opened = open_regular(file).map_err(failed)?;
    // SAFETY: the map is only read. A program that shortens the file meanwhile would end this one with
    // a bus error; exporters write a scene before it is captured.
    let map = unsafe { Mmap::map(&opened) }.map_err(failed)?;
    let range = 0..map.len().min(usize::try_from(bytes).unwrap_or(usize::MAX));
    let map = Arc::new(map);
    Ok((Bytes::Mapped { map, range }, length))
}

/// Files from this size on are mapped, so that only what a scene uses of them is read.
const MAPPED_FROM_BYTES: u64 = 1 << 24;

/// Bytes of a file or of a part of it.
#[derive(Debug)]
pub(crate) enum Bytes {
    /// In memory.
    Held(Vec<u8>),
    /// In a mapped file.
    Mapped {
        /// The file.
        map: Arc<Mmap>,
        /// The part.
        range: Range<usize>,
    },
}

impl Bytes {
    /// These bytes of the part, which a slice of it may outlive.
    pub fn part(&self, range: Range<usize>) -> Self {
        match self {
            Self::Held(bytes) => Self::Held(bytes.get(range).unwrap_or_default().to_vec()),
            Self::Mapped { map, range: own } => {
                let [start, end] = [range.start, range.end].map(|at| own.end.min(own.start + at));
                Self::Mapped {
                    map: Arc::clone(map),
                    range: start..end.max(start),
                }
            }
        }
    }

    /// Shortens the part to this many bytes.
    pub fn truncate(&mut self, bytes: usize) {
        match self {
            Self::Held(held) => held.truncate(bytes),
            Self::Mapped { range, .. } => range.end = range.end.min(range.start + bytes),
        }
    }
}

impl Default for Bytes {
    fn default() -> Self {
        Self::Held(Vec::new())
    }
}

impl Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Held(bytes) => bytes,
            Self::Mapped { map, range } => map.get(range.clone()).unwrap_or_default(),
        }
    }
}

/// The file's metadata, read before the file is opened: opening a FIFO would wait for a writer.
pub(crate) fn check_regular(file: &Path, place: &str) -> Result<Metadata, SceneError> {
    let metadata = std::fs::metadata(file).map_err(|e| cannot_read(file, place, e))?;
    if metadata.is_file() {
        return Ok(metadata);
    }
    Err(Origin::new(file).invalid(
        place,
        "a regular file (the files of a scene name each other by folder, so none can be a pipe)",
        kind_of(&metadata),
    ))
}

fn read(file: &Path, place: &str, length: u64) -> Result<Vec<u8>, SceneError> {
    let failed = |e| cannot_read(file, place, e);
    let mut bytes = Vec::new();
    bytes
        .try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))
        .map_err(|e| failed(std::io::Error::other(e)))?;
    let opened = open_regular(file).map_err(failed)?;
    opened
        .take(length)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    Ok(bytes)
}

fn cannot_read(file: &Path, place: &str, reason: std::io::Error) -> SceneError {
    SceneError::Io {
        file: file.to_owned(),
        place: shown(place),
        reason,
    }
}
