//! Closed forms of single resources, and the bounds that every machine keeps.

use super::*;
use sim::memory::dram::{DramConfig, DramPreset};

/// Cycles of items that run one after the other on one device, after the first ones.
fn after(machine: &Machine, first: Part, then: Part) -> u64 {
    let mut device = device(machine);
    device.run(&mut List::shared(vec![first])).unwrap();
    let start = device.now();
    device.run(&mut List::shared(vec![then])).unwrap();
    device.counts().unwrap();
    device.now() - start
}

#[test]
fn warps_without_textures_take_their_instructions_to_the_cycle() {
    for (first, second, warps) in [(1, 1, 1), (3, 5, 40), (64, 64, 500)] {
        let one = (&[][..], 0, [first * TICKS, second * TICKS]);
        let work = || List::shared(vec![part(&vec![one; warps as usize])]);
        let mut m = machine();
        // A cycle until the first warp is launched, and one in the rasteriser.
        let (cycles, counts) = run(&m, work());
        assert_eq!(cycles, 2 + warps * (first + second));
        assert_eq!(counts.cycles.issue, cycles - 2);
        m.warps = 1;
        let (cycles, _) = run(&m, work());
        assert_eq!(cycles, 1 + warps * (1 + first + second));
    }
}

#[test]
fn hits_take_their_footprints_to_the_cycle() {
    let m = Machine {
        warps: 1000,
        fifo: 1000,
        ..machine()
    };
    for (requests, footprints, warps) in [(1, 4, 1), (3, 2, 50), (6, 7, 200)] {
        let lines = vec![&[7, 8][..]; requests];
        let one = (&lines[..], footprints, [1, 1]);
        let cycles = after(&m, part(&[one]), part(&vec![one; warps as usize]));
        let filtered = warps * requests as u64 * u64::from(footprints);
        // Launch, rasteriser, instructions and look-up, a cycle each; the pipeline; instructions.
        assert_eq!(cycles, 4 + filtered + m.filter_cycles + 1);
    }
}

#[test]
fn a_lone_miss_takes_the_sum_of_its_latencies() {
    let m = machine();
    let cycles = run(&m, List::shared(vec![part(&[(&[&[5]], 1, [1, 1])])])).0;
    // Launch, rasteriser, instructions, L2 look-up; DRAM, L2, port; filter and its pipeline, instructions.
    assert_eq!(cycles, 4 + 200 + m.l2_cycles + 1 + 1 + m.filter_cycles + 1);
}

/// Warps that each read lines of their own.
fn stream(warps: u32, lines_of_warp: u32) -> Part {
    let lines: Vec<Vec<u32>> = (0..warps)
        .map(|warp| {
            (0..lines_of_warp)
                .map(|line| warp * lines_of_warp + line)
                .collect()
        })
        .collect();
    let requests: Vec<Vec<&[u32]>> = lines.iter().map(|of| of.chunks(4).collect()).collect();
    let warps: Vec<_> = requests.iter().map(|of| (&of[..], 1, [1, 1])).collect();
    part(&warps)
}

fn streaming() -> Machine {
    Machine {
        warps: 64,
        fifo: 1 << 20,
        line_bytes: 64,
        l1: LevelConfig::lru(1 << 20),
        l2: LevelConfig::lru(8 << 20),
        banks: 4,
        ..machine()
    }
}

#[test]
fn a_saturated_stream_takes_the_bytes_over_the_bandwidth() {
    for ticks_per_line in [TICKS / 2, 2 * TICKS, 7 * TICKS / 3] {
        let m = Machine {
            dram: rate(200, ticks_per_line),
            ..streaming()
        };
        let (cycles, counts) = run(&m, List::shared(vec![stream(4000, 16)]));
        assert_eq!(counts.dram_lines, [64_000, 0]);
        let least = 64_000.0 * ticks_per_line as f64 / TICKS as f64;
        assert!(
            cycles as f64 >= least && least / cycles as f64 >= 0.99,
            "{cycles} {least}"
        );
    }
}

#[test]
fn a_saturated_stream_reaches_the_drained_rate_of_banks() {
    for preset in [DramPreset::Lpddr4, DramPreset::Lpddr5] {
        let config = DramConfig {
            preset,
            core_mhz: 1000,
            ..DramConfig::default()
        };
        let m = Machine {
            dram: DramMachine::Banks(config),
            ..streaming()
        };
        let (cycles, _) = run(&m, List::shared(vec![stream(4000, 16)]));
        let mut open_loop = Dram::new(&config, 64);
        (0..64_000).for_each(|line| open_loop.read(line, None));
        let drained_cycles = open_loop.result().time_us * 1000.0;
        let share = drained_cycles / cycles as f64;
        println!("{preset:?}: {:.2} % of the drained rate", 100.0 * share);
        assert!(share >= 0.99, "{share}");
    }
}

#[test]
fn twice_the_lines_of_a_tile_are_written_in_twice_the_time() {
    let cycles = |lines| {
        let m = Machine {
            dram: rate(200, 3 * TICKS),
            tiles: 1,
            ..machine()
        };
        let mut tile = part(&[(&[], 0, [TICKS; 2])]);
        tile.write_lines = lines;
        run(&m, List::shared(vec![tile; 10])).0
    };
    assert_eq!(cycles(40) - cycles(20), 10 * 20 * 3);
}

#[test]
fn cores_that_wait_start_a_tile_together() {
    let m = Machine {
        cores: 2,
        ..machine()
    };
    let [short, long] = [1, 100].map(|cycles| part(&[(&[], 0, [cycles * TICKS; 2])]));
    let items: Vec<Vec<Part>> = (0..10)
        .map(|number| match number % 2 {
            0 => vec![short.clone(), long.clone()],
            _ => vec![long.clone(), short.clone()],
        })
        .collect();
    let [apart, together] = [false, true].map(|wait| run(&m, List::dealt(&items, 2, wait)).0);
    // Each core has five long parts and five short ones.
    assert!(apart < 5 * 202 + 20, "{apart}");
    assert!(together >= 10 * 200, "{together}");
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn no_resource_works_above_its_rate((machine, work) in machine_and_work()) {
        let (cycles, counts) = run(&machine, work.list(machine.cores));
        let capacity = machine.cores as u64 * cycles * TICKS;
        prop_assert!(counts.alu_ticks <= capacity);
        prop_assert!(counts.footprints * machine.filter_ticks <= capacity);
        prop_assert!(counts.fills[0] * machine.port_ticks <= capacity);
        let look_ups: u64 = counts.l1.iter().sum();
        prop_assert!(look_ups <= machine.cores as u64 * cycles * u64::from(machine.lookups));
        prop_assert!(counts.l2.iter().sum::<u64>() <= machine.banks as u64 * cycles);
        let DramMachine::Rate { ticks_per_line, .. } = machine.dram else { unreachable!() };
        let lines: u64 = counts.dram_lines.iter().sum();
        prop_assert!(lines * ticks_per_line <= (cycles + 1) * TICKS);
    }
}
