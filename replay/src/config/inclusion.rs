//! Whether a cache level holds the lines of the levels above it.

use super::{CacheConfig, ConfigError};
use serde::{Deserialize, Serialize};

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
