//! The `[tmu]` table of a configuration: the texture units.

use super::{ConfigError, in_range, is_zero};
use serde::{Deserialize, Serialize};

/// When a missing line is allocated a way and its victim is evicted.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Allocation {
    /// When the line is filled, as in the Z2 paper: lines in flight occupy no way.
    #[default]
    OnFill,
    /// When the line is requested: lines in flight occupy a way.
    OnMiss,
}

/// What a thread does whose lines are not in the L1.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum TmuModel {
    /// It requests all its lines and loops through the pipeline until they are filled ("looping for
    /// the next chance").
    #[default]
    Looping,
    /// It stops at its first miss, and rates count first look-ups: the Z2 paper's machine as its table suggests it.
    FirstMiss,
    /// Footprints wait in a FIFO until their lines are filled; tags are checked earlier, in order
    /// (Igehy et al., 1998).
    PrefetchFifo,
}

impl TmuModel {
    /// Name in configuration files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Looping => "looping",
            Self::FirstMiss => "first-miss",
            Self::PrefetchFifo => "prefetch-fifo",
        }
    }
}

/// The texture unit's pipeline; see `docs/models/texture-unit.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct TmuConfig {
    /// What a thread does whose lines are not in the L1. Not used in functional mode.
    pub model: TmuModel,
    /// Pipeline length: a thread that misses re-enters the first stage after this many cycles.
    pub loop_cycles: u32,
    /// Threads (quads) resident per core.
    pub threads: u32,
    /// Footprints that one issue slot tries while their lines are missing. Tags are checked one
    /// quad at a time, but filtering takes one cycle per footprint.
    pub retry_footprints: u32,
    /// Lines that a thread requests from the L2 per trip; further lines wait for the next trip.
    pub fetches_per_trip: u32,
    /// When a missing line is allocated a way in a cache. Not used in functional mode.
    pub allocation: Allocation,
    /// MSHRs of the L2: misses in flight at most, further misses wait; 0: unlimited. Not used in functional mode.
    #[serde(skip_serializing_if = "is_zero")]
    pub l2_mshrs: u32,
    /// Capacity in footprints of the FIFO of the model `prefetch-fifo`.
    #[serde(skip_serializing_if = "is_usual_fifo")]
    pub fifo_footprints: u32,
}

/// Default capacity of the FIFO.
const USUAL_FIFO: u32 = 64;

fn is_usual_fifo(footprints: &u32) -> bool {
    *footprints == USUAL_FIFO
}

impl TmuConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        for (key, value, least, most) in [
            ("tmu.threads", self.threads, 1, 4096),
            ("tmu.loop_cycles", self.loop_cycles, 1, 100_000),
            ("tmu.retry_footprints", self.retry_footprints, 1, 4096),
            ("tmu.fetches_per_trip", self.fetches_per_trip, 1, 4096),
            ("tmu.fifo_footprints", self.fifo_footprints, 1, 65_536),
            ("tmu.l2_mshrs", self.l2_mshrs, 0, 65_536),
        ] {
            in_range(key, value, least..=most)?;
        }
        Ok(())
    }
}

impl Default for TmuConfig {
    fn default() -> Self {
        Self {
            model: TmuModel::Looping,
            loop_cycles: 64,
            threads: 64,
            retry_footprints: 4,
            fetches_per_trip: 2,
            allocation: Allocation::OnFill,
            l2_mshrs: 0,
            fifo_footprints: USUAL_FIFO,
        }
    }
}
