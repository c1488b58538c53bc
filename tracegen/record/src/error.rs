//! Errors of converting records to a trace.

use crate::RECORD_BYTES;
use formats::FormatError;

/// Errors of converting records to a trace.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The records of a single tile do not fit the capturer's memory.
    #[error(
        "tile ({tx}, {ty}) alone needs {needed} records of {RECORD_BYTES} bytes, the record budget holds {capacity}; raise the record budget"
    )]
    Budget {
        /// Tile column.
        tx: u32,
        /// Tile row.
        ty: u32,
        /// Number of records of the tile.
        needed: u64,
        /// Number of records that fit.
        capacity: u64,
    },
    /// The capturer violated its contract.
    #[error("a raw record: expected {expected}, found {found}")]
    Invalid {
        /// What the tables allow.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A method of [`crate::Recording`] was called at the wrong time.
    #[error("an event of a recording: expected {expected}, found {found}")]
    Event {
        /// The call that must come first.
        expected: String,
        /// What was found.
        found: String,
    },
    /// Writing the trace failed.
    #[error("writing the trace: {0}")]
    Write(#[from] FormatError),
}
