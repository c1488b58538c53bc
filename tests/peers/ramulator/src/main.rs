//! Compares the DRAM model with Ramulator 1 (Kim, Yang and Mutlu, CAL 2015), and prints figures as CSV.
//!
//! Without arguments: the same requests at the same clocks, DDR4-2400R, one channel. Exits with 1 if row
//! hits differ by more than 1 % of the requests, or mean latencies by more than 3 %. With texture traces:
//! both in the closed loop of `replay schedule`.

mod channels;
mod closed_loop;

use channels::{Policy, Ramulator, Record, Recorded, Timings};
use sim::memory::dram::{Channels, Dram, DramConfig, DramPreset};
use std::process::ExitCode;
use std::sync::{Arc, Mutex};

/// Number of reads in a stream.
const READS: usize = 100_000;
/// Queue length of both simulators.
const QUEUE: u32 = 512;
/// A request: number of its burst, clock of its arrival, and whether it writes.
type Request = (u32, u64, bool);

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
        run += u32::from(
            last.replace(*burst)
                .is_none_or(|last: u32| last + 1 != *burst),
        );
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

/// Row hits of reads and writes, and mean clocks from the arrival of a read to its last data.
fn simulate(requests: &[Request], make: impl Fn(&DramConfig) -> Box<dyn Channels>) -> (f64, f64) {
    let config = DramConfig {
        preset: DramPreset::Ddr4,
        channels: 1,
        queue: QUEUE,
        ..DramConfig::default()
    };
    let to = Arc::<Mutex<Record>>::default();
    let mut channels = Recorded::new(make(&config), &to);
    let mut answered = Vec::new();
    for (number, (burst, clock, write)) in (0..).zip(requests) {
        channels.request((*burst).into(), *write, *clock, number);
    }
    let mut clock = requests.last().map_or(0, |(_, clock, _)| *clock);
    while answered.len() < requests.len() {
        clock += 1000;
        channels.advance(clock, &mut answered);
    }
    drop(channels);
    let record = to.lock().expect("no panic");
    let hits = record.result.row_hits + record.result.write_row_hits;
    (hits as f64, record.mean())
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

/// Prints the comparison of all streams. Returns whether all hold the limits.
fn compare_streams() -> bool {
    println!(
        "stream,reads,\"row hits, ours\",\"row hits, Ramulator\",\"apart, % of reads\",\"mean latency, ours, clocks\",\
         \"mean latency, Ramulator, clocks\",\"apart, %\""
    );
    let mut is_held = true;
    for (name, stream) in STREAMS {
        let requests = stream();
        let ours = simulate(&requests, |config| Box::new(Dram::new(config, 64)));
        let theirs = simulate(&requests, |config| {
            Box::new(Ramulator::new(config, Policy::Published, Timings::Ours))
        });
        let hits_apart = 100.0 * (ours.0 - theirs.0) / requests.len() as f64;
        let latency_apart = 100.0 * (ours.1 / theirs.1 - 1.0);
        is_held &= name == UNBOUND || (hits_apart.abs() <= 1.0 && latency_apart.abs() <= 3.0);
        println!(
            "{name},{},{},{},{hits_apart:.2},{:.2},{:.2},{latency_apart:.2}",
            requests.len(),
            ours.0,
            theirs.0,
            ours.1,
            theirs.1,
        );
    }
    is_held
}

fn main() -> ExitCode {
    let traces: Vec<String> = std::env::args().skip(1).collect();
    let is_held = match traces.is_empty() {
        true => compare_streams(),
        false => closed_loop::run(&traces),
    };
    match is_held {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}
