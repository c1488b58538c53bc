//! Counters, and what the model conserves.

use serde::Serialize;
use sim::sums::{Unbalanced, check_balance};

/// Cycles of all cores by what they did. A cycle in which a core neither issues nor filters counts for the first cause
/// that applies, in the order of the fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct CoreCycles {
    /// Instructions are issued.
    pub issue: u64,
    /// The texture unit filters.
    pub texture: u64,
    /// No warp, and no tile left in the frame's phase.
    pub no_work: u64,
    /// No warp: the next tile waits for another one, or a finished tile is being written.
    pub barrier: u64,
    /// No warp: the rasteriser emits one.
    pub raster: u64,
    /// A look-up waits for an MSHR of the L1.
    pub mshr: u64,
    /// The next quad waits while a line of the core comes from DRAM.
    pub dram: u64,
    /// The next quad waits for a line from the L2.
    pub l2: u64,
    /// Pipelines.
    pub latency: u64,
}

impl CoreCycles {
    /// Names of the causes, in the order of [`Self::list`].
    pub const NAMES: [&str; 9] = [
        "issue",
        "texture",
        "no work",
        "barrier",
        "raster",
        "MSHR",
        "DRAM",
        "L2",
        "pipelines",
    ];

    /// Cycles by cause, in the order of the fields.
    pub const fn list(&self) -> [u64; 9] {
        [
            self.issue,
            self.texture,
            self.no_work,
            self.barrier,
            self.raster,
            self.mshr,
            self.dram,
            self.l2,
            self.latency,
        ]
    }

    /// All cycles.
    pub fn all(&self) -> u64 {
        self.list().iter().sum()
    }

    /// Adds other cycles.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(
            self, other, issue, texture, no_work, barrier, raster, mshr, dram, l2, latency
        );
    }
}

/// Counters since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Counts {
    /// Cycles of all cores by cause.
    pub cycles: CoreCycles,
    /// Warps that were launched and that finished.
    pub warps: [u64; 2],
    /// Cycles from launch to end, summed over warps.
    pub warp_cycles: u64,
    /// Warps in flight, summed over cycles and cores.
    pub warps_in_flight: u64,
    /// Requests of texture units that were looked up and that were filtered.
    pub requests: [u64; 2],
    /// Footprints filtered.
    pub footprints: u64,
    /// Ticks of the ALUs.
    pub alu_ticks: u64,
    /// Look-ups in L1 caches that hit, merged with a line in flight, and missed.
    pub l1: [u64; 3],
    /// Look-ups in the L2, likewise.
    pub l2: [u64; 3],
    /// Lines that arrived in L1 caches and in the L2.
    pub fills: [u64; 2],
    /// Look-ups of requests that a line in flight answered.
    pub answered: u64,
    /// Lines that DRAM read and wrote.
    pub dram_lines: [u64; 2],
    /// Cycles from request to arrival in the L2, summed over lines.
    pub dram_cycles: u64,
    /// Lines in flight from DRAM, summed over cycles.
    pub dram_in_flight: u64,
}

impl Counts {
    /// The counters since `earlier`.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        let mut of = *self;
        let ([a, b], n) = ([&self.cycles, &earlier.cycles], &mut of.cycles);
        macro_rules! less {
            ($($field:ident)+) => { $(n.$field = a.$field - b.$field;)+ };
        }
        less!(issue texture no_work barrier raster mshr dram l2 latency);
        macro_rules! all_less {
            ($($field:ident)+) => { $(of.$field -= earlier.$field;)+ };
        }
        all_less!(warp_cycles warps_in_flight footprints alu_ticks answered dram_cycles dram_in_flight);
        macro_rules! lists_less {
            ($($field:ident)+) => { $(of.$field.iter_mut().zip(earlier.$field).for_each(|(a, b)| *a -= b);)+ };
        }
        lists_less!(warps requests l1 l2 fills dram_lines);
        of
    }

    /// Checks the counters of an idle machine: every request completed once, and Little's identity holds, in which
    /// items in flight summed over cycles equal cycles in flight summed over items.
    ///
    /// # Errors
    /// The first sum that is not conserved.
    pub(super) fn check(&self, core_cycles: u64) -> Result<(), Unbalanced> {
        let [_, merged, missed] = self.l1;
        let l2_all: u64 = self.l2.iter().sum();
        let sums = [
            ("warps that finished", self.warps[0], self.warps[1]),
            ("requests filtered", self.requests[0], self.requests[1]),
            ("answers to look-ups", merged + missed, self.answered),
            ("look-ups of the L2", missed, l2_all),
            ("lines filled into an L1", missed, self.fills[0]),
            ("lines filled into the L2", self.l2[2], self.fills[1]),
            ("lines read from DRAM", self.l2[2], self.dram_lines[0]),
            ("warps over time", self.warp_cycles, self.warps_in_flight),
            ("reads over time", self.dram_cycles, self.dram_in_flight),
            ("cycles of cores", core_cycles, self.cycles.all()),
        ];
        check_balance("model of frame time", &sums)
    }
}
