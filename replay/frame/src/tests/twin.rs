//! The same machine, one cycle after another, with plain lists that are searched. It shares only the caches' policy
//! (least recently used, written here again), the machine's numbers and the counters with the event loop.

use super::*;

/// Least recently used last.
struct Cache {
    sets: Vec<Vec<u32>>,
    ways: usize,
}

impl Cache {
    fn new(level: &LevelConfig) -> Self {
        let sets = level.size_bytes / 16 / u64::from(level.ways);
        Self {
            sets: vec![Vec::new(); sets as usize],
            ways: level.ways as usize,
        }
    }

    fn set(&mut self, line: u32) -> &mut Vec<u32> {
        let count = self.sets.len();
        &mut self.sets[line as usize % count]
    }

    fn look_up(&mut self, line: u32) -> bool {
        let set = self.set(line);
        let found = set.iter().position(|&other| other == line);
        if let Some(at) = found {
            set.remove(at);
            set.insert(0, line);
        }
        found.is_some()
    }

    fn fill(&mut self, line: u32) {
        let ways = self.ways;
        let set = self.set(line);
        set.insert(0, line);
        set.truncate(ways);
    }
}

struct Tile {
    part: Part,
    launched: usize,
    finished: usize,
    is_shaded: bool,
}

#[derive(Clone, Debug)]
struct WarpState {
    tile: usize,
    warp: Warp,
    born: u64,
    age: u64,
    /// What it does.
    phase: Phase,
    /// The next request to be looked up.
    request: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// In the rasteriser until a cycle.
    Raster(u64),
    /// Ready for its first or second instructions.
    Ready(bool),
    /// Instructions until a cycle; true for the second ones.
    Issues(u64, bool),
    /// Its requests are looked up, or wait for it, since a number of asking warps.
    Asks(u64),
    /// All requests are looked up.
    Waits,
    /// The last request leaves the filter in a cycle.
    Filtered(u64),
}

/// A request that is looked up.
#[derive(Clone, Debug)]
struct Looked {
    slot: usize,
    missing: Vec<u32>,
    footprints: u32,
    is_last: bool,
}

struct CoreTwin {
    cache: Cache,
    /// Lines in flight: look-ups so far, and whether DRAM has it.
    in_flight: Vec<(u32, usize, bool)>,
    tiles: Vec<Option<Tile>>,
    warps: Vec<Option<WarpState>>,
    ages: u64,
    asked: u64,
    raster: u64,
    alu: u64,
    filter: u64,
    current: Option<(Looked, usize)>,
    fifo: Vec<Looked>,
    is_stalled: bool,
    is_blocked: bool,
    /// Lines from the L2 to the port, and from the port, by cycle.
    to_port: Vec<(u64, u32)>,
    port: u64,
    from_port: Vec<(u64, u32)>,
    has_items: bool,
}

struct Twin<'m> {
    m: &'m Machine,
    cores: Vec<CoreTwin>,
    l2: Cache,
    l2_flight: Vec<(u32, Vec<usize>)>,
    banks: Vec<Vec<(usize, u32)>>,
    was_full: Vec<bool>,
    reads: Vec<u32>,
    writes: Vec<(usize, usize, u32)>,
    dram: u64,
    read_arrivals: Vec<(u64, u32, u64)>,
    written: Vec<(u64, usize, usize)>,
    asked_dram: Vec<(u32, u64)>,
    open: u64,
    left: Vec<u32>,
    counts: Counts,
}

fn whole(ticks: u64) -> u64 {
    ticks.div_ceil(TICKS)
}

