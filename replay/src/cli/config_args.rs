//! Flags that set the machine; they win over `--config`, which wins over the paper's defaults.

use crate::config::FrameMachine;
use crate::config::{
    Allocation, AnisotropyModel, Assign, BetweenFrames, BlockOrder, CountBy, FilterOverride, Hsr,
    LodFormula, Mode, Order, Prefetching, Replacement, RunConfig, TextureOrder, TmuModel,
};
use crate::experiment::parse_config;
use crate::memory::dram::DramPreset;
use crate::preset::Preset;
use crate::size::parse_bytes;
use anyhow::{Context, Result, anyhow};
use clap::Args;
use formats::texture::TexelFormat;
use serde::de::value::Error as ValueError;
use serde::de::{DeserializeOwned, IntoDeserializer};
use std::path::{Path, PathBuf};

/// Reads an enum of the formats crate by its serialised name.
fn named<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    T::deserialize(text.into_deserializer()).map_err(|e: ValueError| e.to_string())
}

/// Flags of the replay configuration.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Machine")]
pub struct ConfigArgs {
    /// TOML file with the configuration; flags win over it
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Machine by name in place of the defaults; flags win over it
    #[arg(long, conflicts_with = "config")]
    preset: Option<Preset>,
    /// Tile order
    #[arg(long)]
    order: Option<Order>,
    /// Texture units with clocks, or footprints without latencies
    #[arg(long)]
    mode: Option<Mode>,
    /// Size of each core's L1
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    l1: Option<u64>,
    /// Size of the shared L2
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    l2: Option<u64>,
    /// Size of an L3 below the L2, 16 ways unless --config says otherwise
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    l3: Option<u64>,
    /// Associativity of L1 and L2
    #[arg(long, value_name = "N")]
    ways: Option<u32>,
    /// Associativity of the L1
    #[arg(long, value_name = "N")]
    l1_ways: Option<u32>,
    /// Associativity of the L2
    #[arg(long, value_name = "N")]
    l2_ways: Option<u32>,
    /// Replacement policy of L1 and L2
    #[arg(long)]
    replacement: Option<Replacement>,
    /// Line size of L1 and L2
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    line: Option<u64>,
    /// Shader cores
    #[arg(long, value_name = "N")]
    cores: Option<u32>,
    /// Assignment of tiles to cores
    #[arg(long)]
    assign: Option<Assign>,
    /// Seed of the random order and of random replacement
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// What misses are broken down by in --json; with draw, tables list the busiest draws
    #[arg(long, value_name = "PARTS")]
    count_by: Option<CountBy>,
    /// Width and height of a tile: 8, 16 (as recorded), 32 or 64
    #[arg(long, value_name = "PIXELS")]
    tile_px: Option<u32>,
    /// Hidden-surface removal
    #[arg(long)]
    hsr: Option<Hsr>,
    /// The caches between the frames of a trace
    #[arg(long)]
    between_frames: Option<BetweenFrames>,

    /// Prefetcher of the L2, of its usual number of lines unless `[prefetch]` of --config says otherwise
    #[arg(long, value_name = "PREFETCHER")]
    prefetch: Option<Prefetching>,
    /// DRAM below the caches, with two channels unless `[dram]` of --config says otherwise: lpddr4, lpddr5, ddr4, gddr6
    #[arg(long, value_name = "DEVICE", value_parser = named::<DramPreset>)]
    dram: Option<DramPreset>,
    /// Traffic of the whole frame, on a machine with the defaults of `[frame]`; needs a trace with --geometry
    #[arg(long, value_name = "MACHINE")]
    frame: Option<FrameMachine>,

