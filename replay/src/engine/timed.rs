//! Timed replay: each core's texture unit runs on its own cycle clock, and the clocks decide in
//! which order the cores' misses reach the shared L2.

use super::Machine;
use super::batch::Outcome;
use super::counts::{CacheCounts, FootprintMisses};
use crate::cache::{Cache, InFlight, Levels};
use crate::config::{Assign, RunConfig, TmuConfig};
use crate::order::{Phase, WorkItem};
use crate::result::TmuResult;
use crate::stream::{Cores, QuadLines, StreamError, furthest_behind};
use crate::tmu::{Pending, Pipeline, PipelineStats, Turn};

/// A cache and what is on its way into it.
struct Level<C> {
    cache: C,
    in_flight: InFlight,
}

impl<C: Cache> Level<C> {
    fn new(cache: C, usual_cycles: u64) -> Self {
        Self {
            cache,
            in_flight: InFlight::new(usual_cycles),
        }
    }

    #[inline(always)]
    fn arrive(&mut self, now: u64) {
        self.in_flight.arrive(now, &mut self.cache);
    }

    /// Fills a line at once, or when it arrives.
    #[inline]
    fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        if arrival <= now {
            self.cache.fill(line);
        } else {
            self.in_flight.request(line, now, arrival);
        }
    }
}

/// The caches as a texture unit sees them: a thread's first trip looks up every footprint's tags,
/// and what is missing is fetched.
struct Memory<C> {
    l1: Vec<Level<C>>,
    l2: Level<C>,
    tmu: TmuConfig,
    counts: CacheCounts,
    /// What the current thread waits for.
    pending: Vec<Pending>,
    /// Lines that it had to ask for.
    fetches: u32,
}

/// Texture units, and the caches that they share.
pub struct Timed<C> {
    memory: Memory<C>,
    units: Vec<Pipeline>,
    /// Cycles until the last core was done.
    cycles: u64,
}

impl<C: Cache> Timed<C> {
    /// Empty caches, a texture unit for each L1.
    pub fn new(levels: Levels<C>, tmu: TmuConfig, counts: CacheCounts) -> Self {
        let cores = levels.l1.len();
        let memory_cycles = u64::from(tmu.l1_penalty_cycles) + u64::from(tmu.l2_penalty_cycles);
        // Later trips of threads that miss many lines included.
        let usual_cycles = memory_cycles + 8 * u64::from(tmu.loop_cycles);
        let l1 = levels.l1.into_iter();
        Self {
            memory: Memory {
                l1: l1.map(|cache| Level::new(cache, usual_cycles)).collect(),
                l2: Level::new(levels.l2, memory_cycles),
                tmu,
                counts,
                pending: Vec::new(),
                fetches: 0,
            },
            units: vec![Pipeline::new(tmu); cores],
            cycles: 0,
        }
    }

    /// Always advances the core whose clock is furthest behind, so that what the cores share sees
    /// their accesses in the order of time.
    fn run_phase(
        &mut self,
        work: &mut Cores<'_>,
        phase: &[WorkItem],
        assign: Assign,
    ) -> Result<(), StreamError> {
        let mut items = Items::new(phase, assign, self.units.len());
        // A core that is done is at the end of time.
        let mut clocks: Vec<u64> = self.units.iter().map(Pipeline::clock).collect();
        while let Some((core, until)) = furthest_behind(&clocks) {
            let unit = &mut self.units[core];
            let clock = &mut clocks[core];
            while *clock <= until {
                match unit.turn() {
                    Turn::Looped => {}
                    Turn::Done => {
                        *clock = u64::MAX;
                        break;
                    }
                    Turn::Free => {
                        if let Some(quad) = work.next_quad(core) {
                            if quad.footprints > 0 {
                                self.memory.look_up(core, unit.clock(), &quad);
                                unit.start(quad.footprints, &self.memory.pending);
                            }
                        } else if let Some(item) = items.next(core) {
                            work.load(core, item)?;
                        } else {
                            unit.drain();
                        }
                    }
                }
                *clock = unit.clock();
            }
        }
        Ok(())
    }
}

/// The items of a phase by assignment.
struct Items<'a> {
    items: &'a [WorkItem],
    assign: Assign,
    /// First idle: the next item of all. Static: the next item by core.
    next: Vec<usize>,
    cores: usize,
}

impl<'a> Items<'a> {
    fn new(items: &'a [WorkItem], assign: Assign, cores: usize) -> Self {
        let next = match assign {
            Assign::FirstIdle => vec![0],
            Assign::Static => (0..cores).collect(),
        };
        Self {
            items,
            assign,
            next,
            cores,
        }
    }

    fn next(&mut self, core: usize) -> Option<&'a WorkItem> {
        let (next, step) = match self.assign {
            Assign::FirstIdle => (&mut self.next[0], 1),
            Assign::Static => (&mut self.next[core], self.cores),
        };
        let item = self.items.get(*next);
        *next += step;
        item
    }
}

