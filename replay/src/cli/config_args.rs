//! Flags that set the machine. Flags override `--config`, which overrides the defaults.

use super::choice::choice;
use super::order_arg::OrderParser;
use anyhow::{Context, Result, anyhow};
use clap::Args;
use formats::texture::TexelFormat;
use serde::de::value::Error as ValueError;
use serde::de::{DeserializeOwned, IntoDeserializer};
use sim::config::FrameMachine;
use sim::config::{
    Allocation, AnisotropyModel, Assign, BetweenFrames, BlockOrder, CountBy, FilterOverride, Hsr,
    LodFormula, Mode, Order, Prefetching, Replacement, RunConfig, TextureOrder, TmuModel,
};
use sim::memory::dram::DramPreset;
use sim::preset::Preset;
use sim::registry::most_similar;
use sim::size::{format_bytes, parse_bytes};
use std::path::{Path, PathBuf};
use studies::experiment::parse_config;

/// Parses an enum of the formats crate by its serialised name.
fn named<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    T::deserialize(text.into_deserializer()).map_err(|error: ValueError| {
        let message = error.to_string();
        // "unknown variant `x`, expected one of `a`, `b`"
        let names = message.split('`').skip(3).step_by(2);
        match most_similar(text, names) {
            Some(name) => format!("{message}; did you mean `{name}`?"),
            None => message,
        }
    })
}

