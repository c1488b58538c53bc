//! Timed replay: each core's texture unit runs on its own cycle clock, and the clocks decide in
//! which order the cores' misses reach the shared L2.

use super::counts::{CacheCounts, FootprintMisses};
use crate::cache::{Cache, InFlight, Levels};
use crate::config::{Assign, TmuConfig};
use crate::order::{Phase, WorkItem};
use crate::result::TmuResult;
use crate::stream::{Consumer, Lines, Stream, StreamError, TileSource};
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
}

/// What a timed replay yields.
pub struct TimedOutcome {
    /// What missed.
    pub counts: CacheCounts,
    /// Texture units together.
    pub tmu: TmuResult,
    /// Cycles until the last core was done.
    pub cycles: u64,
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
        }
    }

    /// Runs all phases; a phase starts when the last core is done with the one before.
    ///
    /// # Errors
    /// A tile cannot be read.
    pub fn run<S: TileSource + ?Sized>(
        mut self,
        stream: &mut Stream<'_, S>,
        phases: &[Phase],
        assign: Assign,
    ) -> Result<TimedOutcome, StreamError> {
        let mut cycles = 0;
        for phase in phases {
            self.units.iter_mut().for_each(|unit| unit.resume(cycles));
            self.busy.fill(true);
            self.run_phase(stream, phase, assign)?;
            cycles = self.units.iter().map(Pipeline::clock).max().unwrap_or(0);
        }
        let mut sum = PipelineStats::default();
        self.units.iter().for_each(|unit| sum.add(&unit.stats()));
        Ok(TimedOutcome {
            counts: self.memory.counts,
            tmu: TmuResult {
                utilization: sum.utilization(),
                wasted_issues: sum.wasted,
                threads: sum.threads,
                loops: sum.loops,
            },
            cycles,
        })
    }

    /// Always advances the core whose clock is furthest behind, so that what the cores share sees
    /// their accesses in the order of time.
    fn run_phase<S: TileSource + ?Sized>(
        &mut self,
        stream: &mut Stream<'_, S>,
        phase: &[WorkItem],
        assign: Assign,
    ) -> Result<(), StreamError> {
        let mut items = Items::new(phase, assign, self.units.len());
        while let Some(core) = self.furthest_behind() {
            match self.units[core].turn() {
                Turn::Looped => {}
                Turn::Done => self.busy[core] = false,
                Turn::Free => {
                    if !self.start_thread(core, stream) {
                        match items.next(core) {
                            Some(item) => stream.load(core, item)?,
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
    fn start_thread<S: TileSource + ?Sized>(
        &mut self,
        core: usize,
        stream: &mut Stream<'_, S>,
    ) -> bool {
        let unit = &mut self.units[core];
        self.memory.now = unit.clock();
        match stream.next_quad(core, &mut self.memory) {
            None => return false,
            Some(0) => {}
            Some(footprints) => unit.start(footprints, &self.memory.pending),
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

impl<C: Cache> Consumer for Memory<C> {
    #[inline(always)]
    fn quad(&mut self, core: usize, tile: usize) {
        (self.core, self.tile) = (core, tile);
        self.l1[core].arrive(self.now);
        self.l2.arrive(self.now);
        self.pending.clear();
        self.fetches = 0;
    }

    #[inline(always)]
    fn footprint(&mut self, cell: usize, lines: Lines<'_>) -> bool {
        let l1 = &mut self.l1[self.core].cache;
        let safe = lines.count() <= l1.repeat_safe_lines();
        // One line, there: what nearly all footprints find.
        if lines.only().is_some_and(|line| l1.lookup(line)) {
            return safe;
        }
        let mut misses = FootprintMisses::default();
        let mut ready = 0;
        for line in lines.iter() {
            if !self.l1[self.core].cache.lookup(line) {
                ready = self.request(line, &mut misses).max(ready);
            }
        }
        if misses.l1_lines + misses.l1_secondary == 0 {
            return safe;
        }
        if ready > self.now {
            self.pending.push(ready);
        }
        self.counts.footprint(cell, self.tile, &misses);
        false
    }
}

impl<C: Cache> Memory<C> {
    /// Asks for a line that is not in the L1, unless it is on its way already; says when it
    /// arrives.
    #[inline(never)]
    fn request(&mut self, line: u32, misses: &mut FootprintMisses) -> u64 {
        let l1 = &mut self.l1[self.core];
        if let Some(arrival) = l1.in_flight.arrival(line) {
            misses.l1_secondary += 1;
            return arrival;
        }
        self.counts.touched.insert(line);
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
