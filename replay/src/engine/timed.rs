//! Timed replay: each core's texture unit runs on its own cycle clock, and the clocks decide in
//! which order the cores' misses reach the shared L2.

use super::feed::Feed;
use super::footprint::{Bundle, Footprints, SampleRef, Scratch};
use super::tally::{Place, Tally, access_hash};
use super::{ReplayError, TileSource};
use crate::cache::{Cache, InFlight};
use crate::config::{Assign, RunConfig};
use crate::order::{Phase, WorkItem};
use crate::result::TmuResult;
use crate::tmu::{Pipeline, PipelineStats, Turn};

/// A core: its texture unit, its L1 and what it works on.
struct Core<A> {
    pipeline: Pipeline,
    l1: A,
    in_flight: InFlight,
    /// The current thread's missing footprints, see `Pipeline::start`.
    pending: Vec<u64>,
    feed: Feed,
    busy: bool,
}

/// The shared level.
struct Shared<B> {
    l2: B,
    in_flight: InFlight,
}

/// The machine in timed mode.
pub struct Timed<'a, S: ?Sized, A, B> {
    source: &'a S,
    footprints: &'a Footprints,
    config: &'a RunConfig,
    cores: Vec<Core<A>>,
    shared: Shared<B>,
    scratch: Scratch,
    tally: Tally,
}

/// Counters and the cycle model's figures.
pub struct TimedOutcome {
    /// Cache counters.
    pub tally: Tally,
    /// Texture units together.
    pub tmu: TmuResult,
    /// Cycles until the last core was done.
    pub cycles: u64,
}

impl<'a, S: TileSource + ?Sized, A: Cache, B: Cache> Timed<'a, S, A, B> {
    /// A machine with one L1 a core.
    pub fn new(
        source: &'a S,
        footprints: &'a Footprints,
        config: &'a RunConfig,
        l1: Vec<A>,
        l2: B,
        tally: Tally,
    ) -> Self {
        let cores = l1
            .into_iter()
            .map(|l1| Core {
                pipeline: Pipeline::new(config.tmu),
                l1,
                in_flight: InFlight::default(),
                pending: Vec::new(),
                feed: Feed::default(),
                busy: false,
            })
            .collect();
        let shared = Shared {
            l2,
            in_flight: InFlight::default(),
        };
        Self {
            source,
            footprints,
            config,
            cores,
            shared,
            scratch: footprints.scratch(),
            tally,
        }
    }

    /// Runs all phases; a phase starts when the last core is done with the one before.
    ///
    /// # Errors
    /// A tile cannot be read.
    pub fn run(mut self, phases: &[Phase]) -> Result<TimedOutcome, ReplayError> {
        let mut cycles = 0;
        for phase in phases {
            for core in &mut self.cores {
                core.pipeline.resume(cycles);
                core.busy = true;
            }
            self.run_phase(phase)?;
            cycles = self
                .cores
                .iter()
                .map(|core| core.pipeline.clock())
                .max()
                .unwrap_or(0);
        }
        let mut sum = PipelineStats::default();
        self.cores
            .iter()
            .for_each(|core| sum.add(&core.pipeline.stats()));
        let tmu = TmuResult {
            utilization: sum.utilization(),
            wasted_issues: sum.wasted,
            threads: sum.threads,
            loops: sum.loops,
        };
        Ok(TimedOutcome {
            tally: self.tally,
            tmu,
            cycles,
        })
    }

    /// Always advances the core whose clock is furthest behind, so that what the cores share sees
    /// their accesses in the order of time.
    fn run_phase(&mut self, phase: &[WorkItem]) -> Result<(), ReplayError> {
        let mut work = Work::new(phase, self.config.assign, self.cores.len());
        while let Some(index) = self.behind() {
            match self.cores[index].pipeline.turn() {
                Turn::Looped => {}
                Turn::Done => self.cores[index].busy = false,
                Turn::Free => {
                    if !self.start_thread(index) {
                        let core = &mut self.cores[index];
                        match work.next(index) {
                            Some(item) => core.feed.load(self.source, item)?,
                            None => core.pipeline.drain(),
                        }
                    }
                }
            }
        }
        Ok(())
    }

    #[inline]
    fn behind(&self) -> Option<usize> {
        let busy = self.cores.iter().enumerate().filter(|(_, core)| core.busy);
        busy.min_by_key(|(_, core)| core.pipeline.clock())
            .map(|(index, _)| index)
    }

    /// Starts the core's next quad; false if its item has none left.
    #[inline]
    fn start_thread(&mut self, index: usize) -> bool {
        let core = &mut self.cores[index];
        let Some(quad) = core.feed.next_quad() else {
            return false;
        };
        let now = core.pipeline.clock();
        core.in_flight.arrive(now, &mut core.l1);
        self.shared.in_flight.arrive(now, &mut self.shared.l2);
        core.pending.clear();
        let mut probe = Probe {
            place: self.tally.quad(quad.at, quad.lanes()),
            tally: &mut self.tally,
            config: self.config,
            l1: &mut core.l1,
            l1_in_flight: &mut core.in_flight,
            shared: &mut self.shared,
            now,
            pending: &mut core.pending,
            fetches: 0,
            footprints: 0,
        };
        self.footprints.for_quad(
            quad.draw,
            quad.records,
            &mut self.scratch,
            |sample, bundle| {
                probe.bundle(sample, bundle);
            },
        );
        let footprints = probe.footprints;
        if footprints > 0 {
            core.pipeline.start(footprints, &core.pending);
        }
        true
    }
}

