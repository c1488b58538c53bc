//! The prefetcher of the L2: the `[prefetch]` table of a configuration.

use super::ConfigError;
pub use crate::cache::Prefetching;
use serde::{Deserialize, Serialize};

/// The `[prefetch]` table: lines that are fetched into the L2 before they are requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PrefetchConfig {
    /// Which lines are prefetched, and when.
    pub prefetcher: Prefetching,
    /// Lines that one request can prefetch at most; for `aligned-block`, a power of two: the lines of a block.
    pub lines: u32,
}

impl Default for PrefetchConfig {
    fn default() -> Self {
        Self {
            prefetcher: Prefetching::NEXT_LINE,
            lines: 4,
        }
    }
}

impl PrefetchConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first one out of range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let (expected, accepts) = self.prefetcher.lines_rule();
        match accepts(self.lines) {
            true => Ok(()),
            false => Err(ConfigError::Range {
                key: "prefetch.lines",
                expected,
                found: self.lines.to_string(),
            }),
        }
    }
}
