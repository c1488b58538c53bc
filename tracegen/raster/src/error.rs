//! Why a capture failed.

use record::RecordError;
use techniques::far_field::FarFieldError;
use visibility::TooWide;

impl RasterError {
    /// Whether another backend might support what this one does not.
    pub fn is_of_the_driver(&self) -> bool {
        matches!(
            self,
            Self::NoDriver(_) | Self::NotLoaded(_) | Self::Unsupported { .. }
        )
    }
}

/// Why a capture failed.
#[derive(Debug, thiserror::Error)]
pub enum RasterError {
    /// No usable driver.
    #[error(
        "no lavapipe (Mesa's CPU Vulkan driver) found{0}; install it with: apt-get install mesa-vulkan-drivers libvulkan1"
    )]
    NoDriver(String),
    /// A driver that is installed but does not start, with the reason.
    #[error("lavapipe (Mesa's CPU Vulkan driver) is installed and does not start: {0}")]
    NotLoaded(String),
    /// No adapter with that name.
    #[error("no adapter '{wanted}': expected a part of one of these names: {known}")]
    NoAdapter {
        /// The name as given.
        wanted: String,
        /// Names of the available adapters.
        known: String,
    },
    /// A driver without a feature that the capture needs.
    #[error("{driver} lacks {what}")]
    Unsupported {
        /// Driver string.
        driver: String,
        /// The missing feature.
        what: String,
    },
    /// The driver reported an error.
    #[error("the driver failed while {doing}: {message}")]
    Driver {
        /// The failed operation.
        doing: &'static str,
        /// The driver's message.
        message: String,
    },
    /// A quantity beyond the driver's limit.
    #[error("{what}: {found} exceeds the limit of {limit}")]
    TooLarge {
        /// The quantity that is too large.
        what: String,
        /// Its size.
        found: u64,
        /// Its largest allowed size.
        limit: u64,
    },
    /// Inconsistent input.
    #[error("{0}")]
    Scene(String),
    /// Eyes that the culling technique does not support.
    #[error(transparent)]
    Culling(#[from] TooWide),
    /// Eyes for which no far field can be made.
    #[error(transparent)]
    FarField(#[from] FarFieldError),
    /// The records could not be written as a trace.
    #[error(transparent)]
    Record(#[from] RecordError),
}
