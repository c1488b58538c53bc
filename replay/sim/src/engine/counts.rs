//! Miss counts of a cache hierarchy.

use crate::memory::Answer;
use crate::stream::Bins;

/// Misses of one level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Misses {
    /// Footprints with at least one line fetched.
    pub footprints: u64,
    /// Lines fetched.
    pub lines: u64,
    /// Look-ups of lines in flight (timed mode only).
    pub secondary: u64,
}

/// Misses of both levels. L1 misses are the L2's look-ups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct CellMisses {
    /// First level.
    pub l1: Misses,
    /// Second level.
    pub l2: Misses,
}

/// Misses of a tile. A tile has fewer than 2^32 accesses, which the expander checks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileMisses {
    /// Footprints with an L1 miss.
    pub l1_footprints: u32,
    /// Lines fetched from memory.
    pub l2_lines: u32,
}

/// Misses among the lines of one footprint.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FootprintMisses {
    /// Lines that the L1 fetched.
    pub l1_lines: u32,
    /// Lines in flight into the L1.
    pub l1_secondary: u32,
    /// Lines that the L2 fetched.
    pub l2_lines: u32,
    /// Lines in flight into the L2.
    pub l2_secondary: u32,
}

impl FootprintMisses {
    /// Counts the L2's answer to a request at `now`, and returns the line's arrival.
    #[inline(always)]
    pub(super) fn count_l2_answer(&mut self, answer: Answer, now: u64) -> u64 {
        match answer {
            Answer::Hit => now,
            Answer::Miss(arrival) => {
                self.l2_lines += 1;
                arrival
            }
            Answer::InFlight(arrival) => {
                self.l2_secondary += 1;
                arrival
            }
        }
    }
}

/// All misses of a replay.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct CacheCounts {
    /// By cell (see [`Bins`]).
    pub cells: Vec<CellMisses>,
    /// By tile; empty unless requested.
    pub tiles: Vec<TileMisses>,
}

impl CacheCounts {
    /// All zero.
    pub fn new(bins: &Bins, tile_maps: bool) -> Self {
        let tiles = if tile_maps { bins.tiles() } else { 0 };
        Self {
            cells: vec![CellMisses::default(); bins.cells()],
            tiles: vec![TileMisses::default(); tiles],
        }
    }

    /// Counts look-ups of lines in flight into the L1.
    #[inline]
    pub(super) fn secondary(&mut self, cell: usize, lines: u32) {
        self.cells[cell].l1.secondary += u64::from(lines);
    }

    /// Counts one or all of the lines that a footprint fetches. `missed` records whether the footprint has
    /// already fetched a line into the L1 and into the L2, and is updated.
    #[inline(always)]
    pub fn fetched(
        &mut self,
        cell: usize,
        tile: usize,
        misses: &FootprintMisses,
        missed: &mut [bool; 2],
    ) {
        let CellMisses { l1, l2 } = &mut self.cells[cell];
        // Branch-free: whether the line belongs to the previous footprint is unpredictable.
        let from_memory = misses.l2_lines > 0;
        let [first, first_from_memory] = [!missed[0], from_memory & !missed[1]].map(u32::from);
        l1.footprints += u64::from(first);
        l1.lines += u64::from(misses.l1_lines);
        l1.secondary += u64::from(misses.l1_secondary);
        l2.footprints += u64::from(first_from_memory);
        l2.lines += u64::from(misses.l2_lines);
        l2.secondary += u64::from(misses.l2_secondary);
        if let Some(tile) = self.tiles.get_mut(tile) {
            tile.l1_footprints += first;
            tile.l2_lines += misses.l2_lines;
        }
        *missed = [true, missed[1] | from_memory];
    }

    /// Counts a footprint with missing lines.
    #[inline]
    pub fn footprint(&mut self, cell: usize, tile: usize, misses: &FootprintMisses) {
        if misses.l1_lines == 0 {
            self.secondary(cell, misses.l1_secondary);
        } else {
            self.fetched(cell, tile, misses, &mut [false; 2]);
        }
    }
}