/// Flags of the replay configuration.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Machine")]
pub struct ConfigArgs {
    /// TOML file with the configuration; flags override it
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Named machine instead of the defaults; flags override it (docs/models/machines.md)
    #[arg(long, value_parser = choice::<Preset>(), conflicts_with = "config")]
    preset: Option<Preset>,
    /// Tile order: a name, or parts as in zig-zag+sta+offset+boustro (docs/models/orders.md)
    #[arg(long, value_parser = OrderParser)]
    order: Option<Order>,
    /// Model: texture units with timing, or cache counts only
    #[arg(long, value_parser = choice::<Mode>())]
    mode: Option<Mode>,
    /// Size of the L1 of each core
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    l1: Option<u64>,
    /// Size of the L2 that all cores share
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    l2: Option<u64>,
    /// Size of an L3 below the L2; 16 ways unless --config sets them
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes, hide_short_help = true)]
    l3: Option<u64>,
    /// Associativity of L1 and L2
    #[arg(long, value_name = "N", hide_short_help = true)]
    ways: Option<u32>,
    /// Associativity of the L1
    #[arg(long, value_name = "N", hide_short_help = true)]
    l1_ways: Option<u32>,
    /// Associativity of the L2
    #[arg(long, value_name = "N", hide_short_help = true)]
    l2_ways: Option<u32>,
    /// Replacement policy of L1 and L2
    #[arg(long, value_parser = choice::<Replacement>())]
    replacement: Option<Replacement>,
    /// Line size of L1 and L2
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes, hide_short_help = true)]
    line: Option<u64>,
    /// Shader cores
    #[arg(long, value_name = "N")]
    cores: Option<u32>,
    /// Assignment of tiles to cores
    #[arg(long, value_parser = choice::<Assign>(), hide_short_help = true)]
    assign: Option<Assign>,
    /// Seed of the random order and of random replacement
    #[arg(long, value_name = "N", hide_short_help = true)]
    seed: Option<u64>,

    /// Breakdown of the misses in --json; the table of `replay run` lists the parts with most misses
    #[arg(long, value_parser = choice::<CountBy>(), value_name = "PARTS", hide_short_help = true)]
    count_by: Option<CountBy>,
    /// Width and height of a tile in pixels: 8, 16 (as recorded), 32 or 64
    #[arg(long, value_name = "PIXELS", hide_short_help = true)]
    tile_px: Option<u32>,
    /// Hidden-surface removal
    #[arg(long, value_parser = choice::<Hsr>(), hide_short_help = true)]
    hsr: Option<Hsr>,
    /// State of the caches at the start of each frame of a trace: keep, flush, or lose-N, after which other work has
    /// filled N percent of each cache below the L1
    #[arg(long, value_name = "CACHES", value_parser = str::parse::<BetweenFrames>, hide_short_help = true)]
    between_frames: Option<BetweenFrames>,

    /// Prefetcher of the L2; `[prefetch]` of --config sets the number of lines
    #[arg(long, value_parser = choice::<Prefetching>(), value_name = "PREFETCHER", hide_short_help = true)]
    prefetch: Option<Prefetching>,
    /// DRAM below the caches: lpddr4, lpddr5, ddr4, gddr6; `[dram]` of --config sets the number of channels
    /// (2 by default)
    #[arg(long, value_name = "DEVICE", value_parser = named::<DramPreset>)]
    dram: Option<DramPreset>,
    /// Model the traffic of the whole frame on this machine; needs a trace captured with --geometry
    #[arg(long, value_parser = choice::<FrameMachine>(), value_name = "MACHINE", hide_short_help = true)]
    frame: Option<FrameMachine>,

    /// Texture filter, instead of the recorded one: trilinear, bilinear, nearest
    #[arg(long, value_parser = named::<FilterOverride>, help_heading = "Sampling", hide_short_help = true)]
    filter: Option<FilterOverride>,
    /// Level-of-detail formula: llvmpipe, softpipe, exact, per-lane
    #[arg(long, value_parser = named::<LodFormula>, help_heading = "Sampling", hide_short_help = true)]
    lod: Option<LodFormula>,
    /// Bias added to the level of detail
    #[arg(
        long,
        value_name = "LEVELS",
        allow_hyphen_values = true,
        help_heading = "Sampling",
        hide_short_help = true
    )]
    lod_bias: Option<f32>,
    /// Largest number of footprints per anisotropic pixel, 1 to 16, instead of each sampler's recorded one
    #[arg(
        long,
        value_name = "N",
        help_heading = "Sampling",
        hide_short_help = true
    )]
    max_anisotropy: Option<u32>,
    /// Anisotropic filtering: probes (several footprints along the longer axis, Vulkan's level),
    /// rounded-probes (level from the example in EXT_texture_filter_anisotropic), ellipse (all texels in
    /// the pixel's ellipse)
    #[arg(long, value_name = "MODEL", value_parser = named::<AnisotropyModel>, help_heading = "Sampling", hide_short_help = true)]
    anisotropy: Option<AnisotropyModel>,
    /// Also count the helper lanes of partly covered quads
    #[arg(long, help_heading = "Sampling", hide_short_help = true)]
    helper_lanes: bool,

    /// Texel format of colour textures in memory: bc1, bc7, astc-6x6, rgba8, ...
    #[arg(long, value_name = "FORMAT", value_parser = named::<TexelFormat>, help_heading = "Layout", hide_short_help = true)]
    texel_format: Option<TexelFormat>,
    /// Order of the blocks in each level of a colour texture: linear, morton, tiled
    #[arg(long, value_parser = named::<BlockOrder>, help_heading = "Layout", hide_short_help = true)]
    block_order: Option<BlockOrder>,
    /// Order of the texels in shadow maps: morton (the default), tiled, linear
    #[arg(long, value_parser = named::<BlockOrder>, help_heading = "Layout", hide_short_help = true)]
    shadow_map_order: Option<BlockOrder>,
    /// Alignment of the first byte of each texture
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes, help_heading = "Layout", hide_short_help = true)]
    base_align: Option<u64>,
    /// Order of the textures in memory: table, largest-first
    #[arg(long, value_parser = named::<TextureOrder>, help_heading = "Layout", hide_short_help = true)]
    texture_order: Option<TextureOrder>,

    /// How a thread waits for lines that are not in the L1
    #[arg(
        long, value_parser = choice::<TmuModel>(),
        value_name = "MODEL",
        help_heading = "Texture unit",
        hide_short_help = true
    )]
    tmu: Option<TmuModel>,
    /// Cycles to transfer a line from the L2 to an L1
    #[arg(
        long,
        value_name = "CYCLES",
        help_heading = "Texture unit",
        hide_short_help = true
    )]
    l2_cycles: Option<u32>,
    /// Cycles to transfer a line from memory to the last level
    #[arg(
        long,
        value_name = "CYCLES",
        help_heading = "Texture unit",
        hide_short_help = true
    )]
    memory_cycles: Option<u32>,
    /// Cycles until a thread that missed returns to the first stage
    #[arg(
        long,
        value_name = "CYCLES",
        help_heading = "Texture unit",
        hide_short_help = true
    )]
    loop_cycles: Option<u32>,
    /// Threads (quads) in flight per core
    #[arg(
        long,
        value_name = "N",
        help_heading = "Texture unit",
        hide_short_help = true
    )]
    tmu_threads: Option<u32>,
    /// Footprints that a thread retries per issue slot after a miss
    #[arg(
        long,
        value_name = "N",
        help_heading = "Texture unit",
        hide_short_help = true
    )]
    retry_footprints: Option<u32>,
    /// Lines that a thread fetches per trip through the loop
    #[arg(
        long,
        value_name = "N",
        help_heading = "Texture unit",
        hide_short_help = true
    )]
    fetches_per_trip: Option<u32>,
    /// When a missing line is allocated in a cache
    #[arg(long, value_parser = choice::<Allocation>(), help_heading = "Texture unit", hide_short_help = true)]
    allocation: Option<Allocation>,
}

