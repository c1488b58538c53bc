//! The whole configuration of one replay. Its default is the Z2 paper's machine (section 4.1).

mod between_frames;
mod caches;
mod lower_levels;
mod prefetch;
mod tmu;

use crate::memory::clients::FrameConfig;
use crate::memory::dram::DramConfig;
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use crate::cache::Replacement;
pub use crate::order::Order;
pub use between_frames::BetweenFrames;
pub use caches::{CacheConfig, Inclusion};
use formats::footprint::MOST_ANISOTROPY;
pub use formats::footprint::{
    AnisotropyModel, FilterOverride, LodFormula, SamplingOptions as SamplingConfig,
};
pub use formats::layout::{BlockOrder, LayoutConfig, TextureOrder};
use formats::view::TILE_SIZE_PX;
pub use lower_levels::{LevelConfig, LowerLevels};
pub use prefetch::{PrefetchConfig, Prefetching};
pub use tmu::{Allocation, TmuConfig};

/// How time passes in a replay.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// The cycle model of the texture unit decides how the cores' accesses interleave.
    #[default]
    Timed,
    /// The machine of the Z2 paper as its table suggests it: a thread stops at its first miss, and
    /// rates count first look-ups beside primary misses.
    FirstMiss,
    /// Tags are checked in order, and footprints wait in a FIFO until their lines have arrived (Igehy et al., 1998).
    PrefetchFifo,
    /// Without latencies: a footprint is a unit of time, and a miss fills at once.
    Functional,
}

impl Mode {
    /// Its name in configuration files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Timed => "timed",
            Self::FirstMiss => "first-miss",
            Self::PrefetchFifo => "prefetch-fifo",
            Self::Functional => "functional",
        }
    }
}

/// How work items are given to cores.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Assign {
    /// The next item goes to the core that becomes idle first.
    #[default]
    FirstIdle,
    /// Round robin (with LRTA and two cores: left tiles on core 0, right tiles on core 1).
    Static,
}

/// Which of the fragments that draws cover are shaded.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Hsr {
    /// All of them; needs a trace that was captured without the depth test.
    None,
    /// Those that pass the depth test when they are drawn: what a trace holds.
    #[default]
    EarlyZ,
    /// Of each pixel the last opaque one and what is drawn over it, as tile-based deferred
    /// renderers do.
    Deferred,
}

impl Hsr {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// What a replay breaks its counts down by, beside views and tiles.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum CountBy {
    /// Textures and mip levels.
    #[default]
    Texture,
    /// Draws.
    Draw,
}

impl CountBy {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

fn is_zero(value: &u32) -> bool {
    *value == 0
}

fn is_recorded_tile(tile_px: &u32) -> bool {
    *tile_px == TILE_SIZE_PX
}

/// Everything that decides the result of a replay of a given trace.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RunConfig {
    /// Timed or functional.
    pub mode: Mode,
    /// Tile order.
    pub order: Order,
    /// Seed of the random order and of random replacement.
    pub seed: u64,
    /// Shader cores, each with its own L1 and texture unit.
    pub cores: u32,
    /// Assignment of tiles to cores.
    pub assign: Assign,
    /// Line size of both levels in bytes, a power of two.
    pub line_bytes: u32,
    /// First level, one a core.
    pub l1: CacheConfig,
    /// Second level, shared.
    pub l2: CacheConfig,
    /// Filter and level of detail.
    pub sampling: SamplingConfig,
    /// Memory layout of the textures.
    pub layout: LayoutConfig,
    /// Texture unit.
    pub tmu: TmuConfig,
    /// Width and height of a tile in pixels; other tiles than the recorded ones of 16 pixels are regrouped.
    #[serde(skip_serializing_if = "is_recorded_tile")]
    pub tile_px: u32,
    /// Also count by tile.
    pub tile_maps: bool,
    /// What counts are broken down by.
    #[serde(skip_serializing_if = "CountBy::is_default")]
    pub count_by: CountBy,
    /// Also record which core works on which tiles when (timed mode, `--timeline`); no key of a file.
    #[serde(skip)]
    pub timeline: bool,
    /// Hidden-surface removal; results name it where it is not the default.
    #[serde(skip_serializing_if = "Hsr::is_default")]
    pub hsr: Hsr,
    /// The caches between frames; results name it where it is not the default.
    #[serde(skip_serializing_if = "BetweenFrames::is_default")]
    pub between_frames: BetweenFrames,
    /// The prefetcher of the L2; without it, only what is requested is fetched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prefetch: Option<PrefetchConfig>,
    /// Further cache levels between the L2 and memory, at most four.
    #[serde(skip_serializing_if = "LowerLevels::is_empty")]
    pub level: LowerLevels,
    /// The DRAM below the caches; without it, lines that leave the chip are only counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dram: Option<DramConfig>,
    /// The machine around the texture units; without it, texture traffic alone is counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame: Option<FrameConfig>,
}

