//! Errors that name the file, the place, what was expected and what was found.

use crate::chunk_tag::ChunkTag;
use std::fmt;
use std::io;
use thiserror::Error;

/// Result of the functions that read or write traces.
pub type Result<T, E = FormatError> = std::result::Result<T, E>;

/// Part of a file that an error refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The fixed header at the start.
    Header,
    /// The chunk directory at the end.
    Directory,
    /// A chunk.
    Chunk(ChunkTag),
    /// The whole content of a file of plain accesses.
    Contents,
    /// A line of text, counted from 1.
    Line(u64),
    /// An access, counted from 1.
    Access(u64),
    /// A gem5 packet, counted from 1.
    Packet(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Header => f.write_str("header"),
            Self::Directory => f.write_str("chunk directory"),
            Self::Chunk(tag) => write!(f, "chunk {tag}"),
            Self::Contents => f.write_str("contents"),
            Self::Line(number) => write!(f, "line {number}"),
            Self::Access(number) => write!(f, "access {number}"),
            Self::Packet(number) => write!(f, "packet {number}"),
        }
    }
}

/// Errors of reading or writing a trace.
#[derive(Debug, Error)]
pub enum FormatError {
    /// An error of the operating system.
    #[error("{file}: cannot {action}")]
    Io {
        /// File as named by the user.
        file: String,
        /// The action that failed: `open`, `write`, ...
        action: &'static str,
        /// The system's error.
        #[source]
        source: io::Error,
    },
    /// Bytes that violate the specification.
    #[error("{file}: {place} at byte {offset}: expected {expected}, found {found}")]
    Malformed {
        /// File as named by the user.
        file: String,
        /// Part of the file.
        place: Place,
        /// Offset from the start of the file.
        offset: u64,
        /// What the specification requires there.
        expected: String,
        /// What was found there.
        found: String,
    },
    /// A request for something that the trace does not have.
    #[error("{file}: no {what} {index}, the trace has {count}")]
    OutOfRange {
        /// File as named by the user.
        file: String,
        /// `pass`, `tile`, ...
        what: &'static str,
        /// Requested index.
        index: u64,
        /// Number of available items.
        count: u64,
    },
    /// Data to be written that violates an invariant of the format.
    #[error("cannot write {what}: expected {expected}, found {found}")]
    Unwritable {
        /// What was to be written: `tile record 12`, `draw 3`, ...
        what: String,
        /// The invariant.
        expected: String,
        /// The value.
        found: String,
    },
}

impl FormatError {
    pub(crate) fn io(file: &str, action: &'static str, source: io::Error) -> Self {
        Self::Io {
            file: file.to_owned(),
            action,
            source,
        }
    }

    pub(crate) fn malformed(
        file: &str,
        place: Place,
        offset: u64,
        expected: impl fmt::Display,
        found: impl fmt::Display,
    ) -> Self {
        Self::Malformed {
            file: file.to_owned(),
            place,
            offset,
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }

    /// Offset of the first bad byte, if the error has one.
    pub fn offset(&self) -> Option<u64> {
        match self {
            Self::Malformed { offset, .. } => Some(*offset),
            _ => None,
        }
    }
}

/// A violated rule, in data that were read or are to be written, or in settings.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{what}: expected {expected}, found {found}")]
pub struct Broken {
    /// What violates it: `run 3`, `record 12`, `the display`.
    pub what: String,
    /// The rule.
    pub expected: String,
    /// What was found.
    pub found: String,
}

impl Broken {
    /// Describes a violated rule.
    pub fn new(what: impl Into<String>, expected: impl Into<String>, found: impl ToString) -> Self {
        Self {
            what: what.into(),
            expected: expected.into(),
            found: found.to_string(),
        }
    }

    /// The corresponding error for data to be written.
    pub fn unwritable(self) -> FormatError {
        FormatError::Unwritable {
            what: self.what,
            expected: self.expected,
            found: self.found,
        }
    }
}

/// A name that nothing has.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{what} '{name}': expected {known}")]
pub struct UnknownName {
    /// What was looked up: `unknown display`, `no camera`.
    pub what: &'static str,
    /// The name as given.
    pub name: String,
    /// The known names: `one of a, b`.
    pub known: String,
}

/// Fails unless `holds`. The texts are only formatted for a failure.
///
/// # Errors
/// It does not hold.
pub fn ensure(
    holds: bool,
    what: impl fmt::Display,
    expected: impl fmt::Display,
    found: impl fmt::Display,
) -> Result<(), Broken> {
    match holds {
        true => Ok(()),
        false => Err(Broken::new(what.to_string(), expected.to_string(), found)),
    }
}
