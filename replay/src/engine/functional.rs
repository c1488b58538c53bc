//! Functional replay: no latencies. A footprint is the unit of time, and a miss fills at once.

use super::feed::{Feed, Quad};
use super::footprint::{Bundle, Footprints, SampleRef, Scratch};
use super::tally::{Place, Tally, access_hash};
use super::{ReplayError, TileSource};
use crate::cache::Cache;
use crate::config::Assign;
use crate::order::{Phase, WorkItem};

/// A core: its L1 and what it works on.
struct Core<A> {
    l1: A,
    feed: Feed,
    busy: bool,
    /// Footprints done, the clock of first-idle assignment.
    clock: u64,
}

/// The machine in functional mode.
pub struct Functional<'a, S: ?Sized, A, B> {
    source: &'a S,
    footprints: &'a Footprints,
    cores: Vec<Core<A>>,
    l2: B,
    scratch: Scratch,
    tally: Tally,
}

impl<'a, S: TileSource + ?Sized, A: Cache, B: Cache> Functional<'a, S, A, B> {
    /// A machine with one L1 a core.
    pub fn new(source: &'a S, footprints: &'a Footprints, l1: Vec<A>, l2: B, tally: Tally) -> Self {
        let cores = l1
            .into_iter()
            .map(|l1| Core {
                l1,
                feed: Feed::default(),
                busy: false,
                clock: 0,
            })
            .collect();
        Self {
            source,
            footprints,
            cores,
            l2,
            scratch: footprints.scratch(),
            tally,
        }
    }

    /// Runs all phases.
    ///
    /// # Errors
    /// A tile cannot be read.
    pub fn run(mut self, phases: &[Phase], assign: Assign) -> Result<Tally, ReplayError> {
        for phase in phases {
            match assign {
                Assign::FirstIdle => self.first_idle(phase)?,
                Assign::Static => self.lockstep(phase)?,
            }
            let end = self.cores.iter().map(|core| core.clock).max().unwrap_or(0);
            self.cores.iter_mut().for_each(|core| core.clock = end);
        }
        Ok(self.tally)
    }

    /// The core that is furthest behind runs a quad; if it has none left, it takes the next item.
    fn first_idle(&mut self, phase: &[WorkItem]) -> Result<(), ReplayError> {
        let mut items = phase.iter();
        let mut waiting = self.cores.len();
        self.cores.iter_mut().for_each(|core| core.busy = true);
        while waiting > 0 {
            let behind = self.behind();
            if self.step(behind) {
                continue;
            }
            let core = &mut self.cores[behind];
            match items.next() {
                Some(item) => core.feed.load(self.source, item)?,
                None => {
                    core.busy = false;
                    waiting -= 1;
                }
            }
        }
        Ok(())
    }

    /// Index of the busy core with the lowest clock, the first of equals.
    #[inline]
    fn behind(&self) -> usize {
        let mut best = usize::MAX;
        let mut clock = u64::MAX;
        for (index, core) in self.cores.iter().enumerate() {
            if core.busy && core.clock < clock {
                (best, clock) = (index, core.clock);
            }
        }
        best
    }

    /// Round robin: the cores' i-th items start together and run quad by quad in turn; who is done
    /// first waits. Free-running streams would drift apart and invent locality effects.
    fn lockstep(&mut self, phase: &[WorkItem]) -> Result<(), ReplayError> {
        for items in phase.chunks(self.cores.len()) {
            for (core, item) in self.cores.iter_mut().zip(items) {
                core.feed.load(self.source, item)?;
                core.busy = true;
            }
            loop {
                let mut any = false;
                for index in 0..items.len() {
                    if self.cores[index].busy {
                        self.cores[index].busy = self.step(index);
                        any |= self.cores[index].busy;
                    }
                }
                if !any {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Runs the next quad of a core; false if its item has none left.
    #[inline]
    fn step(&mut self, index: usize) -> bool {
        let core = &mut self.cores[index];
        let Some(quad) = core.feed.next_quad() else {
            return false;
        };
        let mut ports = Ports {
            l1: &mut core.l1,
            l2: &mut self.l2,
            place: self.tally.quad(quad.at, quad.lanes()),
            tally: &mut self.tally,
            footprints: 0,
        };
        run_quad(self.footprints, &quad, &mut self.scratch, &mut ports);
        // An untextured quad takes its turn, too.
        core.clock += u64::from(ports.footprints.max(1));
        true
    }
}

/// What a quad's accesses go through.
struct Ports<'a, A, B> {
    l1: &'a mut A,
    l2: &'a mut B,
    tally: &'a mut Tally,
    place: Place,
    footprints: u32,
}

#[inline]
fn run_quad<A: Cache, B: Cache>(
    footprints: &Footprints,
    quad: &Quad<'_>,
    scratch: &mut Scratch,
    ports: &mut Ports<'_, A, B>,
) {
    footprints.for_quad(quad.draw, quad.records, scratch, |sample, bundle| {
        ports.bundle(sample, bundle)
    });
}

impl<A: Cache, B: Cache> Ports<'_, A, B> {
    #[inline(always)]
    fn bundle(&mut self, sample: SampleRef, bundle: &Bundle) {
        let cell_index = self
            .tally
            .cell_index(self.place, sample.texture, bundle.level);
        let safe_lines = self.l1.repeat_safe_lines();
        let count = usize::from(bundle.count);
        let (mut lookups, mut hash, mut lane_hash) = (0, 0_u64, 0_u64);
        for lane in 0..count {
            let lines = bundle.lines_of(lane);
            let len = lines.len() as u32;
            lookups += len;
            // The same lines as the lane before: all hit, and the cache stays as it is.
            if bundle.repeats(lane) && len <= safe_lines {
                hash = hash.wrapping_add(lane_hash);
                continue;
            }
            lane_hash = 0;
            let mut misses = [0_u32; 4];
            let mut miss_count = 0;
            for &relative in lines {
                let line = sample.base_line + relative;
                lane_hash = lane_hash.wrapping_add(access_hash(line));
                if !self.l1.access(line) {
                    misses[miss_count] = line;
                    miss_count += 1;
                }
            }
            hash = hash.wrapping_add(lane_hash);
            if miss_count > 0 {
                self.missed(cell_index, &misses[..miss_count]);
            }
        }
        self.tally.hash = self.tally.hash.wrapping_add(hash);
        self.footprints += count as u32;
        let l1 = &mut self.tally.cell(cell_index).l1;
        l1.footprints += count as u64;
        l1.line_lookups += u64::from(lookups);
        let tile = self.tally.tile(self.place);
        tile.footprints = tile.footprints.wrapping_add(count as u32);
    }

    /// A footprint's lines that missed the L1 go to the L2.
    #[inline(never)]
    fn missed(&mut self, cell_index: usize, lines: &[u32]) {
        let mut l2_misses = 0;
        for &line in lines {
            self.tally.touch(line);
            l2_misses += u64::from(!self.l2.access(line));
        }
        let cell = self.tally.cell(cell_index);
        cell.l1.footprint_misses += 1;
        cell.l1.line_misses += lines.len() as u64;
        cell.l2.footprints += 1;
        cell.l2.line_lookups += lines.len() as u64;
        cell.l2.footprint_misses += u64::from(l2_misses > 0);
        cell.l2.line_misses += l2_misses;
        let tile = self.tally.tile(self.place);
        tile.l1_misses = tile.l1_misses.wrapping_add(1);
        tile.l2_misses = tile.l2_misses.wrapping_add(l2_misses as u32);
    }
}