impl Default for RunConfig {
    fn default() -> Self {
        Self {
            mode: Mode::Timed,
            order: Order::MORTON,
            seed: 1,
            cores: 2,
            assign: Assign::FirstIdle,
            line_bytes: 16,
            l1: CacheConfig::lru(8 << 10),
            l2: CacheConfig::lru(128 << 10),
            sampling: SamplingConfig::default(),
            layout: LayoutConfig::default(),
            tmu: TmuConfig::default(),
            tile_px: TILE_SIZE_PX,
            tile_maps: false,
            count_by: CountBy::Texture,
            timeline: false,
            hsr: Hsr::EarlyZ,
            between_frames: BetweenFrames::Keep,
            prefetch: None,
            level: LowerLevels::default(),
            dram: None,
            frame: None,
        }
    }
}

/// More sets of a cache than this are taken for a mistake.
const MOST_SETS: u64 = 1 << 24;

/// More lines of all caches of a level together than this are taken for a mistake: the tags of as many take
/// up to some 300 MiB of this machine's memory.
const MOST_LINES: u64 = 1 << 24;

/// A configuration that no machine can have.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ConfigError {
    /// Sets are not a power of two.
    #[error(
        "{level} cache of {size}, {ways} ways, {line_bytes}-byte lines: expected a power-of-two number of sets up to {MOST_SETS}, found {found}"
    )]
    Sets {
        /// `L1`, `L2`, ...
        level: &'static str,
        /// Size as text.
        size: String,
        /// Ways.
        ways: u32,
        /// Line size.
        line_bytes: u32,
        /// Size over ways and line size.
        found: String,
    },
    /// More lines than this machine can keep.
    #[error(
        "{level} cache of {size}, {line_bytes}-byte lines: expected at most {MOST_LINES} lines in all caches of the level, found {caches} x {found}"
    )]
    Lines {
        /// `L1`, `L2`, ...
        level: &'static str,
        /// Size as text.
        size: String,
        /// Line size.
        line_bytes: u32,
        /// Caches of this size.
        caches: u32,
        /// Lines of each.
        found: u64,
    },
    /// Ways that the policy cannot have.
    #[error("{level} cache with {policy}: expected {expected} ways, found {found}")]
    Ways {
        /// `L1`, `L2`, ...
        level: &'static str,
        /// Replacement policy.
        policy: &'static str,
        /// What the policy can have.
        expected: &'static str,
        /// Ways.
        found: u32,
    },
    /// A number out of range.
    #[error("{key}: expected {expected}, found {found}")]
    Range {
        /// Key as in the configuration file.
        key: &'static str,
        /// What is accepted.
        expected: &'static str,
        /// What was given.
        found: String,
    },
}

