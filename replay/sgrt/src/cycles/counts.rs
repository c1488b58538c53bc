//! Counters of the simulation, and the conservation of rays and requests.

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
    #[must_use]
    pub fn all(&self) -> u64 {
        self.hits + self.merged + self.misses
    }

    fn combine(&mut self, other: &Self, with: impl Fn(u64, u64) -> u64) {
        self.hits = with(self.hits, other.hits);
        self.merged = with(self.merged, other.merged);
        self.misses = with(self.misses, other.misses);
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
    #[must_use]
    pub fn all(&self) -> u64 {
        self.busy + self.no_ray + self.mshr + self.dram + self.l2 + self.latency
    }

    fn combine(&mut self, other: &Self, with: impl Fn(u64, u64) -> u64) {
        self.busy = with(self.busy, other.busy);
        self.no_ray = with(self.no_ray, other.no_ray);
        self.mshr = with(self.mshr, other.mshr);
        self.dram = with(self.dram, other.dram);
        self.l2 = with(self.l2, other.l2);
        self.latency = with(self.latency, other.latency);
    }
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
    /// Cycles of all units by cause.
    pub cycles: UnitCycles,
}

impl Counts {
    fn combine(&mut self, other: &Self, with: impl Fn(u64, u64) -> u64 + Copy) {
        self.rays_entered = with(self.rays_entered, other.rays_entered);
        self.rays_left = with(self.rays_left, other.rays_left);
        self.ray_cycles = with(self.ray_cycles, other.ray_cycles);
        self.requests = with(self.requests, other.requests);
        self.answers = with(self.answers, other.answers);
        self.steps = with(self.steps, other.steps);
        self.tests = with(self.tests, other.tests);
        self.l1_fetching_requests = with(self.l1_fetching_requests, other.l1_fetching_requests);
        self.l2_fetching_requests = with(self.l2_fetching_requests, other.l2_fetching_requests);
        self.dram_lines = with(self.dram_lines, other.dram_lines);
        self.l1_mshr_waits = with(self.l1_mshr_waits, other.l1_mshr_waits);
        self.l2_mshr_waits = with(self.l2_mshr_waits, other.l2_mshr_waits);
        self.node_l1.combine(&other.node_l1, with);
        self.triangle_l1.combine(&other.triangle_l1, with);
        self.l2.combine(&other.l2, with);
        self.cycles.combine(&other.cycles, with);
    }

    /// Adds other counters.
    pub fn add(&mut self, other: &Self) {
        self.combine(other, |a, b| a + b);
    }

    /// The counters since an earlier state.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        let mut out = *self;
        out.combine(earlier, |a, b| a - b);
        out
    }

    /// Checks the counters at the end of a simulation of `rays` rays with `requests` requests.
    ///
    /// # Errors
    /// The first sum that is not conserved.
    pub(super) fn check(&self, rays: u64, requests: u64) -> Result<(), Unbalanced> {
        let l1_misses = self.node_l1.misses + self.triangle_l1.misses;
        for (what, expected, found) in [
            ("rays that entered", rays, self.rays_entered),
            ("rays that left", rays, self.rays_left),
            ("requests", requests, self.requests),
            ("answers to requests", requests, self.answers),
            ("steps and tests", requests, self.steps + self.tests),
            ("L2 look-ups", l1_misses, self.l2.all()),
            ("lines read from DRAM", self.l2.misses, self.dram_lines),
        ] {
            if expected != found {
                return Err(Unbalanced {
                    what,
                    expected,
                    found,
                });
            }
        }
        Ok(())
    }
}

/// A sum that the simulation did not conserve: a defect of the model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cycle-level model: expected {expected} {what}, found {found}")]
pub struct Unbalanced {
    /// What was counted.
    pub what: &'static str,
    /// Its value by the input or by another counter.
    pub expected: u64,
    /// The counter.
    pub found: u64,
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
