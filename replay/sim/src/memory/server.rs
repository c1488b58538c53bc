//! Servers with a fixed interval between items: pipelines, ports and the DRAM channel.

/// Parts of a cycle in which intervals are counted, so that rates need not be whole cycles.
pub const TICKS: u64 = 1 << 16;

/// Ticks of a number of cycles, at least one.
pub fn ticks(cycles: f64) -> u64 {
    (cycles * TICKS as f64).round().max(1.0) as u64
}

/// The time at which an item is served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Served {
    /// Cycle in which it starts.
    pub start: u64,
    /// First cycle that it does not occupy.
    pub end: u64,
}

/// Equal servers with one queue, first come, first served.
#[derive(Clone, Debug)]
pub struct Servers {
    /// Tick at which each server is free.
    free: Vec<u64>,
    interval: u64,
}

impl Servers {
    /// `count` free servers that each take an item every `interval` ticks.
    pub fn new(count: u32, interval: u64) -> Self {
        Self {
            free: vec![0; count.max(1) as usize],
            interval,
        }
    }

    /// Serves an item that arrives in cycle `now`. Cycles never decrease from call to call.
    pub fn take(&mut self, now: u64) -> Served {
        let mut first = 0;
        for at in 1..self.free.len() {
            if self.free[at] < self.free[first] {
                first = at;
            }
        }
        let start = self.free[first].max(now * TICKS);
        self.free[first] = start + self.interval;
        Served {
            start: start / TICKS,
            end: self.free[first].div_ceil(TICKS),
        }
    }

    /// First cycle in which a server can take another item.
    pub fn ready(&self) -> u64 {
        self.free.iter().min().map_or(0, |free| free / TICKS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_servers_take_two_items_a_cycle_and_queue_the_rest() {
        let mut servers = Servers::new(2, TICKS);
        let starts: Vec<u64> = (0..5).map(|_| servers.take(10).start).collect();
        assert_eq!(starts, [10, 10, 11, 11, 12]);
        assert_eq!(servers.ready(), 12);
    }

    #[test]
    fn a_rate_that_is_no_whole_number_holds_on_average() {
        let mut servers = Servers::new(1, ticks(1.0 / 0.75));
        let last = (0..750).map(|_| servers.take(0).start).last();
        assert_eq!(
            last,
            Some(998),
            "the 750th item starts after 749 / 0.75 cycles"
        );
    }
}
