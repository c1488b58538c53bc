//! DRAM: what the lines that leave the last cache cost in row activations, time and energy.
//!
//! The model is open loop: requests arrive when the caches ask for them, and the caches' own latency
//! (`memory_cycles`) stays what it is. Requests are reads and writes of whole bursts.
//!
//! Writes wait in a queue of their own. A channel turns to them when that queue is four fifths full or no read waits, and back
//! to reads when it is down to a fifth, as Ramulator does.
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
    /// Clocks that requests without a time took which the GPU's cycles do not count.
    late_by: u64,
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
            late_by: 0,
        }
    }

    /// A line is read at a cycle of the GPU; one before the last request's counts as that. Without a time it arrives as
    /// soon as the channel's queue has a place.
    pub fn read(&mut self, line: u32, cycle: Option<u64>) {
        let bytes = self.line_bytes.into();
        self.request(u64::from(line) * bytes, bytes, false, cycle);
    }

    /// Bytes are read or written, line by line.
    pub fn request(&mut self, address: u64, bytes: u64, write: bool, cycle: Option<u64>) {
        self.requests += bytes.div_ceil(self.line_bytes.into());
        let burst = u64::from(self.device.burst_bytes);
        let clock = cycle.map(|cycle| {
            let ps = u128::from(cycle) * 1_000_000 / u128::from(self.config.core_mhz);
            let clock = (ps / u128::from(self.device.clock_ps)) as u64 + self.late_by;
            self.last = self.last.max(clock);
            self.last
        });
        for number in address / burst..=(address + bytes - 1) / burst {
            let place = self.mapper.place(number);
            self.channels[place.channel as usize].arrive(place, write, clock);
        }
    }

    /// Requests without a time took as long as they took: what comes at `cycle` or later comes so much later.
    pub fn catch_up(&mut self, cycle: u64) {
        let ps = u128::from(cycle) * 1_000_000 / u128::from(self.config.core_mhz);
        let clock = (ps / u128::from(self.device.clock_ps)) as u64;
        let now = self.channels.iter().map(Channel::now).max().unwrap_or(0);
        self.late_by = self.late_by.max(now.saturating_sub(clock));
    }

    /// What was counted, all requests answered.
    #[must_use]
    pub fn result(&self) -> DramResult {
        let mut channels = self.channels.clone();
        channels.iter_mut().for_each(Channel::drain);
        DramResult::of(&self.config, &self.device, &channels, self.requests)
    }
}