pub(super) fn twin(m: &Machine, mut list: List) -> (u64, Counts) {
    let (latency, ticks, most_writes) = match m.dram {
        DramMachine::Rate {
            latency,
            ticks_per_line,
            most_writes,
        } => (latency, ticks_per_line, most_writes),
        DramMachine::Banks(_) => unreachable!("the twin has no banks"),
    };
    let core = |_| CoreTwin {
        cache: Cache::new(&m.l1),
        in_flight: Vec::new(),
        tiles: (0..m.tiles).map(|_| None).collect(),
        warps: Vec::new(),
        ages: 0,
        asked: 0,
        raster: 0,
        alu: 0,
        filter: 0,
        current: None,
        fifo: Vec::new(),
        is_stalled: false,
        is_blocked: false,
        to_port: Vec::new(),
        port: 0,
        from_port: Vec::new(),
        has_items: true,
    };
    let mut t = Twin {
        m,
        cores: (0..m.cores).map(core).collect(),
        l2: Cache::new(&m.l2),
        l2_flight: Vec::new(),
        banks: vec![Vec::new(); m.banks],
        was_full: vec![false; m.banks],
        reads: Vec::new(),
        writes: Vec::new(),
        dram: 0,
        read_arrivals: Vec::new(),
        written: Vec::new(),
        asked_dram: Vec::new(),
        open: 0,
        left: Vec::new(),
        counts: Counts::default(),
    };
    t.fetch(&mut list, 0);
    let mut now = 0;
    while t
        .cores
        .iter()
        .any(|core| core.tiles.iter().any(Option::is_some))
    {
        t.count(now);
        now += 1;
        assert!(now < 1 << 20, "the twin does not end");
        t.arrivals(now);
        t.step_banks(now);
        t.step_dram(now, latency, ticks, most_writes);
        for core in 0..m.cores {
            t.step_core(core, now, list.cores_wait);
        }
        t.fetch(&mut list, now);
    }
    (now, t.counts)
}

