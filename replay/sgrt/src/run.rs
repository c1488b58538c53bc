//! What one way of rendering a frame costs.

use super::cache::Misses;
use super::dram::DramBytes;
use super::srp::SrpCycles;
use super::tni::TniCycles;
use super::work::BatchWork;
use serde::{Deserialize, Serialize};

/// One way of rendering the frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Run {
    /// Work of all batches.
    pub work: BatchWork,
    /// Misses of all batches.
    pub misses: Misses,
    /// Unit cycles by resource, summed over batches.
    pub tni: TniCycles,
    /// Unit cycles: those of the scarcest resource of each batch, summed.
    pub tni_cycles: f64,
    /// Kernel cycles.
    pub srp: SrpCycles,
    /// Bytes read from and written to the tile buffers.
    pub on_chip_bytes: u64,
    /// Bytes read from and written to external memory.
    pub dram: DramBytes,
    /// Time of the frame.
    pub time_ns: f64,
    /// Time during which batches wait for external memory.
    pub memory_bound_ns: f64,
    /// Energy by component.
    pub energy: EnergyPj,
}

impl Run {
    /// Frames per second relative to another run.
    pub(super) fn performance_over(&self, reference: &Self) -> f64 {
        reference.time_ns / self.time_ns
    }

    /// Energy relative to another run.
    pub(super) fn energy_over(&self, reference: &Self) -> f64 {
        self.energy.total() / reference.energy.total()
    }
}

/// Energy by component in picojoules.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct EnergyPj {
    /// Steps, tests and ray transfers of the fixed-function units.
    pub tni_pj: f64,
    /// Kernels.
    pub srp_pj: f64,
    /// Node and triangle caches.
    pub caches_pj: f64,
    /// Tile buffers.
    pub sram_pj: f64,
    /// External memory.
    pub dram_pj: f64,
    /// Static power over the frame's time.
    pub static_pj: f64,
}

impl EnergyPj {
    /// Sum of all components.
    pub fn total(&self) -> f64 {
        self.tni_pj + self.srp_pj + self.caches_pj + self.sram_pj + self.dram_pj + self.static_pj
    }
}
