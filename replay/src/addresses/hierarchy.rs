//! One configuration: a first level over a second, of any policy.

use super::lines::BLOCK;
use super::{Caches, Distinct};
use crate::cache::{Cache, Levels};
use crate::config::RunConfig;

/// Both levels, each taking a block of lines at once and handing on what it missed.
pub struct Hierarchy<C> {
    config: RunConfig,
    levels: Levels<C>,
    misses: [[u64; 3]; 2],
    /// Places in the block of what missed a level.
    missed: [Box<[u16; BLOCK]>; 2],
    /// The lines that missed both.
    lines: Vec<u32>,
}

impl<C: Cache> Hierarchy<C> {
    /// Empty caches of one core.
    pub fn new(config: RunConfig, levels: Levels<C>) -> Self {
        Self {
            config,
            levels,
            misses: [[0; 3]; 2],
            missed: [Box::new([0; BLOCK]), Box::new([0; BLOCK])],
            lines: Vec::with_capacity(BLOCK),
        }
    }
}

impl<C: Cache> Caches for Hierarchy<C> {
    fn access(&mut self, block: &Distinct<'_>) -> &[u32] {
        let (l1, l2) = (&mut self.levels.l1[0], &mut self.levels.l2);
        let [first, second] = &mut self.missed;
        let mut count = 0;
        for (place, &line) in block.lines.iter().enumerate() {
            // No branch: whether a line is there is a coin toss to the processor.
            first[count % BLOCK] = place as u16;
            count += usize::from(!l1.access(line));
        }
        let first = &first[..count];
        let mut count = 0;
        for &place in first {
            second[count % BLOCK] = place;
            count += usize::from(!l2.access(block.lines[usize::from(place)]));
        }
        let second = &second[..count];
        block.count(first, &mut self.misses[0]);
        block.count(second, &mut self.misses[1]);
        self.lines.clear();
        let lines = second.iter().map(|&place| block.lines[usize::from(place)]);
        self.lines.extend(lines);
        &self.lines
    }

    fn misses(&self, config: &RunConfig) -> Option<[[u64; 3]; 2]> {
        (self.config == *config).then_some(self.misses)
    }
}
