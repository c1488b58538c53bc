//! A cache without latencies: a missing line is filled when it is requested.

use super::{Cache, DelayedFill, NOT_IN_FLIGHT};

/// A cache in which no line is in flight.
pub struct Immediate<C>(pub C);

impl<C: Cache> DelayedFill for Immediate<C> {
    const HAS_LATENCIES: bool = false;

    fn look_up(&mut self, line: u32, _now: u64) -> u64 {
        if self.0.lookup(line) {
            0
        } else {
            NOT_IN_FLIGHT
        }
    }

    fn arrival(&mut self, _line: u32, _now: u64) -> u64 {
        NOT_IN_FLIGHT
    }

    fn holds(&mut self, line: u32, _now: u64) -> bool {
        self.0.contains(line)
    }

    fn enter(&mut self, line: u32, _now: u64, _arrival: u64) {
        self.0.fill(line);
    }

    fn remove(&mut self, line: u32, _now: u64) -> bool {
        self.0.remove(line)
    }

    fn take_evicted(&mut self, lines: &mut Vec<u32>) {
        self.0.take_evicted(lines);
    }

    fn clear(&mut self) {
        self.0.clear();
    }
}
