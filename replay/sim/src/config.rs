//! The configuration of one replay. The default is the Z2 paper's machine (section 4.1).

mod between_frames;
mod dram;
mod error;
mod frame;
mod level;
mod levels;
mod prefetch;
mod rows;
mod tmu;

use crate::memory::dram::DramConfig;

pub use crate::memory::Replacement;
pub use crate::order::Order;
pub use between_frames::BetweenFrames;
pub use error::ConfigError;
pub use error::accept;
pub(crate) use error::in_range;
use formats::footprint::MOST_ANISOTROPY;
pub use formats::footprint::{
    AnisotropyModel, FilterOverride, LodFormula, SamplingOptions as SamplingConfig,
};
pub use formats::layout::{BlockOrder, LayoutConfig, TextureOrder};
use formats::view::TILE_SIZE_PX;
pub use frame::{FrameConfig, FrameMachine};
pub use level::{Inclusion, LevelClients, LevelConfig, SetIndex};
pub use levels::Levels;
pub use prefetch::{PrefetchConfig, Prefetching};
pub use rows::Key;
pub(crate) use rows::settings;
pub use tmu::{Allocation, TmuConfig, TmuModel};

crate::choices! { #[non_exhaustive] Mode = "How time is modelled.", default Timed:
    Timed = "timed", "Each core's texture unit (`tmu.model`) has a clock. The clocks decide how the cores' accesses interleave.";
    Functional = "functional", "No latencies: each footprint takes one unit of time and misses fill immediately.";
}

crate::choices! { #[non_exhaustive] Assign = "How work items are assigned to cores.", default FirstIdle:
    FirstIdle = "first-idle", "The next item goes to the first idle core.";
    Static = "static", "Round robin (with LRTA and two cores: left tiles on core 0, right tiles on core 1).";
}

crate::choices! { #[non_exhaustive] Hsr = "Which of the covered fragments are shaded.", default EarlyZ:
    None = "none", "All of them. Needs a trace captured without the depth test.";
    EarlyZ = "early-z", "Those that pass the depth test when drawn, as recorded in the trace.";
    Deferred = "deferred", "Per pixel, the last opaque fragment and the fragments blended over it, as in tile-based deferred renderers.";
}

crate::choices! { CountBy = "What counts are broken down by, in addition to views and tiles.", default Texture:
    Texture = "texture", "Textures and mip levels.";
    Draw = "draw", "Draws.";
}

/// True for a default, which files and results omit.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn is_recorded_tile(tile_px: &u32) -> bool {
    *tile_px == TILE_SIZE_PX
}

settings! {
    /// The complete configuration of a replay.
    pub struct RunConfig in "" {
        /// How time is modelled.
        pub mode: Mode = Mode::Timed;
        /// Tile order.
        pub order: Order = Order::MORTON;
        /// Seed of the random tile order and of random replacement.
        pub seed: u64 = 1;
        /// Shader cores, each with its own L1 and texture unit.
        pub cores: u32 = 2, in 1..=64;
        /// Assignment of tiles to cores.
        pub assign: Assign = Assign::FirstIdle;
        /// Line size of the L1 and the L2 in bytes, a power of two.
        pub line_bytes: u32 = 16;
        /// Cache levels, two to six, the L1 first.
        pub level: Levels = Levels::default();
        /// Cycles in which a line travels from memory to the last level.
        pub memory_cycles: u32 = 200, in 0..=100_000;
        /// Filter and level of detail.
        #[cfg_attr(feature = "testing", schemars(with = "crate::schemas::Sampling"))]
        pub sampling: SamplingConfig = SamplingConfig::default();
        /// Memory layout of the textures.
        #[cfg_attr(feature = "testing", schemars(with = "crate::schemas::Layout"))]
        pub layout: LayoutConfig = LayoutConfig::default();
        /// Texture unit.
        pub tmu: TmuConfig = TmuConfig::default();
        /// Width and height of a tile in pixels. Sizes other than the recorded 16 regroup the recorded tiles.
        #[serde(skip_serializing_if = "is_recorded_tile")]
        pub tile_px: u32 = TILE_SIZE_PX;
        /// Also count per tile.
        pub tile_maps: bool = false;
        /// What counts are broken down by, in addition to views and tiles.
        #[serde(skip_serializing_if = "is_default")]
        pub count_by: CountBy = CountBy::Texture;
        /// Also record when each core works on which tiles (timed mode, `--timeline`); not a key of
        /// configuration files.
        #[serde(skip)]
        pub timeline: bool = false;
        /// With `timeline`, also record the content of the L2 (`replay view`); not a key of configuration files.
        #[serde(skip)]
        pub l2_changes: bool = false;
        /// Hidden-surface removal. Results name it if it is not the default.
        #[serde(skip_serializing_if = "is_default")]
        pub hsr: Hsr = Hsr::EarlyZ;
        /// Cache contents between frames. Results name it if it is not the default.
        #[serde(skip_serializing_if = "is_default")]
        pub between_frames: BetweenFrames = BetweenFrames::Keep;
        /// The prefetcher of the L2. Without it, only requested lines are fetched.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub prefetch: Option<PrefetchConfig> = None;
        /// The DRAM model below the caches. Without it, lines from memory are only counted.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub dram: Option<DramConfig> = None;
        /// The machine around the texture units. Without it, only texture traffic is counted.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub frame: Option<FrameConfig> = None;
    }
}

