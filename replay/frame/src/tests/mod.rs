//! Closed forms of the model, and a twin that steps through every cycle.

mod bounds;
mod monotonic;
mod queues;
mod twin;
mod whole;

use super::machine::DramMachine;
use super::*;
use proptest::prelude::*;
use sim::config::LevelConfig;
use sim::memory::TICKS;
use sim::memory::dram::Dram;
use std::collections::VecDeque;
use std::convert::Infallible;

/// Parts of items, for each core.
#[derive(Clone, Debug, Default)]
struct List {
    parts: Vec<VecDeque<Part>>,
    shared: VecDeque<Part>,
    taken: u64,
    cores_wait: bool,
    parts_of_item: u32,
}

impl List {
    /// Items for whichever core is idle.
    fn shared(parts: Vec<Part>) -> Self {
        Self {
            shared: parts.into(),
            parts_of_item: 1,
            ..Self::default()
        }
    }

    /// Items of which each core has a part.
    fn dealt(items: &[Vec<Part>], cores: usize, cores_wait: bool) -> Self {
        let mut list = Self {
            parts: vec![VecDeque::new(); cores],
            cores_wait,
            parts_of_item: cores as u32,
            ..Self::default()
        };
        for (number, item) in (0..).zip(items) {
            for core in 0..cores {
                let mut part = item.get(core).cloned().unwrap_or_default();
                part.item = number;
                list.parts[core].push_back(part);
            }
        }
        list
    }
}

impl Source for List {
    type Error = Infallible;

    fn take(&mut self, core: usize, part: &mut Part) -> Result<bool, Infallible> {
        let next = match self.parts.get_mut(core) {
            Some(own) => own.pop_front(),
            None => self.shared.pop_front().map(|mut part| {
                part.item = self.taken;
                self.taken += 1;
                part
            }),
        };
        let has_part = next.is_some();
        next.into_iter().for_each(|next| *part = next);
        Ok(has_part)
    }

    fn parts(&self) -> u32 {
        self.parts_of_item
    }

    fn cores_wait(&self) -> bool {
        self.cores_wait
    }
}

/// An idle machine.
fn device(machine: &Machine) -> Device {
    Device::new(machine, &|of| Box::new(Dram::new(of, machine.line_bytes))).expect("a machine")
}

/// Cycles and counters of the items.
fn run(machine: &Machine, mut list: List) -> (u64, Counts) {
    let mut device = device(machine);
    device.run(&mut list).expect("a list");
    (device.now(), device.counts().expect("conserved"))
}

/// One core without limits except those that a test sets: every stage takes a cycle.
fn machine() -> Machine {
    Machine {
        cores: 1,
        warps: 4,
        warp_quads: 8,
        instructions: 1.0,
        raster_ticks: 1,
        alu_ticks: [1; 2],
        filter_ticks: TICKS,
        filter_cycles: 10,
        fifo: 64,
        lookups: 4,
        l1: LevelConfig::lru(8 << 10),
        l1_mshrs: 1 << 20,
        merges: 1 << 20,
        port_ticks: 1,
        l2: LevelConfig::lru(128 << 10),
        banks: 1,
        l2_mshrs: 1 << 20,
        l2_cycles: 20,
        dram: fixed(200),
        tiles: 2,
        barrier: false,
        line_bytes: 16,
        core_mhz: 1000,
    }
}

fn fixed(latency: u64) -> DramMachine {
    rate(latency, 0)
}

fn rate(latency: u64, ticks_per_line: u64) -> DramMachine {
    DramMachine::Rate {
        latency,
        ticks_per_line,
        most_writes: 8,
    }
}

