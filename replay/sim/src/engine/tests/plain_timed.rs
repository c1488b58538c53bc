//! A plain version of the timed machine: a heap and a map of lines in flight, a list of waiting footprints
//! per thread, and one look-up per footprint. The fast machine must agree cycle by cycle.

use super::*;
use crate::config::{Allocation, Replacement, TmuConfig};
use crate::engine::counts::FootprintMisses;
use crate::memory::{AnyCache, Cache, Caches};
use crate::result::{MemoryResult, MshrResult, TmuResult};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

/// Lines in flight into one cache.
#[derive(Default)]
struct PlainInFlight {
    lines: HashMap<u32, u64>,
    arrivals: BinaryHeap<Reverse<(u64, u64, u32)>>,
    requests: u64,
}

struct PlainLevel {
    cache: Box<dyn Cache>,
    in_flight: PlainInFlight,
    allocation: Allocation,
}

impl PlainLevel {
    fn new(cache: Box<dyn Cache>, allocation: Allocation) -> Self {
        Self {
            cache,
            allocation,
            in_flight: PlainInFlight::default(),
        }
    }

    fn arrive(&mut self, now: u64) {
        let PlainInFlight {
            lines, arrivals, ..
        } = &mut self.in_flight;
        while let Some(&Reverse((cycle, _, line))) = arrivals.peek() {
            if cycle > now {
                break;
            }
            arrivals.pop();
            lines.remove(&line);
            if self.allocation == Allocation::OnFill {
                self.cache.fill(line);
            }
        }
    }

    /// Returns true if the line is resident, and marks its way as used.
    fn has(&mut self, line: u32) -> bool {
        self.cache.lookup(line) && !self.in_flight.lines.contains_key(&line)
    }

    fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        if arrival <= now || self.allocation == Allocation::OnMiss {
            self.cache.fill(line);
        }
        if arrival > now {
            let flight = &mut self.in_flight;
            flight.lines.insert(line, arrival);
            flight
                .arrivals
                .push(Reverse((arrival, flight.requests, line)));
            flight.requests += 1;
        }
    }
}

/// A core's texture unit.
#[derive(Default)]
struct PlainUnit {
    clock: u64,
    busy: bool,
    drained: bool,
    /// Cycle at which each thread re-enters the first stage, and its footprints' ready cycles.
    looping: VecDeque<(u64, Vec<u64>)>,
    open_slot: u32,
    useful: u64,
    wasted: u64,
    idle: u64,
    threads: u64,
    loops: u64,
}

impl PlainUnit {
    fn trip(&mut self, tmu: &TmuConfig, hits: u64, pending: Vec<u64>) {
        let entered = self.clock;
        self.useful += hits;
        self.clock += hits;
        if pending.is_empty() {
            return;
        }
        self.open_slot += pending.len() as u32;
        let slots = u64::from(self.open_slot / tmu.retry_footprints);
        self.open_slot %= tmu.retry_footprints;
        self.wasted += slots;
        self.clock += slots;
        let back = entered + u64::from(tmu.loop_cycles);
        self.looping.push_back((back, pending));
    }
}

struct PlainTimed {
    l1: Vec<PlainLevel>,
    /// One, or one per core.
    l2: Vec<PlainLevel>,
    l2_cycles: u64,
    memory_cycles: u64,
    tmu: TmuConfig,
    counts: CacheCounts,
    units: Vec<PlainUnit>,
    cycles: u64,
    /// Cycle at which each MSHR of each L2 becomes free.
    mshrs: Vec<Vec<u64>>,
    mshr_counts: MshrResult,
}

impl PlainTimed {
    fn new(config: &RunConfig, bins: &Bins) -> Self {
        let Caches { l1, l2 } = Caches::build(config).unwrap();
        let plain = |cache: AnyCache| PlainLevel::new(cache.into_box(), config.tmu.allocation);
        Self {
            mshrs: vec![vec![0; config.tmu.l2_mshrs as usize]; l2.len()],
            l1: l1.into_iter().map(plain).collect(),
            l2: l2.into_iter().map(plain).collect(),
            l2_cycles: config.level.l2.hit_cycles.into(),
            memory_cycles: config.memory_cycles.into(),
            tmu: config.tmu,
            counts: CacheCounts::new(bins, config.tile_maps),
            units: (0..config.cores).map(|_| PlainUnit::default()).collect(),
            cycles: 0,
            mshr_counts: MshrResult::default(),
        }
    }

