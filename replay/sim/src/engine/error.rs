//! Errors of replays.

use crate::config::ConfigError;
use crate::memory::OtherWork;
use crate::stream::StreamError;
use thiserror::Error;

/// Reasons why a replay fails.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// An impossible configuration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// An unreadable trace.
    #[error(transparent)]
    Trace(#[from] StreamError),
}

/// Checks that the lines of other work between frames are not lines of textures, which have `lines` lines.
///
/// # Errors
/// Textures with too many lines.
pub fn check_other_work(lines: u64) -> Result<(), StreamError> {
    OtherWork::check(lines).map_err(|most| {
        StreamError::Tables(format!(
            "expected at most {most} lines of textures if part of the caches is lost between frames, found {lines}"
        ))
    })
}
