//! The prefetcher of the L2: the `[prefetch]` table of a configuration.

use super::{ConfigError, Mode};
pub use crate::cache::Prefetching;
use serde::{Deserialize, Serialize};

/// The `[prefetch]` table: lines that are fetched into the L2 before they are requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PrefetchConfig {
    /// Which lines are prefetched, and when.
    pub prefetcher: Prefetching,
    /// Lines that one request can prefetch at most (4 unless given); for `aligned-block` the lines of a block (4), for `tile-ahead` those of an item (4096).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lines: Option<u32>,
}

impl Default for PrefetchConfig {
    fn default() -> Self {
        Self {
            prefetcher: Prefetching::NEXT_LINE,
            lines: None,
        }
    }
}

impl PrefetchConfig {
    /// Lines that one request can prefetch at most.
    #[must_use]
    pub fn lines(&self) -> u32 {
        self.lines.unwrap_or_else(|| self.prefetcher.usual_lines())
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first one out of range, or that `mode` does not have.
    pub fn check(&self, mode: Mode) -> Result<(), ConfigError> {
        let (expected, accepts) = self.prefetcher.lines_rule();
        if !accepts(self.lines()) {
            return Err(ConfigError::Range {
                key: "prefetch.lines",
                expected,
                found: self.lines().to_string(),
            });
        }
        if mode == Mode::Functional && self.build().lines_of_next_item() > 0 {
            return Err(ConfigError::Range {
                key: "prefetch.prefetcher",
                expected: "one that goes by requests, where time does not pass (functional mode)",
                found: self.prefetcher.name().to_owned(),
            });
        }
        Ok(())
    }
}
