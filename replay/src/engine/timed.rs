//! Timed replay: each core's texture unit runs on its own cycle clock, and the clocks decide in
//! which order the cores' misses reach the shared L2.

use super::Machine;
use super::batch::Outcome;
use super::counts::{CacheCounts, FootprintMisses};
use crate::cache::{Cache, InFlight, Levels};
use crate::config::{Assign, RunConfig, TmuConfig};
use crate::order::{Phase, WorkItem};
use crate::result::TmuResult;
use crate::stream::{Cores, QuadLines, StreamError};
use crate::tmu::{Pipeline, PipelineStats, Turn};

/// A cache and what is on its way into it.
struct Level<C> {
    cache: C,
    in_flight: InFlight,
}

impl<C: Cache> Level<C> {
    fn new(cache: C) -> Self {
        Self {
            cache,
            in_flight: InFlight::default(),
        }
    }

    #[inline]
    fn arrive(&mut self, now: u64) {
        self.in_flight.arrive(now, &mut self.cache);
    }

    /// Fills a line at once, or when it arrives.
    #[inline]
    fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        if arrival <= now {
            self.cache.fill(line);
        } else {
            self.in_flight.request(line, arrival);
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
    /// The current thread's core, tile and cycle.
    core: usize,
    tile: usize,
    now: u64,
    /// For each of its footprints that misses, when the last of its lines arrives.
    pending: Vec<u64>,
    /// Lines that it had to ask for.
    fetches: u64,
}

/// Texture units, and the caches that they share.
pub struct Timed<C> {
    memory: Memory<C>,
    units: Vec<Pipeline>,
    busy: Vec<bool>,
    /// Cycles until the last core was done.
    cycles: u64,
}

impl<C: Cache> Timed<C> {
    /// Empty caches, a texture unit for each L1.
    pub fn new(levels: Levels<C>, tmu: TmuConfig, counts: CacheCounts) -> Self {
        let cores = levels.l1.len();
        Self {
            memory: Memory {
                l1: levels.l1.into_iter().map(Level::new).collect(),
                l2: Level::new(levels.l2),
                tmu,
                counts,
                core: 0,
                tile: 0,
                now: 0,
                pending: Vec::new(),
                fetches: 0,
            },
            units: vec![Pipeline::new(tmu); cores],
            busy: vec![false; cores],
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
        while let Some(core) = self.furthest_behind() {
            match self.units[core].turn() {
                Turn::Looped => {}
                Turn::Done => self.busy[core] = false,
                Turn::Free => {
                    if !self.start_thread(core, work) {
                        match items.next(core) {
                            Some(item) => work.load(core, item)?,
                            None => self.units[core].drain(),
                        }
                    }
                }
            }
        }
        Ok(())
    }

    #[inline]
    fn furthest_behind(&self) -> Option<usize> {
        let busy = (0..self.units.len()).filter(|&core| self.busy[core]);
        busy.min_by_key(|&core| self.units[core].clock())
    }

    /// Starts the core's next quad; false if its item has none left.
    #[inline]
    fn start_thread(&mut self, core: usize, work: &mut Cores<'_>) -> bool {
        let unit = &mut self.units[core];
        let Some(quad) = work.next_quad(core) else {
            return false;
        };
        if quad.footprints > 0 {
            self.memory.look_up(core, unit.clock(), &quad);
            unit.start(quad.footprints, &self.memory.pending);
        }
        true
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
    /// Looks up all footprints of a thread that enters now.
    fn look_up(&mut self, core: usize, now: u64, quad: &QuadLines<'_>) {
        (self.core, self.tile, self.now) = (core, quad.tile(), now);
        self.l1[core].arrive(now);
        self.l2.arrive(now);
        self.pending.clear();
        self.fetches = 0;
        let safe_lines = self.l1[core].cache.repeat_safe_lines() as usize;
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                let hit = self.footprint(footprint.cell, footprint.lines);
                // Repeats that would find everything there need no simulation.
                if hit && footprint.lines.len() <= safe_lines {
                    break;
                }
            }
        }
    }

    /// True if all lines are there.
    #[inline(always)]
    fn footprint(&mut self, cell: usize, lines: &[u32]) -> bool {
        let mut misses = FootprintMisses::default();
        let mut ready = 0;
        for &line in lines {
            if !self.l1[self.core].cache.lookup(line) {
                ready = self.request(line, &mut misses).max(ready);
            }
        }
        if misses.l1_lines + misses.l1_secondary == 0 {
            return true;
        }
        if ready > self.now {
            self.pending.push(ready);
        }
        self.counts.footprint(cell, self.tile, &misses);
        false
    }

    /// Asks for a line that is not in the L1, unless it is on its way already; says when it
    /// arrives.
    #[inline(never)]
    fn request(&mut self, line: u32, misses: &mut FootprintMisses) -> u64 {
        let l1 = &mut self.l1[self.core];
        if let Some(arrival) = l1.in_flight.arrival(line) {
            misses.l1_secondary += 1;
            return arrival;
        }
        misses.l1_lines += 1;
        let tmu = &self.tmu;
        let trip = self.fetches / u64::from(tmu.fetches_per_trip);
        self.fetches += 1;
        // Without penalties nothing loops, so there is no later trip to wait for.
        let instant = tmu.l1_penalty_cycles == 0 && tmu.l2_penalty_cycles == 0;
        let wait = if instant {
            0
        } else {
            trip * u64::from(tmu.loop_cycles)
        };
        let in_l2 = if self.l2.cache.lookup(line) {
            self.now
        } else if let Some(arrival) = self.l2.in_flight.arrival(line) {
            misses.l2_secondary += 1;
            arrival
        } else {
            misses.l2_lines += 1;
            let arrival = self.now + u64::from(tmu.l2_penalty_cycles);
            self.l2.enter(line, self.now, arrival);
            arrival
        };
        let in_l1 = in_l2 + u64::from(tmu.l1_penalty_cycles) + wait;
        l1.enter(line, self.now, in_l1);
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
            self.busy.fill(true);
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
