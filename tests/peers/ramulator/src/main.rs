//! Compares the DRAM model with Ramulator 1 (Kim, Yang and Mutlu, CAL 2015): the same reads at the same
//! clocks, DDR4-2400R, one channel.
//!
//! Prints row hits and mean latencies as CSV. Exits with 1 if row hits differ by more than 1 % of the
//! reads, or mean latencies by more than 3 %.

#[allow(dead_code)]
#[path = "../../../../replay/sim/src/memory/dram/mod.rs"]
mod dram;

use dram::{Dram, DramConfig, DramPreset};
use ramulator_wrapper::RamulatorWrapper;
use std::process::{Command, ExitCode};

/// Number of reads in a stream.
const READS: usize = 100_000;
/// Queue length of both simulators.
const QUEUE: u32 = 512;
/// Ramulator's configuration file.
const CONFIG: &str = "standard = DDR4\nchannels = 1\nranks = 1\nspeed = DDR4_2400R\norg = DDR4_4Gb_x8\n\
    record_cmd_trace = off\nprint_cmd_trace = off\ncpu_tick = 8\nmem_tick = 3\nearly_exit = on\n\
    expected_limit_insts = 200000000\nwarmup_insts = 100000000\ncache = no\ntranslation = None\naddr_mapping = RoBaRaCoCh\n";

/// A request: number of its burst, clock of its arrival, and whether it writes.
type Request = (u32, u64, bool);

/// Counts of a simulator.
struct Counted {
    row_hits: f64,
    /// Clocks from arrival to last data.
    latency: f64,
}

/// Xorshift64*: the streams are the same on every machine.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u32) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) % u64::from(bound)) as u32
    }
}

/// Bursts of 1 GiB.
const BURSTS: u32 = 1 << 24;

/// Sequential bursts, one read every `clocks` clocks.
fn sequential_reads(clocks: u64) -> Vec<Request> {
    (0..READS as u32)
        .map(|i| (i, clocks * u64::from(i), false))
        .collect()
}

fn sequential() -> Vec<Request> {
    sequential_reads(10)
}

/// Close to the 6 clocks between reads of a bank group, so the queue after a refresh takes long to drain.
fn backlog() -> Vec<Request> {
    sequential_reads(8)
}

/// Random bursts, one read every 16 clocks.
fn random() -> Vec<Request> {
    let mut random = Random(1);
    (0..READS as u64)
        .map(|i| (random.below(BURSTS), 16 * i, false))
        .collect()
}

/// Runs of 1 to 16 bursts at random positions, like those of a tile's textures: one read every other clock,
/// then a pause that leaves the data bus half idle.
fn runs() -> Vec<Request> {
    let mut random = Random(2);
    let (mut reads, mut clock) = (Vec::new(), 0);
    while reads.len() < READS {
        let (start, length) = (random.below(BURSTS - 16), 1 + random.below(16));
        for burst in start..start + length {
            reads.push((burst, clock, false));
            clock += 2;
        }
        clock += 6 * u64::from(length) + u64::from(random.below(16));
    }
    reads
}

/// Strides of three rows, so that every read opens a row.
fn strided() -> Vec<Request> {
    (0..READS as u32)
        .map(|i| (i * 384 % BURSTS, 24 * u64::from(i), false))
        .collect()
}

/// As [`runs`], with every third run written, like finished tiles between textures of others.
fn written_runs() -> Vec<Request> {
    let mut runs = runs();
    let (mut run, mut last) = (0, None);
    for (burst, _, write) in &mut runs {
        run += u32::from(last.replace(*burst).is_none_or(|last: u32| last + 1 != *burst));
        *write = run % 3 == 0;
    }
    runs
}

/// Random bursts, one request every 24 clocks, every fourth one a write.
fn random_writes() -> Vec<Request> {
    let mut random = Random(3);
    (0..READS as u64)
        .map(|i| (random.below(BURSTS), 24 * i, i % 4 == 0))
        .collect()
}

fn simulate_parallax(reads: &[Request]) -> Counted {
    let config = DramConfig {
        preset: DramPreset::Ddr4,
        channels: 1,
        queue: QUEUE,
        // One cycle is one clock.
        core_mhz: 1_000,
        ..DramConfig::default()
    };
    let device = config.preset.device();
    let mut dram = Dram::new(&config, device.burst_bytes);
    for (burst, clock, write) in reads {
        // The first cycle of 1 ns that is not before the clock; rounding it down gives the clock again.
        let cycle = (clock * u64::from(device.clock_ps)).div_ceil(1_000);
        let bytes = u64::from(device.burst_bytes);
        dram.request(u64::from(*burst) * bytes, bytes, *write, Some(cycle));
    }
    let found = dram.result();
    Counted {
        row_hits: (found.row_hits + found.write_row_hits) as f64,
        latency: found.latency_mean_ns * 1_000.0 / f64::from(device.clock_ps),
    }
}

