//! A plain version of the first-miss machine: cycle by cycle, from the records and the reference
//! footprints, with sets as lists. The fast machine must produce exactly the same counts.

use super::*;
use crate::config::{Allocation, Assign, TmuConfig};
use crate::order::Phase;
use crate::result::{FirstLookups, TmuResult};
use crate::stream::for_quads;
use std::collections::VecDeque;

/// A cache with delayed fill.
struct PlainLevel {
    sets: Vec<Vec<u64>>,
    ways: usize,
    /// Cycle and line, in order of request.
    in_flight: Vec<(u64, u64)>,
    allocation: Allocation,
}

impl PlainLevel {
    fn new(config: &LevelConfig, allocation: Allocation) -> Self {
        Self {
            sets: vec![Vec::new(); config.sets("", 16).unwrap() as usize],
            ways: config.ways as usize,
            in_flight: Vec::new(),
            allocation,
        }
    }

    fn set(&mut self, line: u64) -> &mut Vec<u64> {
        let index = (line % self.sets.len() as u64) as usize;
        &mut self.sets[index]
    }

    /// Returns true if the line is resident, and makes it the most recently used one.
    fn use_line(&mut self, line: u64) -> bool {
        let set = self.set(line);
        let found = set.iter().position(|&l| l == line);
        let allocated = found.is_some_and(|at| {
            set.remove(at);
            set.push(line);
            true
        });
        allocated && self.arrival(line).is_none()
    }

    fn fill(&mut self, line: u64) {
        let ways = self.ways;
        let set = self.set(line);
        set.push(line);
        if set.len() > ways {
            set.remove(0);
        }
    }

    fn arrive(&mut self, now: u64) {
        let due: Vec<u64> = (self.in_flight.iter())
            .filter(|(cycle, _)| *cycle == now)
            .map(|(_, line)| *line)
            .collect();
        self.in_flight.retain(|(cycle, _)| *cycle > now);
        if self.allocation == Allocation::OnFill {
            due.into_iter().for_each(|line| self.fill(line));
        }
    }

    fn arrival(&self, line: u64) -> Option<u64> {
        let mut found = self.in_flight.iter().filter(|(_, l)| *l == line);
        found.next().map(|(cycle, _)| *cycle)
    }

    fn enter(&mut self, line: u64, now: u64, arrival: u64) {
        if arrival == now || self.allocation == Allocation::OnMiss {
            self.fill(line);
        }
        if arrival > now {
            self.in_flight.push((arrival, line));
        }
    }
}

/// A quad: the remaining lines of its footprints.
#[derive(Clone, Default)]
struct PlainThread {
    began: u64,
    footprints: VecDeque<Vec<u64>>,
    tried: bool,
    fetches: u32,
    from_memory: bool,
    kept_from: Option<u64>,
}

#[derive(Default)]
struct PlainCore {
    quads: VecDeque<PlainThread>,
    running: Option<PlainThread>,
    waiting: VecDeque<(u64, PlainThread)>,
    done: bool,
    last: u64,
}

#[derive(Debug, Default, PartialEq)]
struct PlainCounts {
    l1: LevelCounters,
    l2: LevelCounters,
    first: FirstLookups,
    tmu: TmuResult,
    cycles: u64,
}

struct PlainFirstMiss<'a> {
    trace: &'a MemoryTrace,
    config: RunConfig,
    layout: Layout,
    l1: Vec<PlainLevel>,
    l2: PlainLevel,
    cores: Vec<PlainCore>,
    now: u64,
    useful: u64,
    idle: u64,
    counts: PlainCounts,
}

impl<'a> PlainFirstMiss<'a> {
    fn new(trace: &'a MemoryTrace, config: RunConfig) -> Self {
        let cores = config.cores as usize;
        Self {
            trace,
            config,
            layout: Layout::new(&trace.tables.textures, &config.layout).unwrap(),
            l1: (0..cores)
                .map(|_| PlainLevel::new(&config.level.l1, config.tmu.allocation))
                .collect(),
            l2: PlainLevel::new(&config.level.l2, config.tmu.allocation),
            cores: (0..cores).map(|_| PlainCore::default()).collect(),
            now: 0,
            useful: 0,
            idle: 0,
            counts: PlainCounts::default(),
        }
    }

