//! The prefetcher of the L2: the `[prefetch]` table of a configuration.

use super::{ConfigError, Mode, accept};
pub use crate::memory::Prefetching;
use serde::{Deserialize, Serialize};

/// The `[prefetch]` table: which lines are fetched into the L2 before they are requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct PrefetchConfig {
    /// The prefetching algorithm.
    pub prefetcher: Prefetching,
    /// Maximum number of lines that one request can prefetch (default 4). For `aligned-block`: the
    /// lines of a block (4); for `next-mip`: the levels (1); for `tile-ahead`: the lines of an item
    /// (4096).
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
    /// Maximum number of lines that one request can prefetch.
    pub fn lines(&self) -> u32 {
        self.lines.unwrap_or_else(|| self.prefetcher.usual_lines())
    }

    /// True if the prefetcher only works for textures.
    pub fn needs_textures(&self) -> bool {
        self.build(16, None).needs_layout()
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is out of range, or a prefetcher that `mode` does not support.
    pub fn check(&self, mode: Mode) -> Result<(), ConfigError> {
        let (expected, accepts) = self.prefetcher.lines_rule();
        accept(
            accepts(self.lines()),
            "prefetch.lines",
            expected,
            self.lines(),
        )?;
        accept(
            mode == Mode::Timed || self.build(16, None).lines_of_next_item() == 0,
            "prefetch.prefetcher",
            "one that goes by requests, where time does not pass (functional mode)",
            self.prefetcher.name(),
        )
    }
}