    /// Filter in place of the recorded one: trilinear, bilinear, nearest
    #[arg(long, value_parser = named::<FilterOverride>, help_heading = "Sampling")]
    filter: Option<FilterOverride>,
    /// Level-of-detail formula: llvmpipe, softpipe, exact, per-lane
    #[arg(long, value_parser = named::<LodFormula>, help_heading = "Sampling")]
    lod: Option<LodFormula>,
    /// Added to the level of detail
    #[arg(
        long,
        value_name = "LEVELS",
        allow_hyphen_values = true,
        help_heading = "Sampling"
    )]
    lod_bias: Option<f32>,
    /// Footprints of a long and narrow pixel at most, 1 to 16
    #[arg(long, value_name = "N", help_heading = "Sampling")]
    max_anisotropy: Option<u32>,
    /// How long and narrow pixels are filtered: probes (several footprints along the longer axis, at Vulkan's level),
    /// rounded-probes (at the level of EXT_texture_filter_anisotropic's example), ellipse (all texels of the pixel's
    /// ellipse)
    #[arg(long, value_name = "MODEL", value_parser = named::<AnisotropyModel>, help_heading = "Sampling")]
    anisotropy: Option<AnisotropyModel>,
    /// Count the helper lanes of partly covered quads, too
    #[arg(long, help_heading = "Sampling")]
    helper_lanes: bool,

    /// Format of the colour textures in memory: bc1, bc7, astc-6x6, rgba8, ...
    #[arg(long, value_name = "FORMAT", value_parser = named::<TexelFormat>, help_heading = "Layout")]
    texel_format: Option<TexelFormat>,
    /// Order of the blocks of a level of colour textures: linear, morton, tiled
    #[arg(long, value_parser = named::<BlockOrder>, help_heading = "Layout")]
    block_order: Option<BlockOrder>,
    /// Order of the texels of shadow maps: morton (the default), tiled, linear
    #[arg(long, value_parser = named::<BlockOrder>, help_heading = "Layout")]
    shadow_map_order: Option<BlockOrder>,
    /// Alignment of each texture's first byte
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes, help_heading = "Layout")]
    base_align: Option<u64>,
    /// Order of the textures in memory: table, largest-first
    #[arg(long, value_parser = named::<TextureOrder>, help_heading = "Layout")]
    texture_order: Option<TextureOrder>,

    /// What a thread does whose lines are not in the L1
    #[arg(long, value_name = "MODEL", help_heading = "Texture unit")]
    tmu: Option<TmuModel>,
    /// Cycles that a line takes from the L2 to an L1
    #[arg(long, value_name = "CYCLES", help_heading = "Texture unit")]
    l2_cycles: Option<u32>,
    /// Cycles that a line takes from memory to the last level
    #[arg(long, value_name = "CYCLES", help_heading = "Texture unit")]
    memory_cycles: Option<u32>,
    /// Cycles that a thread which missed takes to be back at the first stage
    #[arg(long, value_name = "CYCLES", help_heading = "Texture unit")]
    loop_cycles: Option<u32>,
    /// Threads (quads) that a core holds at once
    #[arg(long, value_name = "N", help_heading = "Texture unit")]
    tmu_threads: Option<u32>,
    /// Missing footprints that one issue slot tries
    #[arg(long, value_name = "N", help_heading = "Texture unit")]
    retry_footprints: Option<u32>,
    /// Lines that a thread fetches in one trip
    #[arg(long, value_name = "N", help_heading = "Texture unit")]
    fetches_per_trip: Option<u32>,
    /// When a line that misses gets its way in a cache
    #[arg(long, help_heading = "Texture unit")]
    allocation: Option<Allocation>,
}

/// Sets what a flag gives.
fn set<T>(target: &mut T, flag: Option<T>) {
    if let Some(value) = flag {
        *target = value;
    }
}

impl ConfigArgs {
    /// The configuration: the defaults, then `--config`, then the flags.
    ///
    /// # Errors
    /// The file cannot be read, has an unknown key, or the result is impossible.
    pub fn resolve(&self) -> Result<RunConfig> {
        self.resolve_over(RunConfig::default())
    }

    /// The configuration: `defaults` with the preset, or `--config` where it is given, then the flags.
    ///
    /// # Errors
    /// As [`Self::resolve`].
    pub fn resolve_over(&self, defaults: RunConfig) -> Result<RunConfig> {
        let preset = |config| self.preset.map_or(config, |preset| preset.over(config));
        self.resolve_file_over(preset(defaults))
    }

    /// The configuration that is not the preset's: the defaults or `--config`, then the flags.
    ///
    /// # Errors
    /// As [`Self::resolve`].
    pub fn resolve_without_preset(&self) -> Result<RunConfig> {
        self.resolve_file_over(RunConfig::default())
    }

