//! Signature-based hit prediction by memory region (SHiP-Mem: Wu et al., MICRO 2011) on SRRIP.
//!
//! A table of counters records per region whether lines are used again after their fill. Lines of
//! regions without reuse are inserted as the next victims.

use super::rrip::{DISTANT, LONG, Sets};
use crate::memory::cache::{Cache, EMPTY};

/// Lines of a region: 4 KiB at 16 bytes per line, 16 KiB at 64.
const REGION_LINES: u32 = 256;
/// Counters, 3 bits each.
const SIGNATURES: usize = 1 << 14;
const MOST_COUNTED: u8 = 7;
/// Initial counter of a region.
const UNTRAINED: u8 = 1;

/// A cache with hit prediction per region.
pub(super) struct Ship {
    sets: Sets,
    /// Whether the line at each place was used again.
    is_reused: Vec<bool>,
    counters: Vec<u8>,
}

/// The counter of a line's region.
const fn signature(line: u32) -> usize {
    let region = line / REGION_LINES;
    (region ^ region >> 14) as usize % SIGNATURES
}

impl Ship {
    /// An empty cache; `sets` is a power of two, `ways` at most 255.
    pub fn new(sets: u32, ways: u32) -> Self {
        Self {
            sets: Sets::new(sets, ways),
            is_reused: vec![false; sets as usize * ways as usize],
            counters: vec![UNTRAINED; SIGNATURES],
        }
    }
}

impl Cache for Ship {
    fn lookup(&mut self, line: u32) -> bool {
        let found = self.sets.lookup(line);
        if let Some((place, true)) = found
            && !self.is_reused[place]
        {
            self.is_reused[place] = true;
            let counter = &mut self.counters[signature(line)];
            *counter = (*counter + 1).min(MOST_COUNTED);
        }
        found.is_some()
    }

    fn contains(&self, line: u32) -> bool {
        self.sets.contains(line)
    }

    fn fill(&mut self, line: u32) -> u32 {
        let place = self.sets.victim(self.sets.set(line));
        let victim = self.sets.line(place);
        if victim != EMPTY && !self.is_reused[place] {
            let counter = &mut self.counters[signature(victim)];
            *counter = counter.saturating_sub(1);
        }
        self.is_reused[place] = false;
        let prediction = match self.counters[signature(line)] {
            0 => DISTANT,
            _ => LONG,
        };
        self.sets.insert(place, line, prediction);
        victim
    }

    fn remove(&mut self, line: u32) -> bool {
        self.sets.remove(line)
    }

    fn clear(&mut self) {
        self.sets.clear();
        self.is_reused.fill(false);
        self.counters.fill(UNTRAINED);
    }
}