/// A warp: the lines of its requests, footprints per request, and instructions.
type Listed<'a> = (&'a [&'a [u32]], u32, [u64; 2]);

/// A part of warps.
fn part(warps: &[Listed<'_>]) -> Part {
    let mut part = Part::default();
    for (requests, footprints, alu_ticks) in warps {
        let requests = requests.iter().map(|lines| (*lines, *footprints));
        part.add_warp(requests, 8, *alu_ticks, false);
    }
    part
}

#[derive(Clone, Debug)]
struct RandomWork {
    /// By item and core: warps of requests of lines and footprints.
    items: Vec<Vec<Vec<RandomWarp>>>,
    cores_wait: bool,
    dealt: bool,
}

type RandomWarp = (Vec<(Vec<u32>, u32)>, [u64; 2], bool);

fn random_work(cores: usize) -> impl Strategy<Value = RandomWork> {
    let lines = prop::collection::btree_set(0_u32..48, 1..5)
        .prop_map(|lines| lines.into_iter().collect::<Vec<u32>>());
    let requests = prop::collection::vec((lines, 1_u32..9), 0..6);
    let ticks = 1_u64..6 * TICKS;
    let warp = (requests, [ticks.clone(), ticks], any::<bool>());
    let warps = prop::collection::vec(warp, 0..6);
    let items = prop::collection::vec(prop::collection::vec(warps, cores), 1..6);
    (items, any::<bool>(), any::<bool>()).prop_map(|(items, cores_wait, dealt)| RandomWork {
        items,
        cores_wait: cores_wait && dealt,
        dealt,
    })
}

impl RandomWork {
    fn list(&self, cores: usize) -> List {
        let to_part = |(place, warps): (usize, &Vec<RandomWarp>)| {
            let mut part = Part::default();
            for (requests, alu_ticks, priority) in warps {
                let quads = 1 + (place as u32 + part.requests.len() as u32) % 8;
                let requests = requests.iter().map(|(lines, of)| (&lines[..], *of));
                part.add_warp(requests, quads, *alu_ticks, *priority);
            }
            (part.write_first, part.write_lines) = (1000 + first_of(place), place as u32 % 4);
            part
        };
        match self.dealt {
            true => {
                let items = self.items.iter().map(|item| {
                    let parts = item.iter().enumerate().map(to_part);
                    parts.collect::<Vec<Part>>()
                });
                List::dealt(&items.collect::<Vec<_>>(), cores, self.cores_wait)
            }
            false => {
                let parts = self.items.iter().flatten().enumerate().map(to_part);
                List::shared(parts.collect())
            }
        }
    }
}

fn first_of(place: usize) -> u32 {
    place as u32 * 4
}

fn random_machine() -> impl Strategy<Value = Machine> {
    let level = |log_sets: std::ops::Range<u32>| {
        (log_sets, 1_u32..4).prop_map(|(log_sets, ways)| LevelConfig {
            ways,
            ..LevelConfig::lru((u64::from(ways) * 16) << log_sets)
        })
    };
    let caches = (
        level(0..3),
        level(0..4),
        1_usize..6,
        1_usize..6,
        1_usize..5,
        0_u32..3,
    );
    let rates = (
        1_u64..2 * TICKS,
        1_u64..3 * TICKS,
        1_u64..4 * TICKS,
        1_u64..12,
        1_usize..6,
        1_u32..5,
    );
    let memory = (
        1_u64..30,
        1_u64..60,
        prop_oneof![Just(0), 1_u64..6 * TICKS],
        0_u64..8,
    );
    let shape = (1_usize..4, 1_usize..6, 1_usize..4, any::<bool>());
    (caches, rates, memory, shape).prop_map(|(caches, rates, memory, shape)| {
        let (l1, l2, l1_mshrs, l2_mshrs, merges, log_banks) = caches;
        let (raster_ticks, filter_ticks, port_ticks, filter_cycles, fifo, lookups) = rates;
        let (l2_cycles, latency, ticks_per_line, most_writes) = memory;
        let (cores, warps, tiles, barrier) = shape;
        Machine {
            cores,
            warps,
            raster_ticks,
            filter_ticks,
            filter_cycles,
            fifo,
            lookups,
            l1,
            l1_mshrs,
            merges,
            port_ticks,
            l2,
            banks: 1 << log_banks,
            l2_mshrs,
            l2_cycles,
            dram: DramMachine::Rate {
                latency,
                ticks_per_line,
                most_writes,
            },
            tiles,
            barrier,
            ..machine()
        }
    })
}

fn machine_and_work() -> impl Strategy<Value = (Machine, RandomWork)> {
    random_machine().prop_flat_map(|machine| {
        let cores = machine.cores;
        (Just(machine), random_work(cores))
    })
}

/// Random machines per test: `MACHINES`, or few enough for seconds.
fn cases(usual: u32) -> ProptestConfig {
    let machines = std::env::var("MACHINES").ok();
    ProptestConfig::with_cases(machines.and_then(|n| n.parse().ok()).unwrap_or(usual))
}
