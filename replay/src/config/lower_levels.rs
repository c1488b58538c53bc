//! Cache levels below the L2: the `[[level]]` tables of a configuration.

use super::caches::{is_one, one};
use super::{CacheConfig, ConfigError, Inclusion, is_zero};
use crate::cache::Replacement;
use crate::size::{format_bytes, serde_bytes};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A level below the L2, shared by all cores: a `[[level]]` table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevelConfig {
    /// Capacity in bytes.
    #[serde(with = "serde_bytes")]
    pub size_bytes: u64,
    /// Associativity.
    #[serde(default = "LevelConfig::default_ways")]
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
    /// Whether it holds what the level above holds.
    #[serde(default, skip_serializing_if = "Inclusion::is_none")]
    pub inclusion: Inclusion,
    /// Line size in bytes; none: that of the level above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line_bytes: Option<u32>,
    /// Cycles that a line from this level takes to the L2, in place of `tmu.l2_penalty_cycles`.
    #[serde(default = "LevelConfig::default_hit_cycles")]
    pub hit_cycles: u32,
}

impl LevelConfig {
    const fn default_ways() -> u32 {
        16
    }

    const fn default_hit_cycles() -> u32 {
        60
    }

    /// A 16-way LRU level of this size, with the lines of the level above.
    #[must_use]
    pub const fn lru(size_bytes: u64) -> Self {
        Self {
            size_bytes,
            ways: Self::default_ways(),
            replacement: Replacement::LRU,
            sectors: 1,
            victim_lines: 0,
            inclusion: Inclusion::None,
            line_bytes: None,
            hit_cycles: Self::default_hit_cycles(),
        }
    }

    /// The cache alone.
    #[must_use]
    pub const fn cache(&self) -> CacheConfig {
        CacheConfig {
            size_bytes: self.size_bytes,
            ways: self.ways,
            replacement: self.replacement,
            sectors: self.sectors,
            victim_lines: self.victim_lines,
            inclusion: self.inclusion,
        }
    }
}

/// The levels below the L2, the L3 first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LowerLevels([Option<LevelConfig>; LowerLevels::MOST]);

impl LowerLevels {
    /// Levels below the L2 at most.
    pub const MOST: usize = 4;

    /// Their names.
    pub const NAMES: [&'static str; Self::MOST] = ["L3", "L4", "L5", "L6"];

    /// So many levels, [`Self::MOST`] at most.
    #[must_use]
    pub fn of(levels: &[LevelConfig]) -> Option<Self> {
        let mut all = Self::default();
        for (index, level) in levels.iter().enumerate() {
            *all.0.get_mut(index)? = Some(*level);
        }
        Some(all)
    }

    /// True without any.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.0[0].is_none()
    }

    /// The levels, the L3 first.
    pub fn iter(&self) -> impl Iterator<Item = &LevelConfig> {
        self.0.iter().flatten()
    }

    /// The L3, which is added if there is none.
    pub fn l3(&mut self, size_bytes: u64) {
        match &mut self.0[0] {
            Some(level) => level.size_bytes = size_bytes,
            none => *none = Some(LevelConfig::lru(size_bytes)),
        }
    }

    /// Each level with its name and its line size in bytes, under an L2 with such lines.
    pub fn named(
        &self,
        l2_line_bytes: u32,
    ) -> impl Iterator<Item = (&'static str, &LevelConfig, u32)> {
        let mut above = l2_line_bytes;
        self.iter().zip(Self::NAMES).map(move |(level, name)| {
            above = level.line_bytes.unwrap_or(above);
            (name, level, above)
        })
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first one out of range.
    pub fn check(&self, l2_line_bytes: u32, l2: &CacheConfig) -> Result<(), ConfigError> {
        let mut above = l2_line_bytes;
        let mut above_sectors = l2.sectors;
        for (name, level, line_bytes) in self.named(l2_line_bytes) {
            let range = |ok: bool, key, expected, found: u32| match ok {
                true => Ok(()),
                false => Err(ConfigError::Range {
                    key,
                    expected,
                    found: format!("{found} ({name})"),
                }),
            };
            range(
                line_bytes.is_power_of_two() && (above..=4096).contains(&line_bytes),
                "level.line_bytes",
                "a power of two from the line size of the level above to 4096",
                line_bytes,
            )?;
            range(
                level.hit_cycles <= 100_000,
                "level.hit_cycles",
                "0 to 100000",
                level.hit_cycles,
            )?;
            level.cache().sets(name, line_bytes)?;
            if level.inclusion == Inclusion::Exclusive && (line_bytes != above || above_sectors > 1)
            {
                return Err(ConfigError::Range {
                    key: "level.inclusion",
                    expected: "none or inclusive, unless the level above has lines of the same size and one per tag",
                    found: format!("exclusive ({name})"),
                });
            }
            (above, above_sectors) = (line_bytes, level.sectors);
        }
        Ok(())
    }

    /// In words, for a column: `4 MiB, 16 ways, lru, 64-byte lines, 60 cycles; ...`. None without levels.
    #[must_use]
    pub fn text(&self, l2_line_bytes: u32) -> Option<String> {
        let level = |(_, level, line_bytes): (_, &LevelConfig, u32)| {
            let mut text = format!(
                "{}, {} ways, {}, {line_bytes}-byte lines, {} cycles",
                format_bytes(level.size_bytes),
                level.ways,
                level.replacement.name(),
                level.hit_cycles
            );
            if level.sectors > 1 {
                text += &format!(", {} sectors", level.sectors);
            }
            if level.victim_lines > 0 {
                text += &format!(", {} victim lines", level.victim_lines);
            }
            match level.inclusion {
                Inclusion::None => {}
                Inclusion::Inclusive => text += ", inclusive",
                Inclusion::Exclusive => text += ", exclusive",
            }
            text
        };
        let all: Vec<String> = self.named(l2_line_bytes).map(level).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }
}

impl Serialize for LowerLevels {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl<'de> Deserialize<'de> for LowerLevels {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let levels = Vec::<LevelConfig>::deserialize(deserializer)?;
        Self::of(&levels).ok_or_else(|| {
            de::Error::invalid_length(levels.len(), &"at most 4 levels below the L2")
        })
    }
}