    fn quads_of(&self, item: &WorkItem) -> VecDeque<PlainThread> {
        let tables = &self.trace.tables;
        let mut quads = VecDeque::new();
        let send = |quad: crate::stream::Quad<'_>| -> Result<(), StreamError> {
            let mut thread = PlainThread::default();
            for (record, operands) in with_operands(quad.records) {
                let sampling = &self.config.sampling;
                record_footprints(
                    tables,
                    quad.draw,
                    record,
                    operands,
                    sampling,
                    |sample, f| {
                        let mut lines: Vec<u64> = Vec::new();
                        for texel in f.texels() {
                            let (layer, level) = (f.layer.into(), f.level.into());
                            let at = self.layout.address(sample.texture, layer, level, texel);
                            let line = at.unwrap() / 16;
                            if !lines.contains(&line) {
                                lines.push(line);
                            }
                        }
                        thread.footprints.push_back(lines);
                    },
                );
            }
            if !thread.footprints.is_empty() {
                quads.push_back(thread);
            }
            Ok(())
        };
        for_quads(self.trace, item, send).unwrap();
        quads
    }

    fn run(mut self) -> PlainCounts {
        for phase in plan(self.trace, &self.config).unwrap() {
            self.phase(&phase);
        }
        let first = self.counts.first.over(self.useful);
        let cycles = self.useful + self.idle + self.counts.tmu.wasted_issues;
        self.counts.tmu.utilization = self.useful as f64 / cycles as f64;
        self.counts.l2.line_lookups = self.counts.l1.line_misses;
        self.counts.l2.footprints = self.counts.l1.footprint_misses;
        PlainCounts {
            first,
            cycles: self.now,
            ..self.counts
        }
    }

    fn phase(&mut self, phase: &Phase) {
        let cores = self.cores.len();
        let mut items: Vec<VecDeque<WorkItem>> = match self.config.dispatch() {
            Assign::FirstIdle => vec![phase.iter().copied().collect()],
            Assign::Static => (0..cores)
                .map(|core| phase.iter().skip(core).step_by(cores).copied().collect())
                .collect(),
        };
        let start = self.now;
        for core in &mut self.cores {
            (core.done, core.last) = (false, start);
        }
        while self.cores.iter().any(|core| !core.done) {
            for level in self.l1.iter_mut().chain([&mut self.l2]) {
                level.arrive(self.now);
            }
            for core in 0..cores {
                let queue = core % items.len();
                self.tick(core, &mut items[queue]);
            }
            self.now += 1;
        }
        // The cycle after the last look-up, with all arrivals until then. The cycles in which cores notice
        // that they are done do not count.
        let end = self.cores.iter().map(|core| core.last).max().unwrap();
        self.now = end;
    }

    fn tick(&mut self, core: usize, items: &mut VecDeque<WorkItem>) {
        let now = self.now;
        if self.cores[core].done {
            return;
        }
        if self.cores[core].running.is_none() {
            let due = matches!(self.cores[core].waiting.front(), Some((back, _)) if *back <= now);
            if due {
                let (_, mut thread) = self.cores[core].waiting.pop_front().unwrap();
                thread.began = now;
                self.counts.tmu.loops += 1;
                self.cores[core].running = Some(thread);
            } else if self.cores[core].waiting.len() < self.config.tmu.threads as usize {
                while self.cores[core].quads.is_empty() {
                    let Some(item) = items.pop_front() else { break };
                    self.cores[core].quads = self.quads_of(&item);
                }
                self.cores[core].running = self.cores[core].quads.pop_front();
                if let Some(thread) = &mut self.cores[core].running {
                    thread.began = now;
                    self.counts.tmu.threads += 1;
                }
            }
        }
        let Some(mut thread) = self.cores[core].running.take() else {
            let done = self.cores[core].waiting.is_empty();
            self.cores[core].done = done;
            self.idle += u64::from(!done);
            return;
        };
        self.cores[core].last = now + 1;
        let lines = thread.footprints[0].clone();
        let used = lines.iter().map(|&line| self.l1[core].use_line(line));
        let there: Vec<bool> = used.collect();
        let found = there.iter().all(|there| *there);
        let kept = thread.kept_from.is_some_and(|from| from <= now);
        if !thread.tried {
            self.counts.l1.footprints += 1;
            self.counts.l1.line_lookups += lines.len() as u64;
        }
        if found || kept {
            self.counts.first.forwarded += u64::from(!found);
            self.useful += 1;
            let (began, mut footprints) = (thread.began, thread.footprints);
            footprints.pop_front();
            if !footprints.is_empty() {
                self.cores[core].running = Some(PlainThread {
                    began,
                    footprints,
                    ..PlainThread::default()
                });
            }
            return;
        }
        self.counts.tmu.wasted_issues += 1;
        let missing = lines.iter().zip(&there).filter(|(_, there)| !**there);
        let missing: Vec<u64> = missing.map(|(line, _)| *line).collect();
        self.request(core, &missing, &mut thread);
        let back = thread.began + u64::from(self.config.tmu.loop_cycles);
        self.cores[core]
            .waiting
            .push_back((back.max(now + 1), thread));
    }

    fn request(&mut self, core: usize, missing: &[u64], thread: &mut PlainThread) {
        let now = self.now;
        let first = !thread.tried;
        thread.tried = true;
        if thread.kept_from.is_some() {
            return;
        }
        self.counts.first.l1_misses += u64::from(first);
        let [l1_cycles, l2_cycles] =
            [self.config.level.l2.hit_cycles, self.config.memory_cycles].map(u64::from);
        let (mut latest, mut fetched, mut from_memory) = (now, 0, 0);
        for &line in missing {
            if let Some(arrival) = self.l1[core].arrival(line) {
                latest = latest.max(arrival);
                if first {
                    self.counts.l1.secondary_misses += 1;
                    self.counts.first.l2_lookups += 1;
                    let away = self.l2.arrival(line).is_some();
                    self.counts.first.l2_misses += u64::from(away);
                }
                continue;
            }
            fetched += 1;
            let mut arrival = now + l1_cycles;
            let mut missed = false;
            if !self.l2.use_line(line) {
                missed = true;
                if let Some(on_its_way) = self.l2.arrival(line) {
                    self.counts.l2.secondary_misses += 1;
                    arrival = on_its_way + l1_cycles;
                } else {
                    from_memory += 1;
                    self.l2.enter(line, now, now + l2_cycles);
                    arrival = now + l2_cycles + l1_cycles;
                }
            }
            if first {
                self.counts.first.l2_lookups += 1;
                self.counts.first.l2_misses += u64::from(missed);
            }
            self.l1[core].enter(line, now, arrival);
            latest = latest.max(arrival);
        }
        self.counts.l1.line_misses += fetched;
        self.counts.l2.line_misses += from_memory;
        if fetched > 0 {
            self.counts.l1.footprint_misses += u64::from(thread.fetches == 0);
            thread.fetches += 1;
            thread.kept_from = (thread.fetches == 8).then_some(latest);
        }
        if from_memory > 0 && !std::mem::replace(&mut thread.from_memory, true) {
            self.counts.l2.footprint_misses += 1;
        }
    }
}

