//! Why the accesses of a trace cannot be had.

use thiserror::Error;

/// Why the accesses of a trace cannot be had.
#[derive(Debug, Error)]
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
        /// What is wrong there.
        message: String,
    },
    /// The trace's tables contradict each other.
    #[error("trace tables: {0}")]
    Tables(String),
}
