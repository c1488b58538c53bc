//! The cache levels of a machine: the `[[level]]` tables of a configuration, L1 first.

use super::{ConfigError, Inclusion, LevelClients, LevelConfig, SetIndex, accept};
use crate::memory::Replacement;
use crate::size::{format_bytes, serde_bytes};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt::Display;

/// The levels between the texture units and memory. Each level receives the misses of the level above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Levels {
    /// First level.
    pub l1: LevelConfig,
    /// Second level, with the same line size as the first.
    pub l2: LevelConfig,
    /// Further levels, L3 first.
    lower: [Option<LevelConfig>; Levels::MOST - 2],
}

/// A `[[level]]` table of a file. The defaults of missing keys depend on the level.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LevelTable {
    #[serde(deserialize_with = "serde_bytes::deserialize")]
    size_bytes: u64,
    ways: Option<u32>,
    #[serde(default)]
    replacement: Replacement,
    #[serde(default)]
    set_index: SetIndex,
    sectors: Option<u32>,
    #[serde(default)]
    victim_lines: u32,
    #[serde(default)]
    inclusion: Inclusion,
    line_bytes: Option<u32>,
    shared: Option<bool>,
    hit_cycles: Option<u32>,
    #[serde(default)]
    clients: LevelClients,
}

impl LevelTable {
    fn level(&self, index: usize) -> LevelConfig {
        let usual = Levels::usual(index, self.size_bytes);
        LevelConfig {
            ways: self.ways.unwrap_or(usual.ways),
            replacement: self.replacement,
            set_index: self.set_index,
            sectors: self.sectors.unwrap_or(1),
            victim_lines: self.victim_lines,
            inclusion: self.inclusion,
            line_bytes: self.line_bytes,
            shared: self.shared.unwrap_or(usual.shared),
            hit_cycles: self.hit_cycles.unwrap_or(usual.hit_cycles),
            clients: self.clients,
            ..usual
        }
    }
}

impl Levels {
    /// Maximum number of levels.
    pub const MOST: usize = 6;