impl RunConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let range = |ok: bool, key, expected, found: String| {
            if ok {
                Ok(())
            } else {
                Err(ConfigError::Range {
                    key,
                    expected,
                    found,
                })
            }
        };
        range(
            self.line_bytes.is_power_of_two() && (16..=4096).contains(&self.line_bytes),
            "line_bytes",
            "a power of two from 16 (the largest block) to 4096",
            self.line_bytes.to_string(),
        )?;
        range(
            (1..=64).contains(&self.cores),
            "cores",
            "1 to 64",
            self.cores.to_string(),
        )?;
        range(
            matches!(self.tile_px, 8 | 16 | 32 | 64),
            "tile_px",
            "8, 16, 32 or 64",
            self.tile_px.to_string(),
        )?;
        range(
            self.frame.is_none() || self.tile_px == TILE_SIZE_PX,
            "tile_px",
            "16 with [frame], whose primitive lists are recorded by tile",
            self.tile_px.to_string(),
        )?;
        range(
            self.layout.base_align_bytes.is_power_of_two()
                && self.layout.base_align_bytes <= 1 << 24,
            "layout.base_align_bytes",
            "a power of two up to 16 MiB",
            self.layout.base_align_bytes.to_string(),
        )?;
        range(
            self.sampling.lod_bias.is_finite() && self.sampling.lod_bias.abs() <= 16.0,
            "sampling.lod_bias",
            "-16 to 16",
            self.sampling.lod_bias.to_string(),
        )?;
        range(
            (1..=MOST_ANISOTROPY).contains(&self.sampling.max_anisotropy),
            "sampling.max_anisotropy",
            "1 to 16",
            self.sampling.max_anisotropy.to_string(),
        )?;
        range(
            self.between_frames.lost_percent().is_none() || !self.has_levels_beside_two(),
            "between_frames",
            "keep or flush with further levels, prefetchers, and levels that depend on what others evict",
            self.between_frames.to_string(),
        )?;
        let dram = self.dram.as_ref().map_or(Ok(()), DramConfig::check);
        let dram = dram.map_err(|(key, expected, found)| (key, expected, u64::from(found)));
        let frame = self.frame.as_ref().map_or(Ok(()), FrameConfig::check);
        dram.and(frame)
            .map_err(|(key, expected, found)| ConfigError::Range {
                key,
                expected,
                found: found.to_string(),
            })?;
        self.tmu.check()?;
        self.l1.sets("L1", self.line_bytes)?;
        self.l2.sets("L2", self.line_bytes)?;
        self.l1.check_lines("L1", self.line_bytes, self.cores)?;
        self.level.check(self.line_bytes, &self.l2)?;
        let prefetch = self.prefetch.as_ref();
        prefetch.map_or(Ok(()), |prefetch| prefetch.check(self.mode))
    }

    /// True where the order of the L2's misses matters: they go to further levels or to DRAM, or prefetch others.
    #[must_use]
    pub fn follows_l2_misses(&self) -> bool {
        self.simulates_below_l2() || self.prefetch.is_some() || self.levels_depend_on_evictions()
    }

    /// True where a level holds, or does not hold, a line because another one does.
    #[must_use]
    pub fn levels_depend_on_evictions(&self) -> bool {
        let mut levels = self.level.iter().map(|level| level.inclusion);
        !self.l2.inclusion.is_none() || levels.any(|inclusion| !inclusion.is_none())
    }

    /// True where more is simulated than L1 caches, an L2 and DRAM.
    fn has_levels_beside_two(&self) -> bool {
        !self.level.is_empty() || self.prefetch.is_some() || self.levels_depend_on_evictions()
    }

    /// How work items are given to cores: as the order says, else as the configuration does.
    #[must_use]
    pub fn dispatch(&self) -> Assign {
        self.order.dispatch(self.assign)
    }

    /// True where the misses of the L2 go to further levels or to DRAM.
    #[must_use]
    pub const fn simulates_below_l2(&self) -> bool {
        self.dram.is_some() || !self.level.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_the_papers_machine_and_valid() {
        let config = RunConfig::default();
        config.validate().unwrap();
        assert_eq!(config.l1.sets("L1", config.line_bytes), Ok(128));
        assert_eq!(config.l2.sets("L2", config.line_bytes), Ok(2048));
    }

    #[test]
    fn sets_that_are_no_power_of_two_are_named() {
        let config = RunConfig {
            l1: CacheConfig::lru(6 << 10),
            ..RunConfig::default()
        };
        assert_eq!(
            config.validate().unwrap_err().to_string(),
            "L1 cache of 6 KiB, 4 ways, 16-byte lines: expected a power-of-two number of sets up to 16777216, found 96"
        );
        let refused = |size_bytes, ways| {
            let cache = CacheConfig {
                ways,
                ..CacheConfig::lru(size_bytes)
            };
            cache.sets("L2", 16).unwrap_err().to_string()
        };
        let sets = refused(1 << 62, 4);
        assert!(sets.ends_with("found 72057594037927936"), "{sets}");
        let sets = refused((1 << 62) + 1, 4);
        assert!(sets.contains("found 7205759403792794"), "{sets}");
    }

    #[test]
    fn caches_whose_tags_fill_this_machines_memory_are_refused_at_planning() {
        let with = |l1_bytes, ways, cores| {
            let mut config = RunConfig {
                cores,
                ..RunConfig::default()
            };
            config.l1 = CacheConfig {
                ways,
                ..CacheConfig::lru(l1_bytes)
            };
            config.validate()
        };
        assert_eq!(with(1 << 28, 4, 1), Ok(()));
        assert_eq!(with(4 << 20, 4, 64), Ok(()));
        for (l1_bytes, ways, cores, found) in [
            (255 << 28, 255, 1, "65280 MiB, 16-byte lines"),
            (
                1 << 28,
                4,
                2,
                "in all caches of the level, found 2 x 16777216",
            ),
            (8 << 20, 4, 64, "found 64 x 524288"),
        ] {
            let error = with(l1_bytes, ways, cores).unwrap_err().to_string();
            assert!(error.contains("at most 16777216 lines"), "{error}");
            assert!(error.contains(found), "{error}");
        }
    }

    #[test]
    fn ways_that_a_policy_cannot_have_are_refused_at_planning() {
        for (replacement, ways, expected) in [
            (
                Replacement::TREE_PLRU,
                3,
                "L2 cache with tree-plru: expected 1, 2, 4 ... 64 ways, found 3",
            ),
            (
                Replacement::LRU,
                0,
                "L2 cache with lru: expected 1 to 255 ways, found 0",
            ),
        ] {
            let config = RunConfig {
                l2: CacheConfig {
                    ways,
                    replacement,
                    ..CacheConfig::lru(3 << 16)
                },
                ..RunConfig::default()
            };
            assert_eq!(config.validate().unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn toml_takes_sizes_with_units_and_refuses_unknown_keys() {
        let config: RunConfig =
            toml::from_str("order = \"z2-sta\"\n[l1]\nsize_bytes = \"16KiB\"\n").unwrap();
        assert_eq!(config.l1, CacheConfig::lru(16 << 10));
        assert_eq!(config.order, Order::Z2_STA);
        let error = toml::from_str::<RunConfig>("l3 = 1")
            .unwrap_err()
            .to_string();
        assert!(error.contains("unknown field `l3`"), "{error}");
    }

    #[test]
    fn a_printed_configuration_reads_back_the_same() {
        let config = RunConfig {
            order: Order::Z2_STA_MERGE,
            seed: 9,
            ..RunConfig::default()
        };
        let text = toml::to_string(&config).unwrap();
        assert_eq!(toml::from_str::<RunConfig>(&text).unwrap(), config);
    }
}
