//! The two models of the units' time, and what the cycle-level one reports.

use super::cycles::PrefetchCounts;
use serde::{Deserialize, Serialize};

sim::choices! { Timing = "The model of the units' time.", default ClosedForm:
    ClosedForm = "closed-form", "The scarcest resource of each tile determines its time";
    Cycle = "cycle", "Every ray is simulated cycle by cycle; needs a trace with visits";
}

/// The cycle-level model beside the closed form.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct CycleTiming {
    /// Both eyes with reprojection.
    pub reprojected: FrameTiming,
    /// Both eyes completely traced.
    pub reference: FrameTiming,
    /// The left eye alone, completely traced.
    pub left: FrameTiming,
    /// The right eye alone, completely traced.
    pub right: FrameTiming,
    /// Relative performance by the closed form.
    pub closed_form_relative_performance: f64,
    /// Relative energy by the closed form.
    pub closed_form_relative_energy: f64,
}

/// One or both eyes in the cycle-level model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct FrameTiming {
    /// Unit cycles in which tiles are traced, without waits for a tile buffer.
    pub cycles: u64,
    /// The same by the closed form.
    pub closed_form_cycles: u64,
    /// By the closed form with the misses of this simulation.
    pub closed_form_cycles_same_misses: u64,
    /// Deviation of `closed_form_cycles` from `cycles`.
    pub closed_form_error_pct: f64,
    /// The scarcest resource by the closed form.
    pub closed_form_bottleneck: String,
    /// Unit cycles until the last ray has returned, including waits for a tile buffer.
    pub unit_cycles: u64,
    /// Unit cycles until the last tile is shaded and transferred.
    pub frame_cycles: u64,
    /// Unit cycles in which the cores waited for the transfers of a tile.
    pub core_wait_cycles: u64,
    /// Rays that the units accepted; equal to `rays_left`, which is checked.
    pub rays_entered: u64,
    /// Rays that the units returned.
    pub rays_left: u64,
    /// Nodes and triangles requested; equal to `answers`, which is checked.
    pub requests: u64,
    /// Requests whose data reached a pipeline.
    pub answers: u64,
    /// Occupied share of the traversal pipelines' cycles.
    pub traversal_utilisation_pct: f64,
    /// Occupied share of the intersection pipelines' cycles.
    pub intersection_utilisation_pct: f64,
    /// Shares of the units' cycles in which no pipeline is occupied, by cause.
    pub idle: IdlePct,
    /// Mean cycles from the acceptance of a ray to its return.
    pub mean_ray_cycles: f64,
    /// Share of node cache look-ups without a fetch; merging with a fetch in flight counts as such.
    pub node_l1_hit_pct: f64,
    /// The same for triangle caches.
    pub triangle_l1_hit_pct: f64,
    /// The same for the L2.
    pub l2_hit_pct: f64,
    /// Share of look-ups in both L1 caches that merge with a fetch in flight.
    pub l1_merged_pct: f64,
    /// Times that a request waited for an MSHR.
    pub mshr_waits: u64,
    /// Lines that rays fetched into the L1 caches.
    pub l1_misses: u64,
    /// Lines read from DRAM.
    pub dram_lines: u64,
    /// What the prefetcher did, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prefetch: Option<PrefetchTiming>,
}

/// Lines that a prefetcher asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct PrefetchTiming {
    /// Their numbers.
    #[serde(flatten)]
    pub counts: PrefetchCounts,
    /// Share of issued lines that a ray requested.
    pub accuracy_pct: f64,
    /// Share of these lines in them and the remaining misses of the L1 caches.
    pub covered_pct: f64,
}

/// Shares of a unit's cycles in which no pipeline is occupied. A cycle counts for the first cause that applies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct IdlePct {
    /// No ray in the unit.
    pub no_ray: f64,
    /// A ray waits for an MSHR.
    pub mshr: f64,
    /// A ray waits for a line that was not in the L2.
    pub dram: f64,
    /// A ray waits for a line from the L2.
    pub l2: f64,
    /// All rays are inside pipelines or being handed over.
    pub latency: f64,
}
