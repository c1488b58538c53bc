//! DRAM model: row activations, time and energy of the lines that miss the last cache level.
//!
//! [`Dram`] is open-loop: requests arrive when the caches issue them, and the caches' own memory
//! latency (`memory_cycles`) does not change. [`ClosedLoop`] answers each request when its data has
//! arrived. Requests read or write whole bursts.
//!
//! Writes have their own queue. A channel switches to writes when that queue is four fifths full or
//! no read waits, and back to reads when it is down to one fifth, as in Ramulator.
//!
//! The scheduler is FR-FCFS (Rixner et al., ISCA 2000): of the commands that can be issued first,
//! accesses to open rows take precedence, then older requests. A row is closed only when no queued
//! request needs it.

mod channel;
mod closed_loop;
mod mapping;
mod presets;
mod result;
#[cfg(test)]
mod tests;

pub use closed_loop::{Channels, ClosedLoop};
pub use mapping::Mapping;
pub use presets::{Device, DramPreset};
pub use result::DramResult;

use crate::config::settings;
use channel::Channel;
use mapping::Mapper;

crate::choices! { #[non_exhaustive] PagePolicy = "What happens to a row after its last queued access.", default Open:
    Open = "open", "It stays open until a request needs another row of its bank.";
    Closed = "closed", "It is closed immediately.";
}

settings! {
    /// The `[dram]` table of a configuration.
    #[derive(Eq)]
    pub struct DramConfig in "dram." {
        /// Device and timings.
        pub preset: DramPreset = DramPreset::default();
        /// Number of channels, a power of two.
        pub channels: u32 = 2;
        /// Which address bits select channel, bank, row and column.
        pub mapping: Mapping = Mapping::default();
        /// What happens to a row that no queued request needs.
        pub page_policy: PagePolicy = PagePolicy::default();
        /// Requests visible to a channel's scheduler; further requests wait in order of arrival.
        pub queue: u32 = 32, in 1..=1024;
        /// GPU clock in MHz. Request times are in GPU cycles.
        pub core_mhz: u32 = 600, in 1..=100_000;
    }
}

/// A memory of several channels.
#[derive(Clone, Debug)]
pub struct Dram {
    config: DramConfig,
    device: Device,
    mapper: Mapper,
    channels: Vec<Channel>,
    line_bytes: u32,
    requests: u64,
    /// Clock of the last request with a time.
    last: u64,
    /// Clocks spent on requests without a time, which the GPU's cycles do not include.
    late_by: u64,
}

impl Dram {
    /// A memory with all rows closed, accessed in lines of `line_bytes`.
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

    /// Reads a line at a GPU cycle, but not before the last request. Without a cycle, the read
    /// arrives as soon as the channel's queue has room.
    pub fn read(&mut self, line: u32, cycle: Option<u64>) {
        let bytes = self.line_bytes.into();
        self.request(u64::from(line) * bytes, bytes, false, cycle);
    }

    /// Reads or writes bytes, line by line.
    pub fn request(&mut self, address: u64, bytes: u64, write: bool, cycle: Option<u64>) {
        self.requests += bytes.div_ceil(self.line_bytes.into());
        let burst = u64::from(self.device.burst_bytes);
        let clock = cycle.map(|cycle| {
            let clock = self.device.clock(cycle, self.config.core_mhz) + self.late_by;
            self.last = self.last.max(clock);
            self.last
        });
        for number in address / burst..=(address + bytes - 1) / burst {
            let place = self.mapper.place(number);
            self.channels[place.channel as usize].arrive(place, write, clock);
        }
    }

    /// Delays all requests from `cycle` on by the time that requests without a time have taken.
    pub fn catch_up(&mut self, cycle: u64) {
        let clock = self.device.clock(cycle, self.config.core_mhz);
        let now = self.channels.iter().map(Channel::now).max().unwrap_or(0);
        self.late_by = self.late_by.max(now.saturating_sub(clock));
    }

    /// Serves all requests and returns the counts.
    pub fn result(&self) -> DramResult {
        let mut channels = self.channels.clone();
        channels.iter_mut().for_each(Channel::drain);
        DramResult::of(
            &self.config,
            &self.device,
            &channels,
            self.requests,
            self.line_bytes,
        )
    }
}
