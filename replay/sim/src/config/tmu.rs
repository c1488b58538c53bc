//! The `[tmu]` table of a configuration: the texture units.

use super::{is_default, settings};

crate::choices! { #[non_exhaustive] Allocation = "When a missing line is allocated a way and its victim is evicted.", default OnFill:
    OnFill = "on-fill", "When the line is filled, as in the Z2 paper: lines in flight occupy no way.";
    OnMiss = "on-miss", "When the line is requested: lines in flight occupy a way.";
}

crate::choices! { TmuModel = "What a thread does whose lines are not in the L1.", default Looping:
    Looping = "looping", "It requests all its lines and loops through the pipeline until they are filled (\"looping for the next chance\").";
    FirstMiss = "first-miss", "It stops at its first miss, and rates count first look-ups: the Z2 paper's machine as its table suggests it.";
    PrefetchFifo = "prefetch-fifo", "Footprints wait in a FIFO until their lines are filled; tags are checked earlier, in order (Igehy et al., 1998).";
}

settings! {
    /// The texture unit's pipeline; see `docs/models/texture-unit.md`.
    #[derive(Eq)]
    pub struct TmuConfig in "tmu." {
        /// What a thread does whose lines are not in the L1. Not used in functional mode.
        pub model: TmuModel = TmuModel::Looping;
        /// Pipeline length: a thread that misses re-enters the first stage after this many cycles.
        pub loop_cycles: u32 = 64, in 1..=100_000;
        /// Threads (quads) resident per core.
        pub threads: u32 = 64, in 1..=4096;
        /// Footprints that one issue slot tries while their lines are missing. Tags are checked one
        /// quad at a time, but filtering takes one cycle per footprint.
        pub retry_footprints: u32 = 4, in 1..=4096;
        /// Lines that a thread requests from the L2 per trip; further lines wait for the next trip.
        pub fetches_per_trip: u32 = 2, in 1..=4096;
        /// When a missing line is allocated a way in a cache. Not used in functional mode.
        pub allocation: Allocation = Allocation::OnFill;
        /// MSHRs of the L2: misses in flight at most, further misses wait; 0: unlimited. Not used in functional mode.
        #[serde(skip_serializing_if = "is_default")]
        pub l2_mshrs: u32 = 0, in 0..=65_536;
        /// Capacity in footprints of the FIFO of the model `prefetch-fifo`.
        #[serde(skip_serializing_if = "is_usual_fifo")]
        pub fifo_footprints: u32 = USUAL_FIFO, in 1..=65_536;
    }
}

/// Default capacity of the FIFO.
const USUAL_FIFO: u32 = 64;

fn is_usual_fifo(footprints: &u32) -> bool {
    *footprints == USUAL_FIFO
}
