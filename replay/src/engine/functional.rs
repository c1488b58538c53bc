//! Caches without latencies, of any policy: a miss fills at once.

use super::batch::Outcome;
use super::counts::{CacheCounts, FootprintMisses};
use super::{Machine, OtherWork};
use crate::cache::{Cache, Levels, MissPath, SharedLevel};
use crate::config::{Assign, RunConfig};
use crate::order::Phase;
use crate::stream::{Consumer, Cores, QuadLines, StreamError, interleave};

/// L1 caches over a shared L2.
pub struct Functional<C> {
    l1: Vec<C>,
    l2: SharedLevel<C>,
    /// A footprint of more lines may evict some of its own, so that its repeats are simulated.
    most_safe_lines: u32,
    /// What missed.
    pub counts: CacheCounts,
}

impl<C: Cache> Functional<C> {
    /// Empty caches.
    pub fn new(levels: Levels<C>, counts: CacheCounts, path: MissPath) -> Self {
        let own = levels.l1.iter().map(Cache::repeat_safe_lines).min();
        let most_safe_lines = match path.invalidates() {
            true => 1,
            false => own.unwrap_or(1),
        };
        Self {
            most_safe_lines,
            l1: levels.l1,
            l2: SharedLevel::new(levels.l2, path),
            counts,
        }
    }

    /// A footprint's lines that missed the L1 go to the L2.
    #[inline(never)]
    fn missed(&mut self, cell: usize, tile: usize, lines: &[u32]) {
        let mut misses = FootprintMisses {
            l1_lines: lines.len() as u32,
            ..FootprintMisses::default()
        };
        for &line in lines {
            misses.l2_lines += u32::from(!self.l2.access(line));
        }
        let l1 = &mut self.l1;
        (self.l2).invalidate_l1(|line| l1.iter_mut().map(|l1| u64::from(l1.remove(line))).sum());
        self.counts.footprint(cell, tile, &misses);
    }
}

impl<C: Cache> Consumer for Functional<C> {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let safe_lines = self.most_safe_lines as usize;
        for footprint in quad.footprints() {
            // Repeats that would find everything there need no simulation.
            let repeats_are_idle = footprint.lines.len() <= safe_lines;
            let repeats = if repeats_are_idle {
                0
            } else {
                footprint.repeats
            };
            for _ in 0..=repeats {
                let l1 = &mut self.l1[core];
                let (mut missing, mut count) = ([0; 4], 0);
                for &line in footprint.lines {
                    if !l1.access(line) {
                        missing[count & 3] = line;
                        count += 1;
                    }
                }
                if count > 0 {
                    self.missed(footprint.cell, quad.tile(), &missing[..count]);
                }
            }
        }
    }
}

impl<C: Cache> Machine for Functional<C> {
    fn run(
        &mut self,
        cores: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
    ) -> Result<(), StreamError> {
        interleave(cores, phases, assign, self)
    }

    fn flush(&mut self) {
        self.l1.iter_mut().for_each(Cache::clear);
        self.l2.empty();
    }

    fn lose(&mut self, other: OtherWork, l2_lines: u64) {
        self.l1.iter_mut().for_each(Cache::clear);
        self.l2.fill_with_at_once(other.lines(l2_lines));
    }

    fn outcome(&self, _config: &RunConfig) -> Outcome {
        Outcome {
            path: self.l2.result(),
            ..self.counts.clone().into()
        }
    }
}
