//! Caches of any policy without latencies: a miss fills immediately.

use super::counts::{CacheCounts, FootprintMisses};
use super::machine::{AtOnce, FrameWork, Machine};
use super::outcome::MachineOutcome;
use crate::access::FrameClients;
use crate::config::{BetweenFrames, RunConfig};
use crate::memory::{Cache, Hierarchy, OtherWork};
use crate::order::WorkItem;
use crate::stream::{Consumer, QuadLines, StreamError, Tag, interleave};

/// L1 caches over a shared L2.
pub struct Functional<C> {
    caches: Hierarchy<C>,
    /// Larger footprints may evict their own lines, so their repeats must be simulated.
    most_safe_lines: u32,
    counts: CacheCounts,
}

impl<C: Cache> Functional<C> {
    /// Empty caches.
    pub fn new(caches: Hierarchy<C>, counts: CacheCounts) -> Self {
        Self {
            most_safe_lines: caches.repeat_safe_lines(),
            caches,
            counts,
        }
    }

    /// Sends the L1 misses of a footprint to the L2.
    #[inline(never)]
    fn missed(&mut self, core: usize, cell: usize, tile: usize, lines: &[u32]) {
        let mut misses = FootprintMisses {
            l1_lines: lines.len() as u32,
            ..FootprintMisses::default()
        };
        for &line in lines {
            misses.l2_lines += u32::from(!self.caches.access_l2(core, line));
        }
        self.caches.follow_evictions();
        self.counts.footprint(cell, tile, &misses);
    }
}

impl<C: Cache> Consumer for Functional<C> {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let safe_lines = self.most_safe_lines as usize;
        for footprint in quad.footprints() {
            // Repeats that only hit need no simulation.
            let repeats_are_idle = footprint.lines.len() <= safe_lines;
            let repeats = if repeats_are_idle {
                0
            } else {
                footprint.repeats
            };
            for _ in 0..=repeats {
                let (mut missing, mut count) = ([0; 4], 0);
                for &line in footprint.lines {
                    if !self.caches.access_l1(core, line) {
                        missing[count & 3] = line;
                        count += 1;
                    }
                }
                if count > 0 {
                    self.missed(core, footprint.cell, quad.tile(), &missing[..count]);
                }
            }
        }
    }
}

/// The caches, and the other clients of memory, which follow the cores' items.
struct WithClients<'m, 'f, C> {
    caches: &'m mut Functional<C>,
    clients: &'m mut FrameClients<'f>,
}

impl<C: Cache> Consumer for WithClients<'_, '_, C> {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        self.caches.quad(core, quad);
    }

    fn start_item(&mut self, core: usize, item: &WorkItem) -> Result<(), StreamError> {
        self.clients.start_item(core, item)?;
        let caches = &mut self.caches.caches;
        (self.clients).send(|access| caches.client_access(core, access));
        caches.follow_evictions();
        Ok(())
    }
}

impl<C: Cache> Machine for Functional<C> {
    fn run(&mut self, frame: FrameWork) -> Result<(), StreamError> {
        let FrameWork {
            cores,
            phases,
            assign,
            clients,
            ..
        } = frame;
        match clients {
            None => interleave(cores, phases, assign, self),
            Some(clients) => {
                let mut both = WithClients {
                    caches: self,
                    clients,
                };
                interleave(cores, phases, assign, &mut both)
            }
        }
    }

    fn client_accesses(&mut self, clients: &mut FrameClients<'_>) {
        clients.send(|access| self.caches.client_access(0, access));
        self.caches.follow_evictions();
    }

    fn between_frames(&mut self, index: usize, config: &RunConfig) {
        match config.between_frames {
            BetweenFrames::Keep => (),
            BetweenFrames::Flush => self.caches.clear(),
            BetweenFrames::Lose(percent) => {
                self.caches.lose(OtherWork::after(index, percent, config));
            }
        }
    }

    fn outcome(&self, _config: &RunConfig) -> MachineOutcome {
        MachineOutcome {
            memory: self.caches.result(),
            ..self.counts.clone().into()
        }
    }
}

impl<C: Cache> AtOnce for Functional<C> {
    fn lines(&mut self, lines: &[u32], tags: &[Tag], missed: &mut Vec<u32>) {
        /// L1 look-ups before the L2 sees their misses. One, if the L2 can invalidate L1 lines.
        const CHUNK: usize = 256;
        let chunk = if self.caches.invalidates() { 1 } else { CHUNK };
        let mut places = [0_u8; CHUNK];
        for (lines, tags) in lines.chunks(chunk).zip(tags.chunks(chunk)) {
            let mut count = 0;
            for (place, &line) in lines.iter().enumerate() {
                // Branch-free: whether a line hits is unpredictable.
                places[count % CHUNK] = place as u8;
                count += usize::from(!self.caches.access_l1(0, line));
            }
            for &place in &places[..count] {
                let (line, tag) = (lines[usize::from(place)], tags[usize::from(place)]);
                missed.push(line);
                self.missed(0, tag.cell() as usize, 0, &[line]);
            }
        }
    }
}
