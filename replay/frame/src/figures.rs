//! Milliseconds, bytes and energy of a replay, and the lower bound of its cycles.

use super::counts::{CoreCycles, Counts};
use super::machine::{DramMachine, Machine};
use super::replay::FrameTime;
use serde::Serialize;
use sim::memory::TICKS;
use sim::memory::dram::DramPreset;

/// Energies at 45 nm (Horowitz, ISSCC 2014), in picojoules: a multiplication and an addition of 32 bits, and 64 bits from
/// a cache of 32 KiB and of 1 MiB. The lower ends are a quarter of them, for later processes.
const FMA_PJ: f64 = 4.6;
const L1_PJ_PER_8_BYTES: f64 = 20.0;
const L2_PJ_PER_8_BYTES: f64 = 100.0;
const LOW: f64 = 0.25;

/// What a bound is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// The bytes that any schedule transfers, at the sustained rate of DRAM.
    Dram,
    /// Instructions.
    Issue,
    /// Look-ups and footprints.
    Texture,
}

impl Limit {
    /// Name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dram => "dram",
            Self::Issue => "issue",
            Self::Texture => "texture",
        }
    }
}

/// Cycles that no schedule of this work is below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Cycles of all frames.
    pub cycles: f64,
    /// The busiest part.
    pub limit: Limit,
}

/// Energy of all frames in millijoules, low and high. Leakage and the display are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// Instructions, L1, L2.
    pub chip_mj: [f64; 2],
    /// DRAM: every burst from an open row, and every burst from a row of its own.
    pub dram_mj: [f64; 2],
}

/// Figures of a replay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Frames.
    pub frames: u64,
    /// Cycles of all frames.
    pub cycles: u64,
    /// Cycles of the slowest frame.
    pub slowest_cycles: u64,
    /// Cycles of all cores by cause.
    pub core_cycles: CoreCycles,
    /// Look-ups in the L2.
    pub l2_look_ups: u64,
    /// Bytes from and to DRAM.
    pub dram_bytes: [u64; 2],
    /// Mean latency of a read.
    pub dram_latency_cycles: f64,
    /// Energy.
    pub energy: Energy,
    /// Lower bound.
    pub bound: Bound,
    core_mhz: u32,
}

impl Figures {
    /// The figures of a replay.
    pub fn of(time: &FrameTime) -> Self {
        let machine = &time.machine;
        let mut all = Counts::default();
        for (_, of) in &time.frames {
            all.cycles.add(&of.cycles);
            formats::add_fields!(all, of, footprints, alu_ticks, dram_cycles);
            for (sums, counts) in [
                (&mut all.requests[..], &of.requests[..]),
                (&mut all.l1[..], &of.l1[..]),
                (&mut all.l2[..], &of.l2[..]),
                (&mut all.dram_lines[..], &of.dram_lines[..]),
            ] {
                sums.iter_mut().zip(counts).for_each(|(sum, of)| *sum += of);
            }
        }
        let cycles = time.frames.iter().map(|(cycles, _)| *cycles);
        Self {
            frames: time.frames.len() as u64,
            cycles: cycles.clone().sum(),
            slowest_cycles: cycles.max().unwrap_or(0),
            core_cycles: all.cycles,
            l2_look_ups: all.l2.iter().sum(),
            dram_bytes: all
                .dram_lines
                .map(|lines| lines * transferred_bytes(machine)),
            dram_latency_cycles: all.dram_cycles as f64 / all.dram_lines[0].max(1) as f64,
            energy: energy(machine, &all),
            bound: bound(time, &all),
            core_mhz: machine.core_mhz,
        }
    }

    /// Mean milliseconds per frame.
    pub fn ms(&self) -> f64 {
        self.in_ms(self.cycles as f64) / self.frames.max(1) as f64
    }

    /// Milliseconds of the slowest frame.
    pub fn slowest_ms(&self) -> f64 {
        self.in_ms(self.slowest_cycles as f64)
    }

    /// Mean milliseconds per frame of the lower bound.
    pub fn bound_ms(&self) -> f64 {
        self.in_ms(self.bound.cycles) / self.frames.max(1) as f64
    }

    /// Bandwidth used, in GB/s.
    pub fn gb_per_s(&self) -> f64 {
        let bytes: u64 = self.dram_bytes.iter().sum();
        bytes as f64 * 1e-6 / self.in_ms(self.cycles.max(1) as f64)
    }

    fn in_ms(&self, cycles: f64) -> f64 {
        cycles / (f64::from(self.core_mhz) * 1e3)
    }
}

/// Bytes that DRAM transfers for a line.
fn transferred_bytes(machine: &Machine) -> u64 {
    let burst = match machine.dram {
        DramMachine::Banks(dram) => dram.preset.device().burst_bytes,
        DramMachine::Rate { .. } => 1,
    };
    u64::from(machine.line_bytes.next_multiple_of(burst))
}

fn bound(time: &FrameTime, all: &Counts) -> Bound {
    let machine = &time.machine;
    // A schedule that skips tiles need not read all lines.
    let reads = time.unique_lines.min(all.dram_lines[0]);
    let bytes = (reads + all.dram_lines[1]) * transferred_bytes(machine);
    let cores = machine.cores as f64 * TICKS as f64;
    // A texture unit looks up one request per cycle, of so many lines.
    let look_ups = all.l1.iter().sum::<u64>() / u64::from(machine.lookups);
    let look_up_ticks = all.requests[1].max(look_ups) * TICKS;
    let texture_ticks = look_up_ticks.max(all.footprints * machine.filter_ticks) as f64;
    let limits = [
        (
            bytes as f64 / machine.sustained_bytes_per_cycle(),
            Limit::Dram,
        ),
        (all.alu_ticks as f64 / cores, Limit::Issue),
        (texture_ticks / cores, Limit::Texture),
    ];
    let largest = |a: (f64, Limit), b: (f64, Limit)| if b.0 > a.0 { b } else { a };
    let (cycles, limit) = limits.into_iter().fold((0.0, Limit::Dram), largest);
    Bound { cycles, limit }
}

fn energy(machine: &Machine, all: &Counts) -> Energy {
    let lanes = 4.0 * machine.warp_quads as f64;
    let ticks = machine.alu_ticks.iter().sum::<u64>().max(1) as f64;
    let warps = all.alu_ticks as f64 / ticks;
    let instructions = warps * lanes * machine.instructions;
    let sum = |counts: &[u64; 3]| counts.iter().sum::<u64>() as f64;
    // A look-up in an L1 reads 16 bytes: four texels of up to 4 bytes.
    let l1 = sum(&all.l1) * 2.0 * L1_PJ_PER_8_BYTES;
    let l2 = sum(&all.l2) * f64::from(machine.line_bytes) / 8.0 * L2_PJ_PER_8_BYTES;
    let chip = (instructions * FMA_PJ + l1 + l2) * 1e-9;
    let device = match machine.dram {
        DramMachine::Banks(dram) => dram.preset.device(),
        DramMachine::Rate { .. } => DramPreset::default().device(),
    };
    let bursts = transferred_bytes(machine) as f64 / f64::from(device.burst_bytes);
    let of = |lines: u64, nj: f64| lines as f64 * bursts * nj * 1e-6;
    let [reads, writes] = all.dram_lines;
    let low = of(reads, device.read_nj) + of(writes, device.write_nj);
    Energy {
        chip_mj: [LOW * chip, chip],
        dram_mj: [low, low + of(reads + writes, device.activate_nj)],
    }
}
