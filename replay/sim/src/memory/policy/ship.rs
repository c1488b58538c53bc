//! Signature-based hit prediction by memory region (SHiP-Mem: Wu et al., MICRO 2011) on SRRIP.
//!
//! A table of counters records per region whether lines are used again after their fill. Lines of
//! regions without reuse are inserted as the next victims.

use super::rrip::{DISTANT, LONG, Predictions};
use super::{Geometry, Policy};

/// Lines of a region: 4 KiB at 16 bytes per line, 16 KiB at 64.
const REGION_LINES: u32 = 256;
/// Counters, 3 bits each.
const SIGNATURES: usize = 1 << 14;
const MOST_COUNTED: u8 = 7;
/// Initial counter of a region.
const UNTRAINED: u8 = 1;

/// Hit prediction per region.
pub(super) struct Ship {
    predictions: Predictions,
    /// The counter of each line's region, and whether the line was used again.
    lines: Vec<(u16, bool)>,
    counters: Vec<u8>,
    ways: u32,
}

/// The counter of a line's region.
const fn signature(line: u32) -> usize {
    let region = line / REGION_LINES;
    (region ^ region >> 14) as usize % SIGNATURES
}

impl Ship {
    pub(super) fn new(geometry: Geometry) -> Self {
        Self {
            predictions: Predictions::new(geometry),
            lines: vec![(0, false); geometry.lines()],
            counters: vec![UNTRAINED; SIGNATURES],
            ways: geometry.ways,
        }
    }
}

impl Policy for Ship {
    fn hit(&mut self, set: u32, way: u32, _line: u32) {
        let (signature, is_reused) = &mut self.lines[(set * self.ways + way) as usize];
        if self.predictions.hit(set, way) && !std::mem::replace(is_reused, true) {
            let counter = &mut self.counters[usize::from(*signature)];
            *counter = (*counter + 1).min(MOST_COUNTED);
        }
    }

    fn fill(&mut self, set: u32, way: u32, line: u32) {
        let signature = signature(line);
        self.lines[(set * self.ways + way) as usize] = (signature as u16, false);
        let prediction = match self.counters[signature] {
            0 => DISTANT,
            _ => LONG,
        };
        self.predictions.fill(set, way, prediction);
    }

    fn victim(&mut self, set: u32) -> u32 {
        let way = self.predictions.victim(set);
        let (signature, is_reused) = self.lines[(set * self.ways + way) as usize];
        if !is_reused {
            let counter = &mut self.counters[usize::from(signature)];
            *counter = counter.saturating_sub(1);
        }
        way
    }

    fn clear(&mut self) {
        self.counters.fill(UNTRAINED);
    }
}