    fn start(&mut self, core: usize, quad: &QuadLines<'_>) {
        let now = self.units[core].clock;
        self.l1[core].arrive(now);
        let own = core.min(self.l2.len() - 1);
        self.l2[own].arrive(now);
        let (mut pending, mut fetches) = (Vec::new(), 0);
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                let mut misses = FootprintMisses::default();
                let mut ready = 0;
                for &line in footprint.lines {
                    if !self.l1[core].has(line) {
                        let arrival = self.request(core, now, line, &mut fetches, &mut misses);
                        ready = ready.max(arrival);
                    }
                }
                if ready > now {
                    pending.push(ready);
                }
                self.counts.footprint(footprint.cell, quad.tile(), &misses);
            }
        }
        let unit = &mut self.units[core];
        unit.threads += 1;
        let hits = u64::from(quad.footprints) - pending.len() as u64;
        unit.trip(&self.tmu, hits, pending);
    }

    fn request(
        &mut self,
        core: usize,
        now: u64,
        line: u32,
        fetches: &mut u64,
        misses: &mut FootprintMisses,
    ) -> u64 {
        let l1 = &mut self.l1[core];
        if let Some(&arrival) = l1.in_flight.lines.get(&line) {
            misses.l1_secondary += 1;
            return arrival;
        }
        misses.l1_lines += 1;
        let tmu = &self.tmu;
        let trip = *fetches / u64::from(tmu.fetches_per_trip);
        *fetches += 1;
        let instant = self.l2_cycles == 0 && self.memory_cycles == 0;
        let own = core.min(self.l2.len() - 1);
        let (l2, mshrs) = (&mut self.l2[own], &mut self.mshrs[own]);
        let wait = if instant {
            0
        } else {
            trip * u64::from(tmu.loop_cycles)
        };
        let in_l2 = if l2.has(line) {
            now
        } else if let Some(&arrival) = l2.in_flight.lines.get(&line) {
            misses.l2_secondary += 1;
            arrival
        } else {
            misses.l2_lines += 1;
            let mut start = now;
            if let Some(first) = (0..mshrs.len()).min_by_key(|&slot| mshrs[slot]) {
                start = now.max(mshrs[first]);
                self.mshr_counts.stalled_misses += u64::from(start > now);
                self.mshr_counts.stall_cycles += start - now;
                mshrs[first] = start + self.memory_cycles;
                let in_use = mshrs.iter().filter(|&&free| free > start).count();
                // A miss without latency occupies an MSHR as well; one that waited replaces another.
                let in_use = match start > now {
                    true => mshrs.len(),
                    false => in_use + usize::from(self.memory_cycles == 0),
                };
                self.mshr_counts.peak = self.mshr_counts.peak.max(in_use as u64);
            }
            let arrival = start + self.memory_cycles;
            l2.enter(line, now, arrival);
            arrival
        };
        let in_l1 = in_l2 + self.l2_cycles + wait;
        l1.enter(line, now, in_l1);
        in_l1
    }

    /// Advances the core's first stage.
    fn turn(
        &mut self,
        core: usize,
        work: &mut Cores<'_>,
        item: &mut dyn FnMut() -> Option<WorkItem>,
    ) {
        let unit = &mut self.units[core];
        let full = unit.drained || unit.looping.len() >= self.tmu.threads as usize;
        match unit.looping.front().map(|(back, _)| *back) {
            Some(back) if back <= unit.clock => {
                let (_, mut pending) = unit.looping.pop_front().unwrap();
                unit.loops += 1;
                let before = pending.len();
                pending.retain(|&ready| ready > unit.clock);
                unit.trip(&self.tmu, (before - pending.len()) as u64, pending);
            }
            Some(back) if full => {
                unit.idle += back - unit.clock;
                unit.clock = back;
            }
            None if unit.drained => unit.busy = false,
            _ => match work.next_quad(core) {
                Some(quad) if quad.footprints > 0 => self.start(core, &quad),
                Some(_) => {}
                None => match item() {
                    Some(item) => work.load(core, &item).unwrap(),
                    None => unit.drained = true,
                },
            },
        }
    }
}