    /// The machine of `--preset`.
    #[must_use]
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
        Ok(config)
    }

    /// The first flag that means something for tiles, textures or the texture unit alone, not for plain
    /// addresses.
    #[must_use]
    pub fn first_of_traces(&self) -> Option<&'static str> {
        let flags = [
            ("--preset", self.preset.is_some()),
            ("--order", self.order.is_some()),
            ("--mode", self.mode.is_some()),
            ("--cores", self.cores.is_some()),
            ("--assign", self.assign.is_some()),
            ("--between-frames", self.between_frames.is_some()),
            ("--count-by", self.count_by.is_some()),
            ("--tile-px", self.tile_px.is_some()),
            ("--hsr", self.hsr.is_some()),
            ("--frame", self.frame.is_some()),
            ("--filter", self.filter.is_some()),
            ("--lod", self.lod.is_some()),
            ("--lod-bias", self.lod_bias.is_some()),
            ("--max-anisotropy", self.max_anisotropy.is_some()),
            ("--anisotropy", self.anisotropy.is_some()),
            ("--helper-lanes", self.helper_lanes),
            ("--texel-format", self.texel_format.is_some()),
            ("--block-order", self.block_order.is_some()),
            ("--shadow-map-order", self.shadow_map_order.is_some()),
            ("--base-align", self.base_align.is_some()),
            ("--texture-order", self.texture_order.is_some()),
            ("--tmu", self.tmu.is_some()),
            ("--l2-cycles", self.l2_cycles.is_some()),
            ("--memory-cycles", self.memory_cycles.is_some()),
            ("--loop-cycles", self.loop_cycles.is_some()),
            ("--tmu-threads", self.tmu_threads.is_some()),
            ("--retry-footprints", self.retry_footprints.is_some()),
            ("--fetches-per-trip", self.fetches_per_trip.is_some()),
            ("--allocation", self.allocation.is_some()),
        ];
        flags
            .into_iter()
            .find(|(_, given)| *given)
            .map(|(flag, _)| flag)
    }

    /// The file of `--config`.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        self.config.as_deref()
    }

    /// Puts the flags over a configuration.
    ///
    /// # Errors
    /// A line size that does not fit its type.
    pub fn apply(&self, config: &mut RunConfig) -> Result<()> {
        set(&mut config.order, self.order);
        set(&mut config.mode, self.mode);
        set(&mut config.level.l1.size_bytes, self.l1);
        set(&mut config.level.l2.size_bytes, self.l2);
        set(&mut config.level.l1.ways, self.l1_ways.or(self.ways));
        set(&mut config.level.l2.ways, self.l2_ways.or(self.ways));
        set(&mut config.level.l1.replacement, self.replacement);
        set(&mut config.level.l2.replacement, self.replacement);
        if let Some(line) = self.line {
            config.line_bytes = u32::try_from(line).context("--line")?;
        }
        set(&mut config.cores, self.cores);
        set(&mut config.assign, self.assign);
        set(&mut config.seed, self.seed);
        set(&mut config.tile_px, self.tile_px);
        set(&mut config.count_by, self.count_by);
        set(&mut config.hsr, self.hsr);
        set(&mut config.between_frames, self.between_frames);
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
        set(&mut config.sampling.filter, self.filter);
        set(&mut config.sampling.lod, self.lod);
        set(&mut config.sampling.lod_bias, self.lod_bias);
        set(&mut config.sampling.max_anisotropy, self.max_anisotropy);
        set(&mut config.sampling.anisotropy, self.anisotropy);
        config.sampling.helper_lanes |= self.helper_lanes;
        set(&mut config.layout.texel_format, self.texel_format.map(Some));
        set(&mut config.layout.block_order, self.block_order);
        set(&mut config.layout.shadow_map_order, self.shadow_map_order);
        set(&mut config.layout.base_align_bytes, self.base_align);
        set(&mut config.layout.texture_order, self.texture_order);
        set(&mut config.tmu.model, self.tmu);
        set(&mut config.level.l2.hit_cycles, self.l2_cycles);
        set(&mut config.memory_cycles, self.memory_cycles);
        set(&mut config.tmu.loop_cycles, self.loop_cycles);
        set(&mut config.tmu.threads, self.tmu_threads);
        set(&mut config.tmu.retry_footprints, self.retry_footprints);
        set(&mut config.tmu.fetches_per_trip, self.fetches_per_trip);
        set(&mut config.tmu.allocation, self.allocation);
        Ok(())
    }
}
