//! DRAM: what the lines that leave the last cache cost in row activations, time and energy.
//!
//! The model is open loop: requests arrive when the caches ask for them, and the caches' own latency
//! ([`crate::config::RunConfig::memory_cycles`]) stays what it is. Requests are reads of whole bursts.
//!
//! A channel schedules as FR-FCFS (Rixner et al., ISCA 2000): of the commands that may be issued first, reads of open
//! rows go before others, and older requests before younger ones. A row is closed only when no queued request reads it.

mod channel;
mod mapping;
mod presets;
mod result;
#[cfg(test)]
mod tests;

pub use mapping::Mapping;
pub use presets::{Device, DramPreset};
pub use result::DramResult;

use crate::config::{ConfigError, accept, in_range};
use channel::Channel;
use mapping::Mapper;
use serde::{Deserialize, Serialize};

/// What becomes of a row after its last queued read.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum PagePolicy {
    /// It stays open until another row of its bank is wanted.
    #[default]
    Open,
    /// It is closed at once.
    Closed,
}

/// The `[dram]` table of a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DramConfig {
    /// Device, with the timings of its standard.
    pub preset: DramPreset,
    /// Channels, a power of two.
    pub channels: u32,
    /// Which bits of an address are channel, bank, row and column.
    pub mapping: Mapping,
    /// What becomes of a row that no queued request reads.
    pub page_policy: PagePolicy,
    /// Requests that a channel's scheduler sees at a time; others wait in the order of arrival.
    pub queue: u32,
    /// Clock of the GPU, whose cycles the requests' times are, MHz.
    pub core_mhz: u32,
}

impl Default for DramConfig {
    fn default() -> Self {
        Self {
            preset: DramPreset::default(),
            channels: 2,
            mapping: Mapping::default(),
            page_policy: PagePolicy::default(),
            queue: 32,
            core_mhz: 600,
        }
    }
}

impl DramConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first one out of range.
    pub fn check(&self) -> Result<(), ConfigError> {
        accept(
            self.channels.is_power_of_two() && self.channels <= 64,
            "dram.channels",
            "a power of two up to 64",
            self.channels,
        )?;
        in_range("dram.queue", self.queue, 1..=1024)?;
        in_range("dram.core_mhz", self.core_mhz, 1..=100_000)
    }
}

/// The channels of a memory.
#[derive(Clone, Debug)]
pub struct Dram {
    config: DramConfig,
    device: Device,
    mapper: Mapper,
    channels: Vec<Channel>,
    line_bytes: u32,
    requests: u64,
    /// Clock of the last request that had a time.
    last: u64,
}

impl Dram {
    /// All rows closed. Lines have so many bytes.
    #[must_use]
    pub fn new(config: &DramConfig, line_bytes: u32) -> Self {
        let device = config.preset.device();
        let channel = || Channel::new(device, config.queue as usize, config.page_policy);
        Self {
            config: *config,
            device,
            mapper: Mapper::new(config.mapping, config.channels, &device),
            channels: (0..config.channels).map(|_| channel()).collect(),
            line_bytes,
            requests: 0,
            last: 0,
        }
    }

    /// A line is asked for at a cycle of the GPU; one before the last request's counts as that. Without a time it arrives
    /// as soon as the channel's queue has a place.
    pub fn read(&mut self, line: u32, cycle: Option<u64>) {
        self.requests += 1;
        let first = u64::from(line) * u64::from(self.line_bytes);
        let last = first + u64::from(self.line_bytes) - 1;
        let burst = u64::from(self.device.burst_bytes);
        let clock = cycle.map(|cycle| {
            let ps = u128::from(cycle) * 1_000_000 / u128::from(self.config.core_mhz);
            self.last = self
                .last
                .max((ps / u128::from(self.device.clock_ps)) as u64);
            self.last
        });
        for number in first / burst..=last / burst {
            let place = self.mapper.place(number);
            self.channels[place.channel as usize].arrive(place, clock);
        }
    }

    /// What was counted, all requests answered.
    #[must_use]
    pub fn result(&self) -> DramResult {
        let mut channels = self.channels.clone();
        channels.iter_mut().for_each(Channel::drain);
        DramResult::of(&self.config, &self.device, &channels, self.requests)
    }
}
