//! The DRAM model in a closed loop: requests have numbers, and each is answered in the cycle in which its last data
//! has arrived. With FR-FCFS that cycle is unknown at the request, because later requests may be served first.

use super::{Dram, DramConfig, DramResult};
use std::collections::HashMap;

/// A memory that answers.
#[derive(Clone, Debug)]
pub struct ClosedLoop {
    dram: Dram,
    /// Bursts of each unanswered request, and the clock of its last data so far.
    open: HashMap<u64, (u32, u64)>,
    poll_cycles: u64,
}

impl ClosedLoop {
    /// An idle memory, accessed in lines of `line_bytes`.
    pub fn new(config: &DramConfig, line_bytes: u32) -> Self {
        let dram = Dram::new(config, line_bytes);
        let device = &dram.device;
        // Two clocks less, because cycles and clocks are rounded.
        let clocks = u64::from(device.cl.min(device.cwl) + device.burst - 2);
        let ps = clocks * u64::from(device.clock_ps);
        Self {
            poll_cycles: (ps * u64::from(config.core_mhz) / 1_000_000).max(1),
            dram,
            open: HashMap::new(),
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
        let dram = &self.dram;
        let mut places = dram.bursts(line).map(|number| dram.mapper.place(number));
        let has_room = places.all(|at| dram.channels[at.channel as usize].takes_writes());
        if has_room {
            self.request(cycle, line, true, number);
        }
        has_room
    }

    fn request(&mut self, cycle: u64, line: u32, write: bool, number: u64) {
        let dram = &mut self.dram;
        let clock = dram.clock(cycle);
        dram.requests += 1;
        let bursts = dram.bursts(line);
        self.open.insert(number, (bursts.clone().count() as u32, 0));
        for burst in bursts {
            let place = dram.mapper.place(burst);
            dram.channels[place.channel as usize].arrive_numbered(place, write, clock, number);
        }
    }

    /// Issues the commands before `cycle`, and appends the requests answered since the last call, each with its cycle.
    pub fn advance(&mut self, cycle: u64, answered: &mut Vec<(u64, u64)>) {
        let clock = self.dram.clock(cycle);
        let config = self.dram.config;
        let ps = u128::from(self.dram.device.clock_ps) * u128::from(config.core_mhz);
        for channel in &mut self.dram.channels {
            channel.advance(clock);
            for (number, data) in channel.answered.drain(..) {
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
    }

    /// The counts so far.
    pub fn result(&self) -> DramResult {
        self.dram.result()
    }
}
