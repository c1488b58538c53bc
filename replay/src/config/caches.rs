//! The `[l1]` and `[l2]` tables of a configuration, and what they share with `[[level]]`.

use super::{ConfigError, MOST_LINES, MOST_SETS, is_zero};
use crate::cache::Replacement;
use crate::size::{format_bytes, serde_bytes};
use serde::{Deserialize, Serialize};

/// Geometry of one cache level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CacheConfig {
    /// Capacity in bytes.
    #[serde(with = "serde_bytes")]
    pub size_bytes: u64,
    /// Associativity.
    #[serde(default = "CacheConfig::default_ways")]
    pub ways: u32,
    /// Replacement policy.
    #[serde(default)]
    pub replacement: Replacement,
    /// Lines that share a tag (a sectored cache); a miss fetches one of them.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub sectors: u32,
    /// Lines of a fully associative victim cache beside it.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub victim_lines: u32,
    /// Whether it holds what the caches above hold (L2 only).
    #[serde(default, skip_serializing_if = "Inclusion::is_none")]
    pub inclusion: Inclusion,
}

pub(super) const fn one() -> u32 {
    1
}

pub(super) fn is_one(value: &u32) -> bool {
    *value == 1
}

impl CacheConfig {
    const fn default_ways() -> u32 {
        4
    }

    /// True for LRU and one line per tag, alone: what stack distances describe.
    #[must_use]
    pub fn is_plain_lru(&self) -> bool {
        *self
            == Self {
                ways: self.ways,
                ..Self::lru(self.size_bytes)
            }
    }

    /// A four-way LRU cache of this size.
    #[must_use]
    pub const fn lru(size_bytes: u64) -> Self {
        Self {
            size_bytes,
            ways: Self::default_ways(),
            replacement: Replacement::LRU,
            sectors: 1,
            victim_lines: 0,
            inclusion: Inclusion::None,
        }
    }

    /// Number of sets for this line size.
    ///
    /// # Errors
    /// The sets must be a power of two, the ways such as the policy can have.
    pub fn sets(&self, level: &'static str, line_bytes: u32) -> Result<u32, ConfigError> {
        let (expected, accepts) = self.replacement.ways_rule();
        if !accepts(self.ways) {
            return Err(ConfigError::Ways {
                level,
                policy: self.replacement.name(),
                expected,
                found: self.ways,
            });
        }
        self.check_parts(level)?;
        let bytes_per_set = u64::from(self.ways) * u64::from(line_bytes) * u64::from(self.sectors);
        let sets = self.size_bytes / bytes_per_set;
        let is_whole = self.size_bytes.is_multiple_of(bytes_per_set);
        if !is_whole || !sets.is_power_of_two() || sets > MOST_SETS {
            return Err(ConfigError::Sets {
                level,
                size: format_bytes(self.size_bytes),
                ways: self.ways,
                line_bytes,
                found: if is_whole {
                    sets.to_string()
                } else {
                    (self.size_bytes as f64 / bytes_per_set as f64).to_string()
                },
            });
        }
        self.check_lines(level, line_bytes, 1)?;
        Ok(sets as u32)
    }

    /// Checks that `caches` such caches have lines that this machine's memory can stand for.
    pub(super) fn check_lines(
        &self,
        level: &'static str,
        line_bytes: u32,
        caches: u32,
    ) -> Result<(), ConfigError> {
        let lines = self.size_bytes / u64::from(line_bytes);
        if lines.saturating_mul(caches.into()) > MOST_LINES {
            return Err(ConfigError::Lines {
                level,
                size: format_bytes(self.size_bytes),
                line_bytes,
                caches,
                found: lines,
            });
        }
        Ok(())
    }
}

/// Which lines of the levels above a level holds.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Inclusion {
    /// Levels evict independently.
    #[default]
    None,
    /// All of them: a line that the level evicts is invalidated in the levels above.
    Inclusive,
    /// None of them: the level holds what the level above evicted, and a hit moves the line up. Not for the L2.
    Exclusive,
}

impl Inclusion {
    /// True where levels evict independently.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::None
    }
}

/// Sectors of a tag at most: a bit each.
const MOST_SECTORS: u32 = 64;
/// A victim cache is searched line by line.
const MOST_VICTIMS: u32 = 1024;

impl CacheConfig {
    /// Checks sectors, victim cache and inclusion.
    pub(super) fn check_parts(&self, level: &'static str) -> Result<(), ConfigError> {
        let [sectors, victim_lines, inclusion] = match level {
            "L1" => ["l1.sectors", "l1.victim_lines", "l1.inclusion"],
            "L2" => ["l2.sectors", "l2.victim_lines", "l2.inclusion"],
            _ => ["level.sectors", "level.victim_lines", "level.inclusion"],
        };
        let refuse = |key, expected, found: String| {
            Err(ConfigError::Range {
                key,
                expected,
                found,
            })
        };
        let name = |inclusion: Inclusion| format!("{inclusion:?}").to_lowercase();
        if !self.sectors.is_power_of_two() || self.sectors > MOST_SECTORS {
            return refuse(
                sectors,
                "a power of two from 1 to 64",
                self.sectors.to_string(),
            );
        }
        if self.victim_lines > MOST_VICTIMS {
            return refuse(victim_lines, "0 to 1024", self.victim_lines.to_string());
        }
        match (level, self.inclusion) {
            (_, Inclusion::None) => Ok(()),
            ("L1", other) => refuse(inclusion, "none", name(other)),
            ("L2", Inclusion::Exclusive) => {
                refuse(inclusion, "none or inclusive", "exclusive".to_owned())
            }
            (_, other) if self.sectors > 1 => refuse(
                sectors,
                "1 in a level with an inclusion",
                format!("{} ({})", self.sectors, name(other)),
            ),
            _ => Ok(()),
        }
    }
}
