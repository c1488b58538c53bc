//! Counters of the simulation, and the conservation of rays and requests.

use serde::{Deserialize, Serialize};
use sim::sums::{Unbalanced, check_balance};

/// Look-ups of cache lines by result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineCounts {
    /// Resident lines.
    pub hits: u64,
    /// Lines in flight: the look-up merged with their fetch.
    pub merged: u64,
    /// Lines fetched.
    pub misses: u64,
}

impl LineCounts {
    /// All look-ups.
    pub fn all(&self) -> u64 {
        self.hits + self.merged + self.misses
    }

    fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, hits, merged, misses);
    }
}

/// Cycles of all units by what they did. A cycle in which no pipeline is occupied counts for the first cause that
/// applies, in the order of the fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnitCycles {
    /// A pipeline issues or is still occupied.
    pub busy: u64,
    /// No ray in the unit.
    pub no_ray: u64,
    /// A ray waits for an MSHR.
    pub mshr: u64,
    /// A ray waits for a line that was not in the L2.
    pub dram: u64,
    /// A ray waits for a line from the L2.
    pub l2: u64,
    /// All rays are inside pipelines or being handed over.
    pub latency: u64,
}

impl UnitCycles {
    /// All cycles.
    pub fn all(&self) -> u64 {
        self.busy + self.no_ray + self.mshr + self.dram + self.l2 + self.latency
    }

    fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, busy, no_ray, mshr, dram, l2, latency);
    }
}

/// Lines that a prefetcher requested.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct PrefetchCounts {
    /// All of them: held, dropped and issued ones.
    pub requested: u64,
    /// In the L1 or in flight already.
    pub held: u64,
    /// Given up for want of an MSHR.
    pub dropped: u64,
    /// Fetched into an L1: useful, late and useless ones.
    pub issued: u64,
    /// Requested by a ray after their arrival.
    pub useful: u64,
    /// Requested by a ray before their arrival.
    pub late: u64,
    /// Requested by no ray before their eviction or the end.
    pub useless: u64,
    /// Issued ones that were read from DRAM.
    pub dram_lines: u64,
    /// Held ones and ones found in the L2 that the other eye had fetched last.
    pub of_other_eye: u64,
}

/// Counters since the start, or of a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rays accepted.
    pub rays_entered: u64,
    /// Rays returned.
    pub rays_left: u64,
    /// Cycles from acceptance to return, summed over rays.
    pub ray_cycles: u64,
    /// Nodes and triangles requested.
    pub requests: u64,
    /// Requests whose data reached a pipeline.
    pub answers: u64,
    /// Traversal steps issued.
    pub steps: u64,
    /// Triangle tests issued.
    pub tests: u64,
    /// Requests that fetched a line into an L1.
    pub l1_fetching_requests: u64,
    /// Requests that fetched a line into the L2.
    pub l2_fetching_requests: u64,
    /// Look-ups in node caches.
    pub node_l1: LineCounts,
    /// Look-ups in triangle caches.
    pub triangle_l1: LineCounts,
    /// Look-ups in the L2.
    pub l2: LineCounts,
    /// Lines read from DRAM for the L2.
    pub dram_lines: u64,
    /// Times that a request waited for an MSHR of an L1.
    pub l1_mshr_waits: u64,
    /// Times that a request waited for an MSHR of the L2.
    pub l2_mshr_waits: u64,
    /// Lines that a prefetcher requested.
    pub prefetch: PrefetchCounts,
    /// Cycles of all units by cause.
    pub cycles: UnitCycles,
}

impl Counts {
    /// Adds other counters.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(
            self,
            other,
            rays_entered,
            rays_left,
            ray_cycles,
            requests,
            answers,
            steps,
            tests,
            l1_fetching_requests,
            l2_fetching_requests,
            dram_lines,
            l1_mshr_waits,
            l2_mshr_waits
        );
        self.node_l1.add(&other.node_l1);
        self.triangle_l1.add(&other.triangle_l1);
        self.l2.add(&other.l2);
        self.cycles.add(&other.cycles);
        let (own, other) = (&mut self.prefetch, &other.prefetch);
        formats::add_fields!(
            own,
            other,
            requested,
            held,
            dropped,
            issued,
            useful,
            late,
            useless,
            dram_lines,
            of_other_eye
        );
    }

    /// Checks the counters at the end of a simulation of `rays` rays with `requests` requests.
    ///
    /// # Errors
    /// The first sum that is not conserved.
    pub(super) fn check(&self, rays: u64, requests: u64) -> Result<(), Unbalanced> {
        let l1_misses = self.node_l1.misses + self.triangle_l1.misses;
        let p = &self.prefetch;
        let sums = [
            ("rays that entered", rays, self.rays_entered),
            ("rays that left", rays, self.rays_left),
            ("requests", requests, self.requests),
            ("answers to requests", requests, self.answers),
            ("steps and tests", requests, self.steps + self.tests),
            ("L2 look-ups", l1_misses + p.issued, self.l2.all()),
            ("lines read from DRAM", self.l2.misses, self.dram_lines),
            (
                "outcomes of prefetches",
                p.issued,
                p.useful + p.late + p.useless,
            ),
            (
                "lines to prefetch",
                p.requested,
                p.held + p.dropped + p.issued,
            ),
        ];
        check_balance("cycle-level model", &sums)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_ray_and_a_request_answered_twice_are_found() {
        let good = Counts {
            rays_entered: 2,
            rays_left: 2,
            requests: 5,
            answers: 5,
            steps: 3,
            tests: 2,
            ..Counts::default()
        };
        assert_eq!(good.check(2, 5), Ok(()));
        let lost = Counts {
            rays_left: 1,
            ..good
        };
        let error = lost.check(2, 5).unwrap_err();
        assert_eq!(
            error.to_string(),
            "cycle-level model: expected 2 rays that left, found 1"
        );
        let twice = Counts { answers: 6, ..good };
        assert_eq!(twice.check(2, 5).unwrap_err().what, "answers to requests");
    }
}
