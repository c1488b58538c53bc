//! One cache level: a `[[level]]` table of a configuration.

use super::{ConfigError, MOST_LINES, MOST_SETS, accept, is_default};
use crate::memory::Replacement;
use crate::size::format_bytes;
use serde::Serialize;

/// Ways up to this number are proposed where a size is not possible.
const MOST_NAMED_WAYS: u32 = 64;

crate::choices! { #[non_exhaustive] SetIndex = "How a line's set follows from its number.", default Modulo:
    Modulo = "modulo", "Its low bits.";
    Xor = "xor", "Its low bits XOR each further group of as many bits.";
}

/// A cache level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct LevelConfig {
    /// Capacity in bytes.
    pub size_bytes: u64,
    /// Associativity.
    pub ways: u32,
    /// Replacement policy.
    pub replacement: Replacement,
    /// How a line's set follows from its number.
    #[serde(skip_serializing_if = "is_default")]
    pub set_index: SetIndex,
    /// Lines per tag (a sectored cache); a miss fetches one line.
    #[serde(skip_serializing_if = "is_one")]
    pub sectors: u32,
    /// Lines of the fully associative victim cache next to it; 0: none.
    #[serde(skip_serializing_if = "is_default")]
    pub victim_lines: u32,
    /// Which lines of the levels above this level holds.
    #[serde(skip_serializing_if = "is_default")]
    pub inclusion: Inclusion,
    /// Line size in bytes, only below the L2; default: that of the level above.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_bytes: Option<u32>,
    /// One cache for all cores; otherwise one cache per core.
    pub shared: bool,
    /// Cycles in which a line travels from this level to the level above; 0 for the L1.
    pub hit_cycles: u32,
    /// Whose lines it holds. Only used with a `[frame]` table.
    #[serde(skip_serializing_if = "is_default")]
    pub clients: LevelClients,
}

pub(super) fn is_one(value: &u32) -> bool {
    *value == 1
}

impl LevelConfig {
    /// A shared four-way LRU level of this size with a latency of zero.
    pub const fn lru(size_bytes: u64) -> Self {
        Self {
            size_bytes,
            ways: 4,
            replacement: Replacement::LRU,
            set_index: SetIndex::Modulo,
            sectors: 1,
            victim_lines: 0,
            inclusion: Inclusion::None,
            line_bytes: None,
            shared: true,
            hit_cycles: 0,
            clients: LevelClients::Textures,
        }
    }

    /// True for plain LRU with one line per tag, the only cache that stack distances describe.
    pub fn is_plain_lru(&self) -> bool {
        self.replacement == Replacement::LRU
            && (self.set_index, self.sectors, self.victim_lines) == (SetIndex::Modulo, 1, 0)
            && self.inclusion.is_none()
    }

    /// Caches of this level in a machine with `cores` cores.
    pub const fn caches(&self, cores: u32) -> u32 {
        if self.shared { 1 } else { cores }
    }

    /// Number of sets for this line size.
    ///
    /// # Errors
    /// The number of sets is not a power of two, or the policy does not support the number of ways.
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
                size: format_bytes(self.size_bytes).into(),
                ways: self.ways,
                line_bytes,
                found: if is_whole {
                    sets.to_string()
                } else {
                    (self.size_bytes as f64 / bytes_per_set as f64).to_string()
                }
                .into(),
                possible: self.possible(bytes_per_set).into(),
            });
        }
        self.check_lines(level, line_bytes, 1)?;
        Ok(sets as u32)
    }

    /// The nearest sizes with a possible number of sets, and the ways with which this size has one.
    fn possible(&self, bytes_per_set: u64) -> String {
        let sets = self.size_bytes / bytes_per_set;
        let below = if sets == 0 { 1 } else { 1 << sets.ilog2() };
        let mut near = vec![u64::min(below, MOST_SETS)];
        let above = (self.size_bytes.div_ceil(bytes_per_set)).checked_next_power_of_two();
        near.extend(above.filter(|above| *above <= MOST_SETS));
        near.dedup();
        let sizes: Vec<String> = near
            .iter()
            .map(|sets| format_bytes(sets * bytes_per_set))
            .collect();
        let mut possible = format!("{} with {} ways", sizes.join(" or "), self.ways);
        let (_, accepts) = self.replacement.ways_rule();
        let bytes_per_way = bytes_per_set / u64::from(self.ways);
        let suits = |ways: &u32| {
            let per_set = bytes_per_way * u64::from(*ways);
            let sets = self.size_bytes / per_set;
            let is_whole = self.size_bytes.is_multiple_of(per_set);
            accepts(*ways) && is_whole && sets.is_power_of_two() && sets <= MOST_SETS
        };
        let ways = (1..=MOST_NAMED_WAYS).filter(suits);
        if let Some(ways) = ways.min_by_key(|ways| ways.abs_diff(self.ways)) {
            possible += &format!(", or {} with {ways} ways", format_bytes(self.size_bytes));
        }
        possible
    }

    /// Checks that the tags of `caches` such caches fit into this machine's memory.
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

    /// Checks sectors, victim cache and latency.
    fn check_parts(&self, level: &'static str) -> Result<(), ConfigError> {
        /// Sectors per tag at most, one bit each.
        const MOST_SECTORS: u32 = 64;
        /// Limit for victim caches, which are searched linearly.
        const MOST_VICTIMS: u32 = 1024;
        accept(
            self.sectors.is_power_of_two() && self.sectors <= MOST_SECTORS,
            "level.sectors",
            "a power of two from 1 to 64",
            format_args!("{} ({level})", self.sectors),
        )?;
        accept(
            self.victim_lines <= MOST_VICTIMS,
            "level.victim_lines",
            "0 to 1024",
            format_args!("{} ({level})", self.victim_lines),
        )?;
        accept(
            self.hit_cycles <= 100_000,
            "level.hit_cycles",
            "0 to 100000",
            format_args!("{} ({level})", self.hit_cycles),
        )
    }
}

crate::choices! { #[non_exhaustive] LevelClients = "Whose lines a level holds.", default Textures:
    Textures = "textures", "The texture units.";
    All = "all", "All clients of memory. Their own caches lie above this level. Writes pass through without allocation.";
}

impl LevelClients {
    /// True if only texture units use the level.
    pub fn is_textures(&self) -> bool {
        *self == Self::Textures
    }
}

crate::choices! { #[non_exhaustive] Inclusion = "Which lines of the levels above a level holds.", default None:
    None = "none", "Levels evict independently.";
    Inclusive = "inclusive", "All lines. A line that this level evicts is invalidated in the levels above.";
    Exclusive = "exclusive", "No lines. The level holds what the level above evicted, and a hit moves the line up. Not for the L2.";
}

impl Inclusion {
    /// True if levels evict independently.
    pub fn is_none(&self) -> bool {
        *self == Self::None
    }
}
