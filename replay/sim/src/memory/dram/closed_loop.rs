//! DRAM in a closed loop: requests have numbers, and each is answered in the cycle in which its last data has arrived.
//! With FR-FCFS that cycle is unknown at the request, because later requests may be served first.

use super::{Device, Dram, DramConfig, DramResult};
use std::collections::HashMap;
use std::ops::RangeInclusive;

/// The channels of a memory in a closed loop. Clocks never decrease from call to call.
pub trait Channels: Send {
    /// True if the write queue of this burst's channel has room.
    fn takes_write(&self, burst: u64) -> bool;

    /// Adds a burst, which arrives at `clock`. The caller has checked that a write finds room.
    fn request(&mut self, burst: u64, write: bool, clock: u64, number: u64);

    /// Issues the commands before `clock`, and appends the numbers of the bursts answered since the last call, each
    /// with the clock of its last data.
    fn advance(&mut self, clock: u64, answered: &mut Vec<(u64, u64)>);

    /// The counts of bursts so far. Lines are not counted.
    fn result(&self) -> DramResult;
}

impl Channels for Dram {
    fn takes_write(&self, burst: u64) -> bool {
        let channel = self.mapper.place(burst).channel;
        self.channels[channel as usize].takes_writes()
    }

    fn request(&mut self, burst: u64, write: bool, clock: u64, number: u64) {
        let place = self.mapper.place(burst);
        self.channels[place.channel as usize].arrive_numbered(place, write, clock, number);
    }

    fn advance(&mut self, clock: u64, answered: &mut Vec<(u64, u64)>) {
        for channel in &mut self.channels {
            channel.advance(clock);
            answered.append(&mut channel.answered);
        }
    }

    fn result(&self) -> DramResult {
        Self::result(self)
    }
}

/// A memory that answers.
pub struct ClosedLoop {
    channels: Box<dyn Channels>,
    device: Device,
    core_mhz: u32,
    line_bytes: u64,
    /// Bursts of each unanswered request, and the clock of its last data so far.
    open: HashMap<u64, (u32, u64)>,
    poll_cycles: u64,
    /// Bursts answered in a call.
    bursts: Vec<(u64, u64)>,
}

impl ClosedLoop {
    /// An idle memory of these channels, accessed in lines of `line_bytes`.
    pub fn new(channels: Box<dyn Channels>, config: &DramConfig, line_bytes: u32) -> Self {
        let device = config.preset.device();
        // Two clocks less, because cycles and clocks are rounded.
        let clocks = u64::from(device.cl.min(device.cwl) + device.burst - 2);
        let ps = clocks * u64::from(device.clock_ps);
        Self {
            poll_cycles: (ps * u64::from(config.core_mhz) / 1_000_000).max(1),
            channels,
            device,
            core_mhz: config.core_mhz,
            line_bytes: line_bytes.into(),
            open: HashMap::new(),
            bursts: Vec::new(),
        }
    }

    /// Cycles after which [`Self::advance`] must be called while requests are open. Data follows its command by at
    /// least this time, so no answer is late.
    pub const fn poll_cycles(&self) -> u64 {
        self.poll_cycles
    }

    /// True while requests are unanswered.
    pub fn is_busy(&self) -> bool {
        !self.open.is_empty()
    }

    /// Reads a line. Cycles never decrease from call to call.
    pub fn read(&mut self, cycle: u64, line: u32, number: u64) {
        self.request(cycle, line, false, number);
    }

    /// Writes a line. Returns false if a channel's queue of writes is full.
    pub fn write(&mut self, cycle: u64, line: u32, number: u64) -> bool {
        let has_room = (self.bursts_of(line)).all(|burst| self.channels.takes_write(burst));
        if has_room {
            self.request(cycle, line, true, number);
        }
        has_room
    }

    fn request(&mut self, cycle: u64, line: u32, write: bool, number: u64) {
        let clock = self.device.clock(cycle, self.core_mhz);
        let bursts = self.bursts_of(line);
        self.open.insert(number, (bursts.clone().count() as u32, 0));
        for burst in bursts {
            self.channels.request(burst, write, clock, number);
        }
    }

    /// Numbers of the bursts of a line.
    fn bursts_of(&self, line: u32) -> RangeInclusive<u64> {
        let (first, burst) = (
            u64::from(line) * self.line_bytes,
            u64::from(self.device.burst_bytes),
        );
        first / burst..=(first + self.line_bytes - 1) / burst
    }

    /// Issues the commands before `cycle`, and appends the requests answered since the last call, each with its cycle.
    pub fn advance(&mut self, cycle: u64, answered: &mut Vec<(u64, u64)>) {
        let clock = self.device.clock(cycle, self.core_mhz);
        let ps = u128::from(self.device.clock_ps) * u128::from(self.core_mhz);
        self.channels.advance(clock, &mut self.bursts);
        for (number, data) in self.bursts.drain(..) {
            let Some((bursts, last)) = self.open.get_mut(&number) else {
                continue;
            };
            (*bursts, *last) = (*bursts - 1, data.max(*last));
            if *bursts == 0 {
                let at = (u128::from(*last) * ps).div_ceil(1_000_000) as u64;
                answered.push((number, at));
                self.open.remove(&number);
            }
        }
    }

    /// The counts so far.
    pub fn result(&self) -> DramResult {
        self.channels.result()
    }
}
