//! Why a capture failed.

use record::RECORD_BYTES;

/// Why a capture failed.
#[derive(Debug, thiserror::Error)]
pub enum RasterError {
    /// No usable driver.
    #[error(
        "no lavapipe (Mesa's CPU Vulkan driver) found{0}; install it with: apt-get install mesa-vulkan-drivers libvulkan1"
    )]
    NoDriver(String),
    /// A driver that lacks what the capture needs.
    #[error("{driver} lacks {what}")]
    Unsupported {
        /// Driver string.
        driver: String,
        /// What is missing.
        what: String,
    },
    /// The driver reported an error.
    #[error("the driver failed while {doing}: {message}")]
    Driver {
        /// What was being done.
        doing: &'static str,
        /// Its message.
        message: String,
    },
    /// Something is larger than the driver takes.
    #[error("{what}: {found} exceeds the limit of {limit}")]
    TooLarge {
        /// What is too large.
        what: String,
        /// How large it is.
        found: u64,
        /// How large it may be.
        limit: u64,
    },
    /// The smallest part of a frame does not fit the record buffer.
    #[error(
        "tile ({tx}, {ty}) alone needs {needed} records of {RECORD_BYTES} bytes, the record budget holds {capacity}; raise --record-budget"
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
    /// Inconsistent input.
    #[error("{0}")]
    Scene(String),
    /// The trace could not be written.
    #[error("writing the trace: {0}")]
    Write(String),
}