    /// Names of the levels.
    pub const NAMES: [&'static str; Self::MOST] = ["L1", "L2", "L3", "L4", "L5", "L6"];

    /// The default level of this size: the Z2 paper's L1 and L2 (section 4.1), and 16 ways and 60
    /// cycles below them.
    pub const fn usual(index: usize, size_bytes: u64) -> LevelConfig {
        let lru = LevelConfig::lru(size_bytes);
        match index {
            0 => LevelConfig {
                shared: false,
                ..lru
            },
            1 => LevelConfig {
                hit_cycles: 20,
                ..lru
            },
            _ => LevelConfig {
                ways: 16,
                hit_cycles: 60,
                ..lru
            },
        }
    }

    /// An L1 and an L2 with default latencies and sharing.
    pub const fn two(l1: LevelConfig, l2: LevelConfig) -> Self {
        Self {
            l1: LevelConfig {
                shared: false,
                hit_cycles: 0,
                ..l1
            },
            l2: LevelConfig {
                hit_cycles: 20,
                ..l2
            },
            lower: [None; Self::MOST - 2],
        }
    }

    /// Returns these levels with `lower` below the L2, or none if there are too many.
    pub fn over(mut self, lower: &[LevelConfig]) -> Option<Self> {
        self.lower = [None; Self::MOST - 2];
        for (index, level) in lower.iter().enumerate() {
            *self.lower.get_mut(index)? = Some(*level);
        }
        Some(self)
    }

    /// The levels below the L2.
    pub fn lower(&self) -> impl Iterator<Item = &LevelConfig> {
        self.lower.iter().flatten()
    }

    /// True with levels below the L2.
    pub(super) const fn has_lower(&self) -> bool {
        self.lower[0].is_some()
    }

    /// Sets the size of the L3, adding the level if there is none.
    pub fn set_l3(&mut self, size_bytes: u64) {
        match &mut self.lower[0] {
            Some(level) => level.size_bytes = size_bytes,
            none => *none = Some(Self::usual(2, size_bytes)),
        }
    }

    /// All levels, L1 first.
    pub fn iter(&self) -> impl Iterator<Item = &LevelConfig> {
        [&self.l1, &self.l2].into_iter().chain(self.lower())
    }

    /// Each level with its name and its line size in bytes, given the L1's line size.
    pub fn named(
        &self,
        l1_line_bytes: u32,
    ) -> impl Iterator<Item = (&'static str, &LevelConfig, u32)> {
        let mut above = l1_line_bytes;
        self.iter().zip(Self::NAMES).map(move |(level, name)| {
            above = level.line_bytes.unwrap_or(above);
            (name, level, above)
        })
    }

    /// True if the content of a level depends on what other levels evict.
    pub fn depend_on_evictions(&self) -> bool {
        self.iter().any(|level| !level.inclusion.is_none())
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub fn check(&self, l1_line_bytes: u32, cores: u32) -> Result<(), ConfigError> {
        let mut above = LevelConfig {
            line_bytes: Some(l1_line_bytes),
            ..LevelConfig::lru(0)
        };
        for (index, (name, level, line_bytes)) in self.named(l1_line_bytes).enumerate() {
            let above_bytes = above.line_bytes.unwrap_or(l1_line_bytes);
            let (is_first, is_exclusive) = (index == 0, level.inclusion == Inclusion::Exclusive);
            let is_sized =
                line_bytes.is_power_of_two() && (above_bytes..=4096).contains(&line_bytes);
            let (takes_line, expected) = match index {
                0 | 1 => (
                    level.line_bytes.is_none(),
                    "none in the L1 and the L2, which have the machine's line_bytes",
                ),
                _ => (
                    is_sized,
                    "a power of two from the line size of the level above to 4096",
                ),
            };
            let found = |value: &dyn Display| format!("{value} ({name})");
            accept(takes_line, "level.line_bytes", expected, found(&line_bytes))?;
            level.sets(name, line_bytes)?;
            level.check_lines(name, line_bytes, level.caches(cores))?;
            accept(
                !is_first || level.hit_cycles == 0,
                "level.hit_cycles",
                "0 in the L1, whose hits take no time",
                found(&level.hit_cycles),
            )?;
            let is_placed = match index {
                0 => !level.shared,
                1 => true,
                _ => level.shared || !above.shared,
            };
            accept(
                is_placed,
                "level.shared",
                "false in the L1, which belongs to a texture unit, and true below a shared level",
                found(&level.shared),
            )?;
            accept(
                !is_first || level.clients.is_textures(),
                "level.clients",
                "textures in the L1, which belongs to a texture unit",
                found(&"all"),
            )?;
            let inclusion = format!("{:?} ({name})", level.inclusion).to_lowercase();
            for (is_refused, expected) in [
                (is_first, "none in the L1"),
                (index == 1 && is_exclusive, "none or inclusive in the L2"),
                (!level.shared, "none in a level of each core"),
                (level.sectors > 1, "none in a level with sectors"),
                (
                    is_exclusive && !above.shared,
                    "none or inclusive below a level of each core",
                ),
                (
                    is_exclusive && (line_bytes != above_bytes || above.sectors > 1),
                    "none or inclusive, unless the level above has lines of the same size and one per tag",
                ),
            ] {
                let is_refused = is_refused && !level.inclusion.is_none();
                accept(!is_refused, "level.inclusion", expected, &inclusion)?;
            }
            above = LevelConfig {
                line_bytes: Some(line_bytes),
                ..*level
            };
        }
        Ok(())
    }

    /// Describes the levels below the L2 for a column: `4 MiB, 16 ways, lru, 64-byte lines, 60
    /// cycles; ...`. None without such levels.
    pub fn lower_text(&self, l1_line_bytes: u32) -> Option<String> {
        let level = |(_, level, line_bytes): (_, &LevelConfig, u32)| {
            let mut text = format!(
                "{}, {} ways, {}, {line_bytes}-byte lines, {} cycles",
                format_bytes(level.size_bytes),
                level.ways,
                level.replacement.name(),
                level.hit_cycles
            );
            if level.set_index != SetIndex::Modulo {
                text += &format!(", {} index", level.set_index.name());
            }
            if level.sectors > 1 {
                text += &format!(", {} sectors", level.sectors);
            }
            if level.victim_lines > 0 {
                text += &format!(", {} victim lines", level.victim_lines);
            }
            if !level.inclusion.is_none() {
                text += &format!(", {:?}", level.inclusion).to_lowercase();
            }
            if !level.shared {
                text += ", one per core";
            }
            if !level.clients.is_textures() {
                text += ", all clients";
            }
            text
        };
        let all: Vec<String> = self.named(l1_line_bytes).skip(2).map(level).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }
}

/// The Z2 paper's L1 and L2 (section 4.1).
impl Default for Levels {
    fn default() -> Self {
        Self::two(LevelConfig::lru(8 << 10), LevelConfig::lru(128 << 10))
    }
}

impl Serialize for Levels {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl<'de> Deserialize<'de> for Levels {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let tables = Vec::<LevelTable>::deserialize(deserializer)?;
        let mut levels = (0..).zip(&tables).map(|(index, table)| table.level(index));
        let wrong = || de::Error::invalid_length(tables.len(), &"2 to 6 levels, the L1 first");
        let (Some(l1), Some(l2)) = (levels.next(), levels.next()) else {
            return Err(wrong());
        };
        let two = Self {
            l1,
            l2,
            lower: [None; Self::MOST - 2],
        };
        two.over(&levels.collect::<Vec<_>>()).ok_or_else(wrong)
    }
}