impl Twin<'_> {
    /// Counts cycle `now` by what the cores do in it.
    fn count(&mut self, now: u64) {
        self.counts.dram_in_flight += self.asked_dram.len() as u64;
        for core in &self.cores {
            let cycles = &mut self.counts.cycles;
            let warps = core.warps.iter().flatten().count() as u64;
            self.counts.warps_in_flight += warps;
            let tiles = || core.tiles.iter().flatten();
            let has_more = tiles().any(|tile| tile.launched < tile.part.warps.len());
            let from_dram = core.in_flight.iter().any(|(.., below)| *below);
            *(if whole(core.alu) > now {
                &mut cycles.issue
            } else if whole(core.filter) > now {
                &mut cycles.texture
            } else if warps == 0 && has_more && !core.is_blocked {
                &mut cycles.raster
            } else if warps == 0 && tiles().next().is_none() {
                &mut cycles.no_work
            } else if warps == 0 {
                &mut cycles.barrier
            } else if core.is_stalled {
                &mut cycles.mshr
            } else if core.fifo.first().is_some_and(|of| !of.missing.is_empty()) {
                match from_dram {
                    true => &mut cycles.dram,
                    false => &mut cycles.l2,
                }
            } else {
                &mut cycles.latency
            }) += 1;
        }
    }

    fn arrivals(&mut self, now: u64) {
        self.read_arrivals
            .sort_unstable_by_key(|(_, line, _)| *line);
        let (due, later): (Vec<_>, Vec<_>) = self
            .read_arrivals
            .drain(..)
            .partition(|(at, ..)| *at == now);
        self.read_arrivals = later;
        for (_, line, _) in due {
            self.l2.fill(line);
            self.counts.fills[1] += 1;
            let asked = self
                .asked_dram
                .iter()
                .position(|(of, _)| *of == line)
                .unwrap();
            let (_, since) = self.asked_dram.remove(asked);
            self.counts.dram_cycles += now - since;
            let at = self
                .l2_flight
                .iter()
                .position(|(of, _)| *of == line)
                .unwrap();
            for core in self.l2_flight.remove(at).1 {
                let core = &mut self.cores[core];
                core.to_port.push((now + self.m.l2_cycles, line));
                let flight = core.in_flight.iter_mut().find(|(of, ..)| *of == line);
                flight.unwrap().2 = false;
            }
            self.was_full.fill(false);
        }
        let (due, later): (Vec<_>, Vec<_>) =
            self.written.drain(..).partition(|(at, ..)| *at == now);
        self.written = later;
        for (_, core, slot) in due {
            self.cores[core].tiles[slot] = None;
        }
        for core in &mut self.cores {
            core.to_port.sort_unstable();
            while core.to_port.first().is_some_and(|(at, _)| *at == now) {
                let (_, line) = core.to_port.remove(0);
                core.port = core.port.max(now * TICKS) + self.m.port_ticks;
                core.from_port.push((whole(core.port).max(now + 1), line));
            }
            core.from_port.sort_unstable();
            while core.from_port.first().is_some_and(|(at, _)| *at == now) {
                let (_, line) = core.from_port.remove(0);
                core.cache.fill(line);
                self.counts.fills[0] += 1;
                core.in_flight.retain(|(of, ..)| *of != line);
                let current = core.current.iter_mut().map(|(looked, _)| looked);
                for looked in core.fifo.iter_mut().chain(current) {
                    let before = looked.missing.len();
                    looked.missing.retain(|of| *of != line);
                    self.counts.answered += (before - looked.missing.len()) as u64;
                }
            }
        }
        for core in 0..self.cores.len() {
            self.ends(core, now);
        }
    }

    /// Warps whose rasterisation, textures or instructions end.
    fn ends(&mut self, number: usize, now: u64) {
        let core = &mut self.cores[number];
        for state in core.warps.iter_mut().flatten() {
            match state.phase {
                Phase::Raster(at) if at == now => state.phase = Phase::Ready(false),
                Phase::Filtered(at) if at == now => state.phase = Phase::Ready(true),
                _ => {}
            }
        }
        for slot in 0..core.warps.len() {
            let Some(state) = &mut core.warps[slot] else {
                continue;
            };
            let tile = state.tile;
            match state.phase {
                Phase::Issues(at, false) if at == now => {
                    state.phase = match state.warp.first < state.warp.end {
                        true => Phase::Asks(core.asked),
                        false => Phase::Ready(true),
                    };
                    core.asked += 1;
                    continue;
                }
                Phase::Issues(at, true) if at == now => {}
                _ => continue,
            }
            self.counts.warps[1] += 1;
            self.counts.warp_cycles += now - state.born;
            core.warps[slot] = None;
            let of = core.tiles[tile].as_mut().unwrap();
            of.finished += 1;
            if of.finished == of.part.warps.len() {
                of.is_shaded = true;
                let (item, lines) = (of.part.item, of.part.write_lines);
                if lines == 0 {
                    core.tiles[tile] = None;
                } else {
                    self.writes.push((number, tile, lines));
                    self.counts.dram_lines[1] += u64::from(lines);
                }
                self.left[item as usize] -= 1;
                while self.left.get(self.open as usize) == Some(&0) {
                    self.open += 1;
                }
            }
            return self.ends(number, now);
        }
    }

    fn step_banks(&mut self, now: u64) {
        let m = self.m;
        for turn in 0..m.banks {
            let bank = (turn + now as usize) % m.banks;
            let Some(&(core, line)) = self.banks[bank].first() else {
                continue;
            };
            if self.was_full[bank] {
                continue;
            }
            let mark = |cores: &mut Vec<CoreTwin>| {
                let flight = cores[core].in_flight.iter_mut();
                flight
                    .filter(|(of, ..)| *of == line)
                    .for_each(|of| of.2 = true);
            };
            if self.l2.look_up(line) {
                self.counts.l2[0] += 1;
                self.cores[core].to_port.push((now + m.l2_cycles, line));
            } else if let Some((_, cores)) = self.l2_flight.iter_mut().find(|(of, _)| *of == line) {
                if cores.len() >= m.merges {
                    self.was_full[bank] = true;
                    continue;
                }
                cores.push(core);
                mark(&mut self.cores);
                self.counts.l2[1] += 1;
            } else if self.l2_flight.len() < m.l2_mshrs {
                self.l2_flight.push((line, vec![core]));
                mark(&mut self.cores);
                self.counts.l2[2] += 1;
                self.counts.dram_lines[0] += 1;
                self.reads.push(line);
                self.asked_dram.push((line, now));
            } else {
                self.was_full[bank] = true;
                continue;
            }
            self.banks[bank].remove(0);
        }
    }

    fn step_dram(&mut self, now: u64, latency: u64, ticks: u64, most_writes: u64) {
        while self.dram / TICKS <= now {
            let start = self.dram.max(now * TICKS);
            let waiting: u64 = self
                .writes
                .iter()
                .map(|(.., lines)| u64::from(*lines))
                .sum();
            if !self.writes.is_empty() && (waiting > most_writes || self.reads.is_empty()) {
                self.writes[0].2 -= 1;
                if let (core, slot, 0) = self.writes[0] {
                    self.writes.remove(0);
                    let end = whole(start + ticks).max(now + 1);
                    self.written.push((end, core, slot));
                }
            } else if !self.reads.is_empty() {
                let line = self.reads.remove(0);
                self.read_arrivals.push((whole(start) + latency, line, now));
            } else {
                return;
            }
            self.dram = start + ticks;
        }
    }

    fn step_core(&mut self, number: usize, now: u64, cores_wait: bool) {
        let m = self.m;
        let core = &mut self.cores[number];
        // Filter.
        while core.filter / TICKS <= now
            && core.fifo.first().is_some_and(|of| of.missing.is_empty())
        {
            let looked = core.fifo.remove(0);
            core.filter =
                core.filter.max(now * TICKS) + u64::from(looked.footprints) * m.filter_ticks;
            self.counts.requests[1] += 1;
            self.counts.footprints += u64::from(looked.footprints);
            if looked.is_last {
                let end = whole(core.filter) + m.filter_cycles;
                let state = core.warps[looked.slot].as_mut().unwrap();
                assert_eq!(state.phase, Phase::Waits);
                state.phase = Phase::Filtered(end.max(now + 1));
            }
        }
        // Look-up.
        core.is_stalled = false;
        let asks =
            core.warps
                .iter()
                .enumerate()
                .filter_map(|(slot, of)| match of.as_ref()?.phase {
                    Phase::Asks(since) => Some((since, slot)),
                    _ => None,
                });
        if let Some((_, slot)) = asks.min() {
            let state = core.warps[slot].clone().unwrap();
            let part = &core.tiles[state.tile].as_ref().unwrap().part;
            let request = part.requests[(state.warp.first + state.request) as usize];
            let lines = part.lines_of(&request).to_vec();
            let is_last = state.warp.first + state.request + 1 == state.warp.end;
            let (mut looked, mut done) = core.current.take().unwrap_or_else(|| {
                self.counts.requests[0] += 1;
                let looked = Looked {
                    slot,
                    missing: Vec::new(),
                    footprints: request.footprints,
                    is_last,
                };
                (looked, 0)
            });
            let mut budget = m.lookups;
            while done < lines.len() && budget > 0 {
                let line = lines[done];
                let full = core.in_flight.len() >= m.l1_mshrs;
                let flight = core.in_flight.iter_mut().find(|(of, ..)| *of == line);
                if core.cache.look_up(line) {
                    self.counts.l1[0] += 1;
                } else if let Some((_, count, _)) = flight {
                    if *count >= m.merges {
                        core.is_stalled = true;
                        break;
                    }
                    *count += 1;
                    looked.missing.push(line);
                    self.counts.l1[1] += 1;
                } else if full {
                    core.is_stalled = true;
                    break;
                } else {
                    core.in_flight.push((line, 1, false));
                    looked.missing.push(line);
                    self.counts.l1[2] += 1;
                    let bank = line ^ line >> 5 ^ line >> 10 ^ line >> 15;
                    self.banks[bank as usize % m.banks].push((number, line));
                }
                done += 1;
                budget -= 1;
            }
            if done < lines.len() || core.fifo.len() >= m.fifo {
                core.current = Some((looked, done));
            } else {
                core.fifo.push(looked);
                let state = core.warps[slot].as_mut().unwrap();
                state.request += 1;
                if is_last {
                    state.phase = Phase::Waits;
                }
            }
        }
        // Issue.
        while core.alu / TICKS <= now {
            let ready = core.warps.iter().enumerate().filter_map(|(slot, of)| {
                let of = of.as_ref()?;
                let is_ready = matches!(of.phase, Phase::Ready(_));
                is_ready.then_some((!of.warp.priority, of.age, slot))
            });
            let Some((_, _, slot)) = ready.min() else {
                break;
            };
            let state = core.warps[slot].as_mut().unwrap();
            let Phase::Ready(second) = state.phase else {
                unreachable!()
            };
            let ticks = state.warp.alu_ticks[usize::from(second)];
            core.alu = core.alu.max(now * TICKS) + ticks;
            self.counts.alu_ticks += ticks;
            state.phase = Phase::Issues(whole(core.alu).max(now + 1), second);
        }
        // Launch.
        core.is_blocked = false;
        while core.warps.iter().flatten().count() < m.warps {
            let tiles = core
                .tiles
                .iter()
                .enumerate()
                .filter_map(|(at, tile)| Some((at, tile.as_ref()?)));
            let unfinished = tiles.clone().filter(|(_, tile)| !tile.is_shaded);
            let oldest = unfinished.map(|(_, tile)| tile.part.item).min();
            let next = tiles.filter(|(_, tile)| tile.launched < tile.part.warps.len());
            let Some((item, at)) = next.map(|(at, tile)| (tile.part.item, at)).min() else {
                break;
            };
            if (m.barrier && oldest.unwrap() < item) || (cores_wait && item > self.open) {
                core.is_blocked = true;
                break;
            }
            if core.raster / TICKS > now {
                break;
            }
            let tile = core.tiles[at].as_mut().unwrap();
            let warp = tile.part.warps[tile.launched];
            tile.launched += 1;
            core.raster = core.raster.max(now * TICKS) + u64::from(warp.quads) * m.raster_ticks;
            let state = WarpState {
                tile: at,
                warp,
                born: now,
                age: core.ages,
                phase: Phase::Raster(whole(core.raster).max(now + 1)),
                request: 0,
            };
            core.ages += 1;
            self.counts.warps[0] += 1;
            match core.warps.iter().position(Option::is_none) {
                Some(free) => core.warps[free] = Some(state),
                None => core.warps.push(Some(state)),
            }
        }
    }

    fn fetch(&mut self, list: &mut List, _now: u64) {
        loop {
            let held = |core: &CoreTwin| core.tiles.iter().flatten().count();
            let free = self
                .cores
                .iter()
                .enumerate()
                .filter(|(_, core)| core.has_items);
            let Some((number, fewest)) = free
                .map(|(number, core)| (number, held(core)))
                .min_by_key(|(_, held)| *held)
            else {
                return;
            };
            if fewest >= self.m.tiles {
                return;
            }
            let mut part = Part::default();
            let core = &mut self.cores[number];
            if !list.take(number, &mut part).unwrap() {
                core.has_items = false;
                continue;
            }
            core.is_blocked = false;
            let item = part.item as usize;
            if item >= self.left.len() {
                self.left.resize(item + 1, list.parts());
            }
            let slot = core.tiles.iter().position(Option::is_none).unwrap();
            if part.warps.is_empty() {
                self.left[item] -= 1;
                while self.left.get(self.open as usize) == Some(&0) {
                    self.open += 1;
                }
                if part.write_lines == 0 {
                    continue;
                }
                self.writes.push((number, slot, part.write_lines));
                self.counts.dram_lines[1] += u64::from(part.write_lines);
            }
            core.tiles[slot] = Some(Tile {
                is_shaded: part.warps.is_empty(),
                part,
                launched: 0,
                finished: 0,
            });
        }
    }
}

proptest! {
    #![proptest_config(cases(300))]

    /// Small caches, few MSHRs, warps and tiles: all queues fill up.
    #[test]
    fn a_loop_over_every_cycle_gives_the_same_cycles_and_counts((machine, work) in machine_and_work()) {
        let list = || work.list(machine.cores);
        let simulated = run(&machine, list());
        prop_assert_eq!(simulated, twin(&machine, list()));
    }
}