impl Machine for PlainTimed {
    fn run(&mut self, frame: FrameWork) -> Result<(), StreamError> {
        let FrameWork {
            cores: work,
            phases,
            assign,
            ..
        } = frame;
        let cores = self.units.len();
        for phase in phases {
            for unit in &mut self.units {
                (unit.busy, unit.drained) = (true, false);
                unit.clock = unit.clock.max(self.cycles);
            }
            // Static: every n-th item belongs to the core. First idle: the next item of all.
            let mut next: Vec<usize> = match assign {
                Assign::FirstIdle => vec![0],
                Assign::Static => (0..cores).collect(),
            };
            loop {
                let busy = (0..cores).filter(|&core| self.units[core].busy);
                let Some(core) = busy.min_by_key(|&core| self.units[core].clock) else {
                    break;
                };
                let own = core % next.len();
                let step = next.len();
                let slot = &mut next[own];
                self.turn(core, work, &mut || {
                    let item = phase.get(*slot).copied();
                    *slot += step;
                    item
                });
            }
            self.cycles = self.units.iter().map(|unit| unit.clock).max().unwrap_or(0);
        }
        Ok(())
    }

    fn between_frames(&mut self, _index: usize, config: &RunConfig) {
        match config.between_frames {
            BetweenFrames::Keep => return,
            BetweenFrames::Flush => (),
            BetweenFrames::Lose(_) => unreachable!("not drawn"),
        }
        self.mshrs.iter_mut().for_each(|mshrs| mshrs.fill(0));
        for level in self.l1.iter_mut().chain(&mut self.l2) {
            level.cache.clear();
            level.in_flight = PlainInFlight::default();
        }
    }

    fn outcome(&self, _config: &RunConfig) -> MachineOutcome {
        let sum = |of: fn(&PlainUnit) -> u64| self.units.iter().map(of).sum::<u64>();
        let (useful, wasted) = (sum(|unit| unit.useful), sum(|unit| unit.wasted));
        let cycles = useful + wasted + sum(|unit| unit.idle);
        let utilization = match cycles {
            0 => 0.0,
            _ => useful as f64 / cycles as f64,
        };
        MachineOutcome {
            counts: self.counts.clone(),
            tmu: Some(TmuResult {
                utilization,
                wasted_issues: wasted,
                threads: sum(|unit| unit.threads),
                loops: sum(|unit| unit.loops),
            }),
            cycles: Some(self.cycles),
            memory: MemoryResult {
                l2_mshrs: (self.tmu.l2_mshrs > 0).then_some(self.mshr_counts),
                ..MemoryResult::default()
            },
            timeline: None,
            first_lookups: None,
        }
    }
}

