//! A replay over time: which core holds which tiles when, and what its cycles go to.

use sim::order::TileRef;
use sim::result::Timeline;

const INTERVAL_CYCLES: u64 = Timeline::INTERVAL_CYCLES;

/// The time from when a core takes an item, or its part of one, until its tiles are written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileSpan {
    /// The core.
    pub core: usize,
    /// The slot of the core that the item takes. The spans of a slot do not overlap.
    pub slot: usize,
    /// First cycle, and the cycle after the last one.
    pub cycles: [u64; 2],
    /// Tiles of the item.
    pub tiles: Vec<TileRef>,
}

/// A replay over time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameTimeline {
    /// Items, phase by phase and core by core.
    pub spans: Vec<TileSpan>,
    /// Of each core and interval of [`Timeline::INTERVAL_CYCLES`]: cycles by cause, in the order of
    /// [`CoreCycles::NAMES`](super::CoreCycles::NAMES).
    pub causes: Vec<Vec<[u16; 9]>>,
}

/// What a core records.
#[derive(Debug, Default)]
pub struct CoreRecord {
    /// Slot, cycles, and the item's position in the scheduler's list.
    pub held: Vec<(usize, [u64; 2], usize)>,
    /// Cycles by cause in each interval.
    pub causes: Vec<[u16; 9]>,
}

impl CoreRecord {
    /// Adds cycles from `at` on, which follow each other cause by cause.
    pub fn add(&mut self, mut at: u64, cycles: [u64; 9]) {
        for (cause, mut left) in cycles.into_iter().enumerate() {
            while left > 0 {
                let interval = (at / INTERVAL_CYCLES) as usize;
                if self.causes.len() <= interval {
                    self.causes.resize(interval + 1, [0; 9]);
                }
                let here = left.min(INTERVAL_CYCLES - at % INTERVAL_CYCLES);
                self.causes[interval][cause] += here as u16;
                (at, left) = (at + here, left - here);
            }
        }
    }
}