/// The items of a phase by assignment.
struct Work<'a> {
    items: &'a [WorkItem],
    assign: Assign,
    /// First idle: the next item of all. Static: the next item by core.
    next: Vec<usize>,
    cores: usize,
}

impl<'a> Work<'a> {
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

/// A thread's first trip: every footprint's tags are looked up, and what is missing is fetched.
struct Probe<'a, A, B> {
    tally: &'a mut Tally,
    config: &'a RunConfig,
    place: Place,
    l1: &'a mut A,
    l1_in_flight: &'a mut InFlight,
    shared: &'a mut Shared<B>,
    now: u64,
    /// Arrival of the last line of each footprint that missed.
    pending: &'a mut Vec<u64>,
    /// Lines that this thread had to ask for.
    fetches: u64,
    footprints: u32,
}

/// What became of a footprint's lines.
#[derive(Default)]
struct Misses {
    l1: u64,
    l1_secondary: u64,
    l2: u64,
    l2_secondary: u64,
    /// When the last of the footprint's lines arrives.
    ready: u64,
}

impl<A: Cache, B: Cache> Probe<'_, A, B> {
    #[inline(always)]
    fn bundle(&mut self, sample: SampleRef, bundle: &Bundle) {
        let cell_index = self
            .tally
            .cell_index(self.place, sample.texture, bundle.level);
        let safe_lines = self.l1.repeat_safe_lines();
        let count = usize::from(bundle.count);
        let (mut lookups, mut hash, mut lane_hash) = (0, 0_u64, 0_u64);
        let mut all_hit = false;
        for lane in 0..count {
            let lines = bundle.lines_of(lane);
            lookups += lines.len() as u64;
            if bundle.repeats(lane) && all_hit && lines.len() as u32 <= safe_lines {
                hash = hash.wrapping_add(lane_hash);
                continue;
            }
            lane_hash = 0;
            let mut misses = Misses::default();
            for &relative in lines {
                let line = sample.base_line + relative;
                lane_hash = lane_hash.wrapping_add(access_hash(line));
                if !self.l1.lookup(line) {
                    self.request(line, &mut misses);
                }
            }
            hash = hash.wrapping_add(lane_hash);
            all_hit = misses.l1 + misses.l1_secondary == 0;
            if !all_hit {
                if misses.ready > self.now {
                    self.pending.push(misses.ready);
                }
                self.count(cell_index, &misses);
            }
        }
        self.tally.hash = self.tally.hash.wrapping_add(hash);
        self.footprints += count as u32;
        let l1 = &mut self.tally.cell(cell_index).l1;
        l1.footprints += count as u64;
        l1.line_lookups += lookups;
        let tile = self.tally.tile(self.place);
        tile.footprints = tile.footprints.wrapping_add(count as u32);
    }

    /// Asks for a line that is not in the L1, unless it is on its way already.
    #[inline(never)]
    fn request(&mut self, line: u32, misses: &mut Misses) {
        if let Some(arrival) = self.l1_in_flight.arrival(line) {
            misses.l1_secondary += 1;
            misses.ready = misses.ready.max(arrival);
            return;
        }
        self.tally.touch(line);
        misses.l1 += 1;
        let tmu = &self.config.tmu;
        let trip = self.fetches / u64::from(tmu.fetches_per_trip);
        self.fetches += 1;
        // Without penalties nothing loops, so there is no later trip to wait for.
        let instant = tmu.l1_penalty_cycles == 0 && tmu.l2_penalty_cycles == 0;
        let wait = if instant {
            0
        } else {
            trip * u64::from(tmu.loop_cycles)
        };
        let shared = &mut *self.shared;
        let in_l2 = if shared.l2.lookup(line) {
            self.now
        } else if let Some(arrival) = shared.in_flight.arrival(line) {
            misses.l2_secondary += 1;
            arrival
        } else {
            misses.l2 += 1;
            let arrival = self.now + u64::from(tmu.l2_penalty_cycles);
            enter(
                &mut shared.l2,
                &mut shared.in_flight,
                line,
                self.now,
                arrival,
            );
            arrival
        };
        let in_l1 = in_l2 + u64::from(tmu.l1_penalty_cycles) + wait;
        enter(self.l1, self.l1_in_flight, line, self.now, in_l1);
        misses.ready = misses.ready.max(in_l1);
    }

    /// Counts a footprint that found lines missing.
    fn count(&mut self, cell_index: usize, misses: &Misses) {
        let cell = self.tally.cell(cell_index);
        cell.l1.footprint_misses += u64::from(misses.l1 > 0);
        cell.l1.line_misses += misses.l1;
        cell.l1.secondary_misses += misses.l1_secondary;
        cell.l2.footprints += u64::from(misses.l1 > 0);
        cell.l2.line_lookups += misses.l1;
        cell.l2.footprint_misses += u64::from(misses.l2 > 0);
        cell.l2.line_misses += misses.l2;
        cell.l2.secondary_misses += misses.l2_secondary;
        let tile = self.tally.tile(self.place);
        tile.l1_misses = tile.l1_misses.wrapping_add(u32::from(misses.l1 > 0));
        tile.l2_misses = tile.l2_misses.wrapping_add(misses.l2 as u32);
    }
}

/// Fills a line at once, or when it arrives.
#[inline]
fn enter(cache: &mut impl Cache, in_flight: &mut InFlight, line: u32, now: u64, arrival: u64) {
    if arrival <= now {
        cache.fill(line);
    } else {
        in_flight.request(line, arrival);
    }
}
