//! A machine as a table of keys: the value of each, its range where it is not published, and its source.

use crate::config::{RunConfig, SetIndex};
use crate::memory::dram::{DramConfig, DramPreset};
use crate::size::format_bytes;

/// A GPU as published or measured.
#[derive(Debug)]
pub struct Machine {
    /// Name of the preset.
    pub name: &'static str,
    /// The GPU, its chips and devices, and the year of the first.
    pub help: &'static str,
    /// Its keys.
    pub settings: &'static [Setting],
}

/// A key of a machine.
#[derive(Debug)]
pub struct Setting {
    /// The key.
    pub key: Key,
    /// Its value.
    pub value: u64,
    /// Lowest and highest value if the value is not published for this GPU.
    pub range: Option<[u64; 2]>,
    /// Document or measurement of the value, or the reason of the range.
    pub source: &'static str,
}

/// Keys that machines set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// Shader cores with an L1 of their own.
    Cores,
    /// Width and height of a tile in pixels.
    TilePx,
    /// Line of both caches in bytes.
    LineBytes,
    /// Texture cache of a core in bytes.
    L1Bytes,
    /// Ways of the texture cache.
    L1Ways,
    /// L2 in bytes.
    L2Bytes,
    /// Ways of the L2.
    L2Ways,
    /// Set index of the L2: a position in [`SetIndex::ALL`].
    L2SetIndex,
    /// DRAM device: a position in [`DramPreset::ALL`].
    DramDevice,
    /// DRAM channels.
    DramChannels,
}

impl Key {
    /// The key of a configuration.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cores => "cores",
            Self::TilePx => "tile_px",
            Self::LineBytes => "line_bytes",
            Self::L1Bytes => "level.l1.size_bytes",
            Self::L1Ways => "level.l1.ways",
            Self::L2Bytes => "level.l2.size_bytes",
            Self::L2Ways => "level.l2.ways",
            Self::L2SetIndex => "level.l2.set_index",
            Self::DramDevice => "dram.preset",
            Self::DramChannels => "dram.channels",
        }
    }

    /// A value as text.
    pub fn text(self, value: u64) -> String {
        match self {
            Self::L1Bytes | Self::L2Bytes => format_bytes(value),
            Self::L2SetIndex => SetIndex::ALL[value as usize].name().to_owned(),
            Self::DramDevice => DramPreset::ALL[value as usize].name().to_owned(),
            _ => value.to_string(),
        }
    }

    fn set(self, config: &mut RunConfig, value: u64) {
        let small = || u32::try_from(value).expect("a value of the table");
        let level = &mut config.level;
        match self {
            Self::Cores => config.cores = small(),
            Self::TilePx => config.tile_px = small(),
            Self::LineBytes => config.line_bytes = small(),
            Self::L1Bytes => level.l1.size_bytes = value,
            Self::L1Ways => level.l1.ways = small(),
            Self::L2Bytes => level.l2.size_bytes = value,
            Self::L2Ways => level.l2.ways = small(),
            Self::L2SetIndex => level.l2.set_index = SetIndex::ALL[value as usize],
            Self::DramDevice => dram(config).preset = DramPreset::ALL[value as usize],
            Self::DramChannels => dram(config).channels = small(),
        }
    }

    /// Keys of one group take their low values together, and their high values. Ways and set index are one group: from
    /// the organisation with most conflicts to the one with fewest.
    fn group(self) -> Self {
        match self {
            Self::L2Ways | Self::L2SetIndex => Self::L1Ways,
            key => key,
        }
    }
}

fn dram(config: &mut RunConfig) -> &mut DramConfig {
    config.dram.get_or_insert_default()
}

impl Machine {
    /// Returns `config` with the machine's values.
    pub fn over(&self, config: RunConfig) -> RunConfig {
        self.with(config, |setting| setting.value)
    }

    fn with(&self, mut config: RunConfig, value: impl Fn(&Setting) -> u64) -> RunConfig {
        for setting in self.settings {
            setting.key.set(&mut config, value(setting));
        }
        config
    }

    /// Settings with a range.
    pub fn ranged(&self) -> impl Iterator<Item = &'static Setting> {
        self.settings
            .iter()
            .filter(|setting| setting.range.is_some())
    }

    /// Returns `config` at every corner of the ranges, or nothing if all values are published.
    pub fn corners(&self, config: RunConfig) -> Vec<RunConfig> {
        let mut groups: Vec<Key> = Vec::new();
        for setting in self.ranged() {
            if !groups.contains(&setting.key.group()) {
                groups.push(setting.key.group());
            }
        }
        let corner = |bits: usize| {
            self.with(config, |setting| {
                let place = groups
                    .iter()
                    .position(|group| *group == setting.key.group());
                match (setting.range, place) {
                    (Some(ends), Some(place)) => ends[(bits >> place) & 1],
                    _ => setting.value,
                }
            })
        };
        match groups.len() {
            0 => Vec::new(),
            groups => (0..1 << groups).map(corner).collect(),
        }
    }

    /// The ranges in words.
    pub fn ranges_text(&self) -> String {
        let text = |setting: &Setting| {
            let [low, high] = setting.range.unwrap_or([setting.value; 2]);
            let [low, high] = [low, high].map(|value| setting.key.text(value));
            format!("{} {low} to {high}", setting.key.name())
        };
        self.ranged().map(text).collect::<Vec<_>>().join(", ")
    }
}