fn first_miss(trace: &MemoryTrace, config: &RunConfig) -> PlainCounts {
    let result = replay(trace, config).unwrap();
    PlainCounts {
        l1: result.l1.counters,
        l2: result.l2.counters,
        first: result.first_lookups.unwrap(),
        tmu: result.tmu.unwrap(),
        cycles: result.cycles.unwrap(),
    }
}

#[test]
fn all_counts_of_the_first_miss_machine_equal_the_plain_one() {
    let traces = [6, 7].map(|seed| layered([40, 24], 13, seed));
    let mut random = Random(3);
    let orders: Vec<Order> = Order::all().chain(composed()).collect();
    let (mut forwarded, mut merged, mut idle) = (0, 0, 0);
    for step in 0..machines(40) {
        let trace = &traces[random.below(2) as usize];
        let mut cache = |most_sets_log2: u64| {
            let ways = random.pick(&[1, 2, 4, 4]);
            LevelConfig {
                ways,
                ..LevelConfig::lru(u64::from(ways) << 4 << random.below(most_sets_log2))
            }
        };
        let mut level = Levels::two(cache(7), cache(10));
        level.l2.hit_cycles = random.pick(&[0, 1, 20, 20, 90]);
        let config = RunConfig {
            mode: Mode::Timed,
            order: random.pick(&orders),
            cores: random.pick(&[1, 2, 2, 3]),
            assign: random.pick(&[Assign::FirstIdle, Assign::Static]),
            level,
            memory_cycles: random.pick(&[0, 7, 200, 200]),
            tmu: TmuConfig {
                model: TmuModel::FirstMiss,
                loop_cycles: random.pick(&[1, 8, 24, 24, 300]),
                threads: random.pick(&[1, 4, 64, 64]),
                allocation: random.pick(&[Allocation::OnFill, Allocation::OnMiss]),
                ..TmuConfig::default()
            },
            tile_maps: true,
            ..RunConfig::default()
        };
        let plain = PlainFirstMiss::new(trace, config).run();
        assert_eq!(first_miss(trace, &config), plain, "{step}: {config:?}");
        forwarded += plain.first.forwarded;
        merged += plain.l1.secondary_misses;
        idle += u64::from(plain.tmu.utilization < 0.2);
    }
    assert!(
        forwarded > 100 && merged > 1000 && idle > 5,
        "{forwarded} {merged} {idle}"
    );
}