impl<C: Cache> Memory<C> {
    /// Looks up all footprints of a thread that enters `now`.
    #[inline(always)]
    fn look_up(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) {
        self.l1[core].arrive(now);
        self.l2.arrive(now);
        self.pending.clear();
        self.fetches = 0;
        let mut index = 0;
        loop {
            // Repeats of a footprint that finds everything change nothing.
            index += self.l1[core].cache.lookup_all(&quad.lines[index..]);
            if index == quad.lines.len() {
                return;
            }
            index = self.missed(core, now, quad, index);
        }
    }

    /// The line at `index` is not there: looks up the rest of its footprint, asks for what is
    /// missing, and does so again for the footprint's repeats. Says where the next one starts.
    #[inline(never)]
    fn missed(&mut self, core: usize, now: u64, quad: &QuadLines<'_>, index: usize) -> usize {
        let mut start = index;
        while !quad.tags[start].is_first() {
            start -= 1;
        }
        let end = quad.end_of_footprint(index);
        let mut misses = FootprintMisses::default();
        let mut ready = self.request(core, now, quad.lines[index], &mut misses);
        let mut earliest = ready;
        for &line in &quad.lines[index + 1..end] {
            if !self.l1[core].cache.lookup(line) {
                let arrival = self.request(core, now, line, &mut misses);
                (ready, earliest) = (ready.max(arrival), earliest.min(arrival));
            }
        }
        let repeats = quad.tags[start].repeats();
        let (cell, tile) = (quad.cell(start), quad.tile());
        if earliest > now {
            // Nothing was filled, so every repeat finds the same lines missing, on their way now.
            let missing = misses.l1_lines + misses.l1_secondary;
            misses.l1_secondary += repeats * missing;
            self.wait(ready, 1 + repeats);
            self.counts.footprint(cell, tile, &misses);
            return end;
        }
        self.counts.footprint(cell, tile, &misses);
        if ready > now {
            self.wait(ready, 1);
        }
        for _ in 0..repeats {
            let mut misses = FootprintMisses::default();
            let mut ready = now;
            for &line in &quad.lines[start..end] {
                if !self.l1[core].cache.lookup(line) {
                    ready = ready.max(self.request(core, now, line, &mut misses));
                }
            }
            if misses.l1_lines + misses.l1_secondary == 0 {
                break;
            }
            self.counts.footprint(cell, tile, &misses);
            if ready > now {
                self.wait(ready, 1);
            }
        }
        end
    }

    /// Footprints of the current thread wait until a cycle.
    #[inline(always)]
    fn wait(&mut self, ready: u64, footprints: u32) {
        match self.pending.last_mut() {
            Some(last) if last.ready == ready => last.footprints += footprints,
            _ => self.pending.push(Pending { ready, footprints }),
        }
    }

    /// Asks for a line that is not in the L1, unless it is on its way already; says when it
    /// arrives.
    #[inline(always)]
    fn request(&mut self, core: usize, now: u64, line: u32, misses: &mut FootprintMisses) -> u64 {
        if let Some(arrival) = self.l1[core].in_flight.arrival(line) {
            misses.l1_secondary += 1;
            return arrival;
        }
        misses.l1_lines += 1;
        self.fetch(core, now, line, misses)
    }

    /// Asks the L2 for a line.
    #[inline(never)]
    fn fetch(&mut self, core: usize, now: u64, line: u32, misses: &mut FootprintMisses) -> u64 {
        let tmu = &self.tmu;
        let trip = u64::from(self.fetches / tmu.fetches_per_trip);
        self.fetches += 1;
        // Without penalties nothing loops, so there is no later trip to wait for.
        let instant = tmu.l1_penalty_cycles == 0 && tmu.l2_penalty_cycles == 0;
        let wait = if instant {
            0
        } else {
            trip * u64::from(tmu.loop_cycles)
        };
        let in_l2 = if self.l2.cache.lookup(line) {
            now
        } else if let Some(arrival) = self.l2.in_flight.arrival(line) {
            misses.l2_secondary += 1;
            arrival
        } else {
            misses.l2_lines += 1;
            let arrival = now + u64::from(tmu.l2_penalty_cycles);
            self.l2.enter(line, now, arrival);
            arrival
        };
        let in_l1 = in_l2 + u64::from(tmu.l1_penalty_cycles) + wait;
        self.l1[core].enter(line, now, in_l1);
        in_l1
    }
}

impl<C: Cache> Machine for Timed<C> {
    /// A phase starts when the last core is done with the one before.
    fn run(
        &mut self,
        work: &mut Cores<'_>,
        phases: &[Phase],
        assign: Assign,
    ) -> Result<(), StreamError> {
        for phase in phases {
            let cycles = self.cycles;
            self.units.iter_mut().for_each(|unit| unit.resume(cycles));
            self.run_phase(work, phase, assign)?;
            self.cycles = self.units.iter().map(Pipeline::clock).max().unwrap_or(0);
        }
        Ok(())
    }

    fn outcome(&self, _config: &RunConfig) -> Outcome {
        let mut sum = PipelineStats::default();
        self.units.iter().for_each(|unit| sum.add(&unit.stats()));
        Outcome {
            counts: self.memory.counts.clone(),
            tmu: Some(TmuResult {
                utilization: sum.utilization(),
                wasted_issues: sum.wasted,
                threads: sum.threads,
                loops: sum.loops,
            }),
            cycles: Some(self.cycles),
        }
    }
}
