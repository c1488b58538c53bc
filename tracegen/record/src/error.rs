//! Why records could not become a trace.

use crate::RECORD_BYTES;
use formats::FormatError;

/// Why records could not become a trace.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The smallest part of a view does not fit the capturer's memory.
    #[error(
        "tile ({tx}, {ty}) alone needs {needed} records of {RECORD_BYTES} bytes, the record budget holds {capacity}; raise the record budget"
    )]
    Budget {
        /// Tile column.
        tx: u32,
        /// Tile row.
        ty: u32,
        /// Records that the tile produces.
        needed: u64,
        /// Records that fit.
        capacity: u64,
    },
    /// The capturer broke its contract.
    #[error("a raw record: expected {expected}, found {found}")]
    Invalid {
        /// What the tables allow.
        expected: String,
        /// What was found.
        found: String,
    },
    /// An event of a [`crate::Recording`] came at the wrong time.
    #[error("an event of a recording: expected {expected}, found {found}")]
    Event {
        /// What must come first.
        expected: String,
        /// What was found.
        found: String,
    },
    /// The trace could not be written.
    #[error("writing the trace: {0}")]
    Write(#[from] FormatError),
}