#[test]
fn the_fast_machine_agrees_with_the_plain_one_cycle_by_cycle() {
    let traces = [4, 5].map(|seed| layered([52, 36], 17, seed));
    let mut random = Random(2);
    let orders: Vec<Order> = Order::all().chain(composed()).collect();
    let policies: Vec<Replacement> = Replacement::all().collect();
    let mut loops = 0;
    for step in 0..machines(200) {
        let trace = &traces[random.below(2) as usize];
        let (mut l1, mut l2) = (
            random_cache(&mut random, 32),
            random_cache(&mut random, 256),
        );
        if random.below(2) == 0 {
            (l1.ways, l2.ways) = (4, 4);
            (l1.size_bytes, l2.size_bytes) = (64 << random.below(6), 64 << random.below(9));
            l1.replacement = random.pick(&policies);
            l2.replacement = random.pick(&policies);
        }
        for cache in [&mut l1, &mut l2] {
            cache.victim_lines = random.pick(&[0, 0, 0, 2]);
            cache.sectors = random.pick(&[1, 1, 1, 4]);
            cache.size_bytes *= u64::from(cache.sectors);
        }
        let mut level = Levels::two(l1, l2);
        level.l2.hit_cycles = random.pick(&[0, 1, 20, 20, 300]);
        level.l2.shared = random.pick(&[true, true, false]);
        let config = RunConfig {
            mode: Mode::Timed,
            order: random.pick(&orders),
            cores: random.pick(&[1, 2, 2, 3, 5]),
            assign: random.pick(&[Assign::FirstIdle, Assign::Static]),
            level,
            memory_cycles: random.pick(&[0, 7, 200, 200, 9000]),
            tmu: TmuConfig {
                loop_cycles: random.pick(&[1, 36, 64, 64, 5000]),
                threads: random.pick(&[1, 4, 64, 64, 300]),
                retry_footprints: random.pick(&[1, 4, 4, 5]),
                fetches_per_trip: random.pick(&[1, 2, 2, 64]),
                allocation: random.pick(&[
                    Allocation::OnFill,
                    Allocation::OnFill,
                    Allocation::OnMiss,
                ]),
                l2_mshrs: random.pick(&[0, 0, 1, 3, 16]),
                ..TmuConfig::default()
            },
            tile_maps: true,
            ..RunConfig::default()
        };
        let bins = Bins::new(&trace.tables, CountBy::Texture).unwrap();
        let plain = alone(trace, &config, &mut PlainTimed::new(&config, &bins));
        assert_eq!(replay(trace, &config).unwrap(), plain, "{step}: {config:?}");
        loops += plain.tmu.unwrap().loops;
    }
    assert!(loops > 100_000, "{loops}");
}

#[test]
fn compiled_and_general_caches_agree() {
    let trace = small();
    let config = RunConfig {
        mode: Mode::Timed,
        ..functional(Order::Z2_STA)
    };
    let counts = CacheCounts::new(&Bins::new(&trace.tables, CountBy::Texture).unwrap(), false);
    let general = threads::machine_of(
        &config,
        Caches::build(&config).unwrap().boxed(),
        counts,
        None,
    );
    assert_eq!(
        alone(&trace, &config, &mut *general.unwrap()),
        replay(&trace, &config).unwrap()
    );
}

#[test]
fn the_recorded_content_of_the_l2_is_the_plain_machines() {
    let trace = layered([52, 36], 17, 4);
    let mut most = 0;
    for (order, replacement, allocation, shared) in [
        (Order::Z2_STA, Replacement::LRU, Allocation::OnFill, true),
        (Order::MORTON, Replacement::FIFO, Allocation::OnMiss, true),
        (Order::Z2_LRTA, Replacement::LRU, Allocation::OnFill, false),
    ] {
        let mut config = RunConfig {
            mode: Mode::Timed,
            timeline: true,
            l2_changes: true,
            ..functional(order)
        };
        config.tmu.allocation = allocation;
        (config.level.l2.replacement, config.level.l2.shared) = (replacement, shared);
        let timeline = replay(&trace, &config).unwrap().timeline.unwrap();
        let [changes] = timeline.l2_changes.as_slice() else {
            panic!("one frame")
        };
        assert!(changes.is_sorted_by_key(|of| of.cycle));
        let mut found: HashMap<u32, i32> = HashMap::new();
        for of in changes {
            *found.entry(of.line).or_default() += if of.is_there { 1 } else { -1 };
        }
        let bins = Bins::new(&trace.tables, CountBy::Texture).unwrap();
        let mut plain = PlainTimed::new(&config, &bins);
        alone(&trace, &config, &mut plain);
        for level in &mut plain.l2 {
            level.arrive(plain.cycles);
        }
        for (line, count) in found {
            let caches = plain.l2.iter();
            let expected = caches.filter(|of| of.cache.contains(line)).count();
            assert_eq!(count as usize, expected, "{order:?}: {line}");
            most += expected;
        }
    }
    assert!(most > 100, "{most}");
}
