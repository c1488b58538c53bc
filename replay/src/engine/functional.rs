//! Caches without latencies: a miss fills at once.

use super::counts::{CacheCounts, FootprintMisses};
use crate::cache::{Cache, Levels};
use crate::stream::{Consumer, Lines};

/// L1 caches over a shared L2.
pub struct Functional<C> {
    levels: Levels<C>,
    /// What missed.
    pub counts: CacheCounts,
    /// The current quad's.
    core: usize,
    tile: usize,
}

impl<C: Cache> Functional<C> {
    /// Empty caches.
    pub fn new(levels: Levels<C>, counts: CacheCounts) -> Self {
        Self {
            levels,
            counts,
            core: 0,
            tile: 0,
        }
    }

    /// A footprint's lines that missed the L1 go to the L2.
    #[inline(never)]
    fn missed(&mut self, cell: usize, lines: &[u32]) {
        let mut misses = FootprintMisses {
            l1_lines: lines.len() as u32,
            ..FootprintMisses::default()
        };
        for &line in lines {
            self.counts.touched.insert(line);
            misses.l2_lines += u32::from(!self.levels.l2.access(line));
        }
        self.counts.footprint(cell, self.tile, &misses);
    }
}

impl<C: Cache> Consumer for Functional<C> {
    #[inline(always)]
    fn quad(&mut self, core: usize, tile: usize) {
        (self.core, self.tile) = (core, tile);
    }

    #[inline(always)]
    fn footprint(&mut self, cell: usize, lines: Lines<'_>) -> bool {
        let l1 = &mut self.levels.l1[self.core];
        let safe = lines.count() <= l1.repeat_safe_lines();
        // One line, there: what nearly all footprints find.
        if let Some(line) = lines.only() {
            if !l1.access(line) {
                self.missed(cell, &[line]);
            }
            return safe;
        }
        let (mut missing, mut count) = ([0; 4], 0);
        for line in lines.iter() {
            if !l1.access(line) {
                missing[count] = line;
                count += 1;
            }
        }
        if count > 0 {
            self.missed(cell, &missing[..count]);
        }
        safe
    }
}
