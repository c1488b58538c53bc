//! The `[tmu]` table of a configuration: the texture units.

use super::{ConfigError, is_zero};
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

/// The texture unit's pipeline ("looping for the next chance"); see `docs/tmu-model.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TmuConfig {
    /// Cycles from an L1 miss that hits the L2 until the line is in the L1.
    pub l1_penalty_cycles: u32,
    /// Cycles that an L2 miss takes, in addition.
    pub l2_penalty_cycles: u32,
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
    /// Footprints that the FIFO of prefetch-fifo mode holds.
    #[serde(skip_serializing_if = "is_usual_fifo")]
    pub fifo_footprints: u32,
}

/// Footprints of the FIFO unless a configuration says otherwise.
const USUAL_FIFO: u32 = 64;

fn is_usual_fifo(footprints: &u32) -> bool {
    *footprints == USUAL_FIFO
}

impl TmuConfig {
    /// True where a miss changes a cache at once, so that a thread's later look-ups see it.
    #[must_use]
    pub fn misses_change_caches_at_once(&self) -> bool {
        self.l1_penalty_cycles == 0 || self.allocation == Allocation::OnMiss
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first one out of range.
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let range = |ok: bool, key, expected, found: u32| match ok {
            true => Ok(()),
            false => Err(ConfigError::Range {
                key,
                expected,
                found: found.to_string(),
            }),
        };
        range(
            (1..=4096).contains(&self.threads),
            "tmu.threads",
            "1 to 4096",
            self.threads,
        )?;
        range(
            (1..=100_000).contains(&self.loop_cycles),
            "tmu.loop_cycles",
            "1 to 100000",
            self.loop_cycles,
        )?;
        for (key, count) in [
            ("tmu.retry_footprints", self.retry_footprints),
            ("tmu.fetches_per_trip", self.fetches_per_trip),
        ] {
            range((1..=4096).contains(&count), key, "1 to 4096", count)?;
        }
        range(
            (1..=65_536).contains(&self.fifo_footprints),
            "tmu.fifo_footprints",
            "1 to 65536",
            self.fifo_footprints,
        )?;
        range(
            self.l2_mshrs <= 65_536,
            "tmu.l2_mshrs",
            "0 to 65536",
            self.l2_mshrs,
        )?;
        for (key, cycles) in [
            ("tmu.l1_penalty_cycles", self.l1_penalty_cycles),
            ("tmu.l2_penalty_cycles", self.l2_penalty_cycles),
        ] {
            range(cycles <= 100_000, key, "0 to 100000", cycles)?;
        }
        Ok(())
    }
}

impl Default for TmuConfig {
    fn default() -> Self {
        Self {
            l1_penalty_cycles: 20,
            l2_penalty_cycles: 200,
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
