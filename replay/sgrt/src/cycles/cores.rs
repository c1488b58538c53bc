//! The shader cores: they work on one tile at a time, in order, after its rays have returned.

use sim::memory::SimpleMemory;

/// What the cores do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Idle,
    Computing,
    /// The kernels have ended, transfers have not.
    Transferring,
}

/// The cores.
pub struct Cores {
    phase: Phase,
    /// Cycles in which the cores waited for the transfers of a tile.
    pub wait_cycles: u64,
}

impl Cores {
    /// Idle cores.
    pub fn new() -> Self {
        Self {
            phase: Phase::Idle,
            wait_cycles: 0,
        }
    }

    /// True without a tile.
    pub fn are_idle(&self) -> bool {
        self.phase == Phase::Idle
    }

    /// Starts a tile. Returns the cycle of the next event.
    pub fn start(&mut self, now: u64, cycles: u64, lines: u64, dram: &mut SimpleMemory) -> u64 {
        let cycles = cycles.max(1);
        self.phase = Phase::Computing;
        dram.start_stream(now, cycles, lines);
        now + cycles
    }

    /// Handles the event of cycle `now`. Returns the cycle of the next event, or `None` if the tile is finished.
    pub fn proceed(&mut self, now: u64, dram: &mut SimpleMemory) -> Option<u64> {
        if self.phase == Phase::Computing {
            let end = dram.end_stream(now);
            if end > now {
                self.phase = Phase::Transferring;
                self.wait_cycles += end - now;
                return Some(end);
            }
        }
        self.phase = Phase::Idle;
        None
    }
}
