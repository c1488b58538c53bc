//! Errors of reading a trace's accesses.

use thiserror::Error;

/// Reasons why a trace's accesses cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StreamError {
    /// The trace file is damaged.
    #[error(transparent)]
    Format(#[from] formats::FormatError),
    /// A tile cannot be replayed.
    #[error("pass {pass} tile {tile}: {message}")]
    Tile {
        /// Pass index.
        pass: u32,
        /// Tile index.
        tile: u32,
        /// Description of the error.
        message: String,
    },
    /// The trace's tables contradict each other.
    #[error("trace tables: {0}")]
    Tables(String),
}
