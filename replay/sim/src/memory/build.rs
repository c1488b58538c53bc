//! Builds the cache of a level: policy, victim cache and sectors.

use super::hashed_index::HashedIndex;
use super::policy::{AnyCache, Geometry, boxed};
use super::recorded::Recorded;
use super::sectored::Sectored;
use super::victim::WithVictimCache;
use crate::config::{ConfigError, LevelConfig, SetIndex};

impl AnyCache {
    /// Builds a cache.
    ///
    /// # Errors
    /// An impossible geometry, reported with `level`.
    pub fn build(
        config: &LevelConfig,
        level: &'static str,
        line_bytes: u32,
        seed: u64,
    ) -> Result<Self, ConfigError> {
        let geometry = Geometry {
            sets: config.sets(level, line_bytes)?,
            ways: config.ways,
            seed,
        };
        let mut cache = config.replacement.build(geometry);
        if config.set_index == SetIndex::Xor {
            cache = boxed(HashedIndex::new(cache.into_box(), geometry.sets));
        }
        if config.victim_lines > 0 {
            cache = boxed(WithVictimCache::new(cache.into_box(), config.victim_lines));
        }
        if config.sectors > 1 {
            cache = boxed(Sectored::new(cache.into_box(), config.sectors));
        }
        Ok(cache)
    }

    /// Wraps the cache so that it records the lines it evicts.
    #[must_use]
    pub(super) fn recording_evictions(self) -> Self {
        boxed(Recorded::evictions(self.into_box()))
    }

    /// Wraps the cache so that it records the changes of its content.
    #[must_use]
    pub(super) fn recording_changes(self) -> Self {
        boxed(Recorded::changes(self.into_box()))
    }
}
