//! The traversal and intersection units: cycles of a batch of rays.
//!
//! A unit holds many rays in flight. In each cycle it issues at most one step per traversal pipeline and
//! one triangle test per intersection pipeline, for any ray that is ready. The scarcest of four resources
//! therefore limits its throughput, and a batch takes
//!
//! `max(traversal issue, intersection issue, ray transfer, latency / rays in flight)`
//!
//! cycles. Latency is the time of a ray on its own: its steps and tests through the full depth of their
//! pipelines, plus the wait of each visit that misses a cache (once per visit, however many lines it
//! misses). Batches follow each other without a gap, so filling and draining cancel out. A cycle-by-cycle
//! simulation of one unit in the tests deviates by a few per cent.

use super::cache::Misses;
use super::config::SgrtConfig;
use super::work::BatchWork;
use formats::raytrace::TraversalKind;

/// Cycles per resource for a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TniCycles {
    /// Issue slots of the traversal pipelines.
    pub traversal: f64,
    /// Issue slots of the intersection pipelines.
    pub intersection: f64,
    /// Rays accepted and returned.
    pub handover: f64,
    /// Serial latency of all rays over the rays in flight.
    pub latency: f64,
}

impl TniCycles {
    /// Cycles of the batch, which the scarcest resource determines.
    pub(super) fn total(&self) -> f64 {
        [
            self.traversal,
            self.intersection,
            self.handover,
            self.latency,
        ]
        .into_iter()
        .fold(0.0, f64::max)
    }

    /// Name of the scarcest resource.
    pub(super) fn bottleneck(&self) -> &'static str {
        let all = [
            ("traversal", self.traversal),
            ("intersection", self.intersection),
            ("hand-over", self.handover),
            ("latency", self.latency),
        ];
        let total = self.total();
        all.iter()
            .find(|(_, c)| *c == total)
            .map_or("none", |a| a.0)
    }

    /// Adds another batch's cycles, resource by resource.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, traversal, intersection, handover, latency);
    }
}

/// Cycles of a batch with these misses, in a tree of this kind. A step that occupies its pipeline for
/// several cycles also leaves it that much later.
pub fn cycles(
    work: &BatchWork,
    misses: &Misses,
    tree: TraversalKind,
    config: &SgrtConfig,
) -> TniCycles {
    let (step_cycles, _) = config.step(tree);
    let tni = &config.tni;
    let units = f64::from(tni.units);
    let (steps, tests) = (work.steps() as f64, work.triangle_tests() as f64);
    let rays = (work.rays() + work.retest_rays) as f64;

    let dram_cycles = config.memory.latency_ns * tni.clock_mhz * 1e-3;
    let latency = steps * (f64::from(tni.trv_depth_cycles) + (step_cycles - 1.0).max(0.0))
        + tests * f64::from(tni.ist_depth_cycles)
        + misses.l1_visits * f64::from(config.cache.l2_latency_cycles)
        + misses.l2_visits * dram_cycles;

    TniCycles {
        traversal: steps * step_cycles / (units * f64::from(tni.trv_pipelines)),
        intersection: tests * tni.ist_cycles_per_test / (units * f64::from(tni.ist_pipelines)),
        handover: rays / (units * tni.rays_per_cycle),
        latency: latency / (units * f64::from(tni.rays_in_flight)),
    }
}

#[cfg(test)]
mod tests;