/// One quad that requests an absent line: the slots that it occupies follow from the rules.
#[test]
fn a_thread_waiting_for_memory_retries_every_loop_until_the_line_is_filled() {
    let mut tables = testing::tables(&[[4, 4]]);
    tables.textures[0].levels = 1;
    let trace = MemoryTrace {
        tables,
        tiles: vec![vec![testing::tile(&[(0, 1)])], vec![testing::tile(&[])]],
    };
    let config = RunConfig {
        tmu: TmuConfig {
            model: TmuModel::FirstMiss,
            loop_cycles: 24,
            ..TmuConfig::default()
        },
        ..RunConfig::default()
    };
    let result = replay(&trace, &config).unwrap();
    let first = result.first_lookups.unwrap();
    // Four lanes of one line are looked up at 0, 24 ... 216 without success, and at 240.
    let tmu = result.tmu.unwrap();
    assert_eq!((tmu.wasted_issues, tmu.loops), (10, 10));
    assert_eq!(result.cycles, Some(240 + 4));
    assert_eq!(
        (first.l1_misses, first.l2_lookups, first.l2_misses),
        (1, 1, 1)
    );
    assert_eq!(first.l1_footprint_miss_rate, 0.25);
    assert_eq!(result.external_bytes, 16);
}

#[test]
fn a_flush_between_frames_empties_the_first_miss_caches() {
    let trace = small();
    let frames = |between_frames| {
        let mut two = trace.clone();
        let again: Vec<_> = (two.tables.passes.iter().cloned())
            .map(|pass| formats::textrace::Pass { frame: 1, ..pass })
            .collect();
        two.tables.passes.extend(again);
        let tiles = two.tiles.clone();
        two.tiles.extend(tiles);
        let config = RunConfig {
            level: Levels::two(LevelConfig::lru(8 << 10), LevelConfig::lru(1 << 20)),
            between_frames,
            ..RunConfig::default()
        };
        replay(&two, &in_time(FIRST_MISS, config))
            .unwrap()
            .external_bytes
    };
    assert_eq!(
        frames(BetweenFrames::Flush),
        2 * frames(BetweenFrames::Keep)
    );
}

/// The maps attribute misses to the same tiles as the plain machine.
#[test]
fn tile_maps_add_up_to_the_primary_misses() {
    let trace = small();
    let config = RunConfig {
        tile_maps: true,
        ..RunConfig::default()
    };
    let result = replay(&trace, &in_time(FIRST_MISS, config)).unwrap();
    let sum = |of: fn(&crate::result::TileMap) -> &Vec<u32>| -> u64 {
        let maps = result.tile_maps.iter().flat_map(of);
        maps.map(|&count| u64::from(count)).sum()
    };
    assert_eq!(
        sum(|map| &map.l1_misses),
        result.l1.counters.footprint_misses
    );
    assert_eq!(sum(|map| &map.l2_misses), result.l2.counters.line_misses);
}
