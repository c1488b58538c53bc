//! The `[tmu]` table of a configuration: the texture units.

use super::{ConfigError, in_range, is_zero};
use serde::{Deserialize, Serialize};

/// When a line that misses gets its way in the cache, and its victim is lost.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Allocation {
    /// When it arrives, as in the Z2 paper: lines in flight take no way.
    #[default]
    OnFill,
    /// When it is asked for: lines in flight take a way.
    OnMiss,
}

/// What a thread does whose lines are not in the L1.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum TmuModel {
    /// It requests all its lines and loops through the pipeline until they have arrived ("looping for the next chance").
    #[default]
    Looping,
    /// It stops at its first miss, and rates count first look-ups: the Z2 paper's machine, as its table suggests it.
    FirstMiss,
    /// Footprints wait in a FIFO until their lines have arrived; tags are checked before, in order (Igehy et al., 1998).
    PrefetchFifo,
}

impl TmuModel {
    /// Its name in configuration files.
    #[must_use]
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
#[serde(deny_unknown_fields, default)]
pub struct TmuConfig {
    /// What a thread does whose lines are not in the L1; without effect in functional mode.
    pub model: TmuModel,
    /// Pipeline length: a thread that missed is back at the first stage after this many cycles.
    pub loop_cycles: u32,
    /// Threads (quads) that a core holds at once.
    pub threads: u32,
    /// Footprints that one issue slot tries when their lines are not there: tags are checked a
    /// quad at a time, while filtering takes one footprint a cycle.
    pub retry_footprints: u32,
    /// Lines that a thread asks the L2 for in one trip; further ones wait for the next trip.
    pub fetches_per_trip: u32,
    /// When a line that misses gets its way in a cache; without effect where time does not pass (functional mode).
    pub allocation: Allocation,
    /// Misses of the L2 in flight at most (MSHRs), further ones wait; 0: any number. Without effect in functional mode.
    #[serde(skip_serializing_if = "is_zero")]
    pub l2_mshrs: u32,
    /// Footprints that the FIFO of the model prefetch-fifo holds.
    #[serde(skip_serializing_if = "is_usual_fifo")]
    pub fifo_footprints: u32,
}

/// Footprints of the FIFO unless a configuration says otherwise.
const USUAL_FIFO: u32 = 64;

fn is_usual_fifo(footprints: &u32) -> bool {
    *footprints == USUAL_FIFO
}

impl TmuConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first one out of range.
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