fn simulate_ramulator(reads: &[Request], name: &str) -> Counted {
    let folder = std::env::temp_dir().join(format!("ramulator-peer-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let (config, stats) = (folder.join("ddr4.cfg"), folder.join("stats"));
    std::fs::write(&config, CONFIG).expect("a temporary file");
    let mut peer = RamulatorWrapper::new(&config.to_string_lossy(), &stats.to_string_lossy());
    let (mut clock, mut answered) = (0, 0);
    for (burst, arrival, write) in reads {
        while clock < *arrival {
            peer.cycle();
            clock += 1;
        }
        peer.send(u64::from(*burst) * 64, *write);
    }
    // Writes have no response.
    let wanted = reads.iter().filter(|(.., write)| !write).count();
    while answered < wanted {
        while peer.ret_available() {
            peer.pop();
            answered += 1;
        }
        peer.cycle();
    }
    // Ramulator writes its statistics when it is destroyed.
    drop(peer);
    let text = std::fs::read_to_string(&stats).expect("Ramulator's statistics");
    std::fs::remove_dir_all(&folder).expect("a temporary folder");
    let value = |key: &str| {
        let line = text.lines().find(|line| line.contains(key));
        let line = line.unwrap_or_else(|| panic!("no {key} in Ramulator's statistics:\n{text}"));
        let mut words = line
            .split_whitespace()
            .skip_while(|word| !word.contains(key));
        words
            .nth(1)
            .and_then(|word| word.parse::<f64>().ok())
            .expect("a number")
    };
    Counted {
        row_hits: value(".row_hits_channel_0_core"),
        // Ramulator receives a request one clock after its arrival.
        latency: value("read_latency_sum_0") / wanted as f64 - 1.0,
    }
}

/// A named stream.
type Stream = (&'static str, fn() -> Vec<Request>);

const STREAMS: [Stream; 7] = [
    ("sequential", sequential),
    ("random", random),
    ("runs", runs),
    ("strided", strided),
    ("written-runs", written_runs),
    ("random-writes", random_writes),
    ("backlog", backlog),
];

/// Reported without a limit: the peer serves at most 16 reads of a row before older requests, so it handles
/// two rows of a backlog differently.
const UNBOUND: &str = "backlog";

/// Runs the peer in its own process, because its statistics are global and a second simulation would
/// overwrite them.
fn run_peer_process(name: &str) -> Counted {
    let program = std::env::current_exe().expect("this program's path");
    let output = Command::new(program).arg(name).output().expect("a process");
    let text = String::from_utf8_lossy(&output.stdout);
    let mut numbers = text.split_whitespace().filter_map(|word| word.parse().ok());
    let mut next = || {
        numbers
            .next()
            .unwrap_or_else(|| panic!("{name}: {output:?}"))
    };
    Counted {
        row_hits: next(),
        latency: next(),
    }
}

fn main() -> ExitCode {
    if let Some(wanted) = std::env::args().nth(1) {
        for (name, stream) in STREAMS.iter().filter(|(name, _)| *name == wanted) {
            let found = simulate_ramulator(&stream(), name);
            println!("{} {}", found.row_hits, found.latency);
        }
        return ExitCode::SUCCESS;
    }
    println!(
        "stream,reads,\"row hits, ours\",\"row hits, Ramulator\",\"apart, % of reads\",\"mean latency, ours, clocks\",\
         \"mean latency, Ramulator, clocks\",\"apart, %\""
    );
    let mut is_held = true;
    for (name, stream) in STREAMS {
        let reads = stream();
        let (ours, theirs) = (simulate_parallax(&reads), run_peer_process(name));
        let hits_apart = 100.0 * (ours.row_hits - theirs.row_hits) / reads.len() as f64;
        let latency_apart = 100.0 * (ours.latency / theirs.latency - 1.0);
        is_held &= name == UNBOUND || (hits_apart.abs() <= 1.0 && latency_apart.abs() <= 3.0);
        println!(
            "{name},{},{},{},{hits_apart:.2},{:.2},{:.2},{latency_apart:.2}",
            reads.len(),
            ours.row_hits,
            theirs.row_hits,
            ours.latency,
            theirs.latency,
        );
    }
    if is_held {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