/// Overwrites `target` if the flag is given, and returns whether it is.
fn set<T>(target: &mut T, flag: Option<T>) -> bool {
    let is_given = flag.is_some();
    if let Some(value) = flag {
        *target = value;
    }
    is_given
}

impl ConfigArgs {
    /// The configuration: the defaults, then `--config`, then the flags.
    ///
    /// # Errors
    /// The file cannot be read, has an unknown key, or the result is impossible.
    pub fn resolve(&self) -> Result<RunConfig> {
        self.resolve_over(RunConfig::default())
    }

    /// The configuration: `defaults` with the preset, or `--config` if given, then the flags.
    ///
    /// # Errors
    /// See [`Self::resolve`].
    pub(super) fn resolve_over(&self, defaults: RunConfig) -> Result<RunConfig> {
        let preset = |config| self.preset.map_or(config, |preset| preset.over(config));
        self.resolve_file_over(preset(defaults))
    }

    /// The configuration without the preset: the defaults or `--config`, then the flags.
    ///
    /// # Errors
    /// See [`Self::resolve`].
    pub(super) fn resolve_without_preset(&self) -> Result<RunConfig> {
        self.resolve_file_over(RunConfig::default())
    }

    /// `defaults` at every corner of the ranges of `--preset`, then the flags; nothing if the preset has no ranges.
    ///
    /// # Errors
    /// A corner that the flags make impossible.
    pub(super) fn resolve_corners(&self, defaults: RunConfig) -> Result<Vec<RunConfig>> {
        let machine = self.preset.and_then(Preset::machine);
        let mut corners = Vec::new();
        for mut config in machine.map_or_else(Vec::new, |machine| machine.corners(defaults)) {
            self.apply(&mut config)?;
            config.validate()?;
            if !corners.contains(&config) {
                corners.push(config);
            }
        }
        Ok(corners)
    }

    /// The machine of `--preset`.
    pub fn preset(&self) -> Option<Preset> {
        self.preset
    }

    fn resolve_file_over(&self, defaults: RunConfig) -> Result<RunConfig> {
        let mut config = match &self.config {
            None => defaults,
            Some(path) => parse_config(&shell::read_settings(path)?)
                .map_err(|error| anyhow!("{}: {error}", path.display()))?,
        };
        self.apply(&mut config)?;
        config.validate()?;
        let [l1, l2] = [config.level.l1, config.level.l2].map(|level| level.size_bytes);
        if (self.l1.is_some() || self.l2.is_some()) && l2 < l1 {
            shell::warn(&format!(
                "the L2 ({}) is smaller than an L1 ({}); sizes without a unit are bytes",
                format_bytes(l2),
                format_bytes(l1)
            ));
        }
        Ok(config)
    }