/// Upper limit for the sets of a cache. More are taken for a mistake.
const MOST_SETS: u64 = 1 << 24;

/// Upper limit for the lines of all caches of a level. Their tags take up to about 300 MiB of this
/// machine's memory.
const MOST_LINES: u64 = 1 << 24;

impl RunConfig {
    /// The model of the texture units, or none in functional mode.
    pub fn tmu_model(&self) -> Option<TmuModel> {
        (self.mode == Mode::Timed).then_some(self.tmu.model)
    }

    /// True for the headline model, in which threads loop until their lines are filled.
    pub fn is_looping(&self) -> bool {
        self.tmu_model() == Some(TmuModel::Looping)
    }

    /// The mode or, if it is not the default, the model of the texture unit.
    pub fn mode_name(&self) -> &'static str {
        match self.tmu_model() {
            None => "functional",
            Some(TmuModel::Looping) => "timed",
            Some(model) => model.name(),
        }
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        accept(
            self.line_bytes.is_power_of_two() && (16..=4096).contains(&self.line_bytes),
            "line_bytes",
            "a power of two from 16 (the largest block) to 4096",
            self.line_bytes,
        )?;
        self.check_ranges()?;
        accept(
            matches!(self.tile_px, 8 | 16 | 32 | 64),
            "tile_px",
            "8, 16, 32 or 64",
            self.tile_px,
        )?;
        accept(
            self.frame.is_none() || self.tile_px >= TILE_SIZE_PX,
            "tile_px",
            "16, 32 or 64 with [frame], whose primitive lists are recorded by tiles of 16",
            self.tile_px,
        )?;
        let align = self.layout.base_align_bytes;
        accept(
            align.is_power_of_two() && align <= 1 << 24,
            "layout.base_align_bytes",
            "a power of two up to 16 MiB",
            align,
        )?;
        in_range("sampling.lod_bias", self.sampling.lod_bias, -16.0..=16.0)?;
        in_range(
            "sampling.max_anisotropy",
            self.sampling.max_anisotropy.unwrap_or(1),
            1..=MOST_ANISOTROPY,
        )?;
        let l1_lines = |level: &LevelConfig| level.size_bytes / u64::from(self.line_bytes);
        accept(
            self.between_frames.lost_percent().is_none()
                || self.level.iter().all(|level| l1_lines(level) <= MOST_LINES),
            "between_frames",
            "keep or flush with a level as large as more than 2^24 lines of the L1",
            self.between_frames,
        )?;
        self.dram.as_ref().map_or(Ok(()), DramConfig::check)?;
        self.frame.as_ref().map_or(Ok(()), FrameConfig::check)?;
        self.tmu.check_ranges()?;
        self.level.check(self.line_bytes, self.cores)?;
        let prefetch = self.prefetch.as_ref();
        prefetch.map_or(Ok(()), |prefetch| prefetch.check(self.mode))
    }

    /// True if a miss fills the cache immediately, so that later look-ups of the same thread hit.
    pub fn misses_change_caches_at_once(&self) -> bool {
        self.level.l2.hit_cycles == 0 || self.tmu.allocation == Allocation::OnMiss
    }

    /// True if the changes of the L2's content are recorded. A sectored cache does not report its evictions.
    pub fn records_l2(&self) -> bool {
        self.timeline && self.l2_changes && self.level.l2.sectors == 1
    }

    /// True if the order of the L2's misses matters, because further levels, DRAM or a prefetcher see them.
    pub fn follows_l2_misses(&self) -> bool {
        self.simulates_below_l2() || self.prefetch.is_some() || self.level.depend_on_evictions()
    }

    /// How work items are given to cores: as the order says, else as the configuration does.
    pub fn dispatch(&self) -> Assign {
        self.order.dispatch(self.assign)
    }

    /// True if L2 misses go to further levels or to DRAM.
    pub const fn simulates_below_l2(&self) -> bool {
        self.dram.is_some() || self.level.has_lower()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_is_the_papers_machine() {
        let config = RunConfig::default();
        config.validate().unwrap();
        assert_eq!(config.level.l1.sets("L1", config.line_bytes), Ok(128));
        assert_eq!(config.level.l2.sets("L2", config.line_bytes), Ok(2048));
    }

    #[test]
    fn numbers_of_sets_that_are_not_powers_of_two_are_refused() {
        let config = RunConfig {
            level: Levels::two(LevelConfig::lru(6 << 10), LevelConfig::lru(128 << 10)),
            ..RunConfig::default()
        };
        assert_eq!(
            config.validate().unwrap_err().to_string(),
            "L1 cache of 6 KiB, 4 ways, 16-byte lines: expected a power-of-two number of sets up to 16777216, found 96; possible: 4 KiB or 8 KiB with 4 ways, or 6 KiB with 3 ways"
        );
        let refused = |size_bytes, ways| {
            let cache = LevelConfig {
                ways,
                ..LevelConfig::lru(size_bytes)
            };
            cache.sets("L2", 16).unwrap_err().to_string()
        };
        let sets = refused(1 << 62, 4);
        assert!(
            sets.contains("found 72057594037927936; possible: "),
            "{sets}"
        );
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
            config.level.l1 = LevelConfig {
                ways,
                ..Levels::usual(0, l1_bytes)
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
    fn unsupported_numbers_of_ways_are_refused_at_planning() {
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
            let l2 = LevelConfig {
                ways,
                replacement,
                ..LevelConfig::lru(3 << 16)
            };
            let config = RunConfig {
                level: Levels::two(LevelConfig::lru(8 << 10), l2),
                ..RunConfig::default()
            };
            assert_eq!(config.validate().unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn toml_takes_sizes_with_units_and_refuses_unknown_keys() {
        let config: RunConfig = toml::from_str(
            "order = \"z2-sta\"\n[[level]]\nsize_bytes = \"16KiB\"\n[[level]]\nsize_bytes = 1024\n",
        )
        .unwrap();
        assert_eq!(
            config.level,
            Levels::two(LevelConfig::lru(16 << 10), LevelConfig::lru(1 << 10))
        );
        assert_eq!(config.order, Order::Z2_STA);
        let error = toml::from_str::<RunConfig>("l2 = 1")
            .unwrap_err()
            .to_string();
        assert!(error.contains("unknown field `l2`"), "{error}");
    }

    #[test]
    fn a_printed_configuration_parses_to_the_same_configuration() {
        let config = RunConfig {
            order: Order::Z2_STA_MERGE,
            seed: 9,
            ..RunConfig::default()
        };
        let text = toml::to_string(&config).unwrap();
        assert_eq!(toml::from_str::<RunConfig>(&text).unwrap(), config);
    }
}