    /// The first flag given that applies only to tiles, textures or the texture unit, and so not to plain
    /// addresses.
    pub(super) fn first_of_traces(&self) -> Option<&'static str> {
        self.apply_of_traces(&mut RunConfig::default())
    }

    /// The order of `--order`.
    pub(super) fn order(&self) -> Option<Order> {
        self.order
    }

    /// The same without `--order`.
    pub(super) fn without_order(&self) -> Self {
        Self {
            order: None,
            ..self.clone()
        }
    }

    /// The same on this preset.
    pub(super) fn on(&self, preset: Preset) -> Self {
        Self {
            preset: Some(preset),
            ..self.clone()
        }
    }

    /// Whether a preset or a file is given.
    pub(super) fn has_base(&self) -> bool {
        self.preset.is_some() || self.config.is_some()
    }

    /// Whether `--dram` is given.
    pub(super) fn has_dram(&self) -> bool {
        self.dram.is_some()
    }

    /// The parts of `--count-by`, if given.
    pub(super) fn counts_by(&self) -> Option<CountBy> {
        self.count_by
    }

    /// The file of `--config`.
    pub fn file(&self) -> Option<&Path> {
        self.config.as_deref()
    }

    /// Applies the flags to a configuration.
    ///
    /// # Errors
    /// A line size that does not fit its type.
    pub fn apply(&self, config: &mut RunConfig) -> Result<()> {
        self.apply_of_traces(config);
        set(&mut config.level.l1.size_bytes, self.l1);
        set(&mut config.level.l2.size_bytes, self.l2);
        set(&mut config.level.l1.ways, self.l1_ways.or(self.ways));
        set(&mut config.level.l2.ways, self.l2_ways.or(self.ways));
        set(&mut config.level.l1.replacement, self.replacement);
        set(&mut config.level.l2.replacement, self.replacement);
        if let Some(line) = self.line {
            config.line_bytes = u32::try_from(line).context("--line")?;
        }
        set(&mut config.seed, self.seed);
        if let Some(size_bytes) = self.l3 {
            config.level.set_l3(size_bytes);
        }
        if let Some(prefetcher) = self.prefetch {
            config.prefetch.get_or_insert_default().prefetcher = prefetcher;
        }
        if let Some(preset) = self.dram {
            config.dram.get_or_insert_default().preset = preset;
        }
        if let Some(machine) = self.frame {
            config.frame.get_or_insert_default().machine = machine;
        }
        Ok(())
    }

    /// Applies the flags of tiles, textures and the texture unit, and returns the first that is given.
    fn apply_of_traces(&self, config: &mut RunConfig) -> Option<&'static str> {
        let (sampling, layout) = (&mut config.sampling, &mut config.layout);
        let (tmu, texel_format) = (&mut config.tmu, self.texel_format.map(Some));
        let max_anisotropy = self.max_anisotropy.map(Some);
        sampling.helper_lanes |= self.helper_lanes;
        let flags = [
            ("--preset", self.preset.is_some()),
            ("--order", set(&mut config.order, self.order)),
            ("--mode", set(&mut config.mode, self.mode)),
            ("--cores", set(&mut config.cores, self.cores)),
            ("--assign", set(&mut config.assign, self.assign)),
            (
                "--between-frames",
                set(&mut config.between_frames, self.between_frames),
            ),
            ("--count-by", set(&mut config.count_by, self.count_by)),
            ("--tile-px", set(&mut config.tile_px, self.tile_px)),
            ("--hsr", set(&mut config.hsr, self.hsr)),
            ("--frame", self.frame.is_some()),
            ("--filter", set(&mut sampling.filter, self.filter)),
            ("--lod", set(&mut sampling.lod, self.lod)),
            ("--lod-bias", set(&mut sampling.lod_bias, self.lod_bias)),
            (
                "--max-anisotropy",
                set(&mut sampling.max_anisotropy, max_anisotropy),
            ),
            (
                "--anisotropy",
                set(&mut sampling.anisotropy, self.anisotropy),
            ),
            ("--helper-lanes", self.helper_lanes),
            (
                "--texel-format",
                set(&mut layout.texel_format, texel_format),
            ),
            (
                "--block-order",
                set(&mut layout.block_order, self.block_order),
            ),
            (
                "--shadow-map-order",
                set(&mut layout.shadow_map_order, self.shadow_map_order),
            ),
            (
                "--base-align",
                set(&mut layout.base_align_bytes, self.base_align),
            ),
            (
                "--texture-order",
                set(&mut layout.texture_order, self.texture_order),
            ),
            ("--tmu", set(&mut tmu.model, self.tmu)),
            (
                "--l2-cycles",
                set(&mut config.level.l2.hit_cycles, self.l2_cycles),
            ),
            (
                "--memory-cycles",
                set(&mut config.memory_cycles, self.memory_cycles),
            ),
            ("--loop-cycles", set(&mut tmu.loop_cycles, self.loop_cycles)),
            ("--tmu-threads", set(&mut tmu.threads, self.tmu_threads)),
            (
                "--retry-footprints",
                set(&mut tmu.retry_footprints, self.retry_footprints),
            ),
            (
                "--fetches-per-trip",
                set(&mut tmu.fetches_per_trip, self.fetches_per_trip),
            ),
            ("--allocation", set(&mut tmu.allocation, self.allocation)),
        ];
        let mut given = flags.into_iter().filter(|(_, is_given)| *is_given);
        given.next().map(|(flag, _)| flag)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_value_comes_with_a_suggestion() {
        let error = named::<LodFormula>("llvmpip").unwrap_err();
        assert!(error.ends_with("; did you mean `llvmpipe`?"), "{error}");
        assert!(
            !named::<LodFormula>("other")
                .unwrap_err()
                .contains("did you mean")
        );
    }
}
