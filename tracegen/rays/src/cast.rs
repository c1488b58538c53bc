//! Casts a ray with the counters that the trace's columns need.

use crate::bvh::count::{Counter, Counts, StackDepth, Visits};
use crate::bvh::{AlphaTest, Bvh, RayHit, TraversalStack};
use crate::ray::Ray;
use formats::raytrace::{RayGeometry, SlotHit, TraversalKind, Visit};

/// A question about a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Query {
    /// The nearest triangle.
    Closest,
    /// Any triangle.
    Blocker,
}

/// Hierarchy and stack of a tracer, and the columns that it records.
pub(crate) struct Caster<'a> {
    pub bvh: &'a Bvh,
    pub traversal: TraversalKind,
    pub visits: bool,
    pub geometry: bool,
    pub stack: TraversalStack,
}

/// What a ray found, and its work.
pub(crate) struct Cast {
    pub hit: Option<RayHit>,
    pub counts: Counts,
    stack_depth: u32,
}

impl Caster<'_> {
    /// Casts a ray, and appends its visits and its geometry if they are recorded.
    pub fn cast<A: AlphaTest>(
        &mut self,
        query: Query,
        ray: &Ray,
        alpha: &A,
        visits: &mut Vec<Visit>,
        geometry: &mut Vec<RayGeometry>,
    ) -> Cast {
        let counts = Counts::default();
        let cast = match (self.visits, self.geometry) {
            (false, false) => {
                let mut counts = counts;
                let hit = self.run(query, ray, &mut counts, alpha);
                Cast {
                    hit,
                    counts,
                    stack_depth: 0,
                }
            }
            (true, false) => {
                let list = visits;
                let mut visits = Visits { counts, list };
                let hit = self.run(query, ray, &mut visits, alpha);
                Cast {
                    hit,
                    counts: visits.counts,
                    stack_depth: 0,
                }
            }
            (false, true) => {
                let mut deep = StackDepth {
                    counter: counts,
                    entries: 0,
                };
                let hit = self.run(query, ray, &mut deep, alpha);
                Cast {
                    hit,
                    counts: deep.counter,
                    stack_depth: deep.entries,
                }
            }
            (true, true) => {
                let list = visits;
                let mut deep = StackDepth {
                    counter: Visits { counts, list },
                    entries: 0,
                };
                let hit = self.run(query, ray, &mut deep, alpha);
                Cast {
                    hit,
                    counts: deep.counter.counts,
                    stack_depth: deep.entries,
                }
            }
        };
        if self.geometry {
            geometry.push(cast.geometry(ray, self.bvh, self.traversal));
        }
        cast
    }

    fn run<C: Counter, A: AlphaTest>(
        &mut self,
        query: Query,
        ray: &Ray,
        counter: &mut C,
        alpha: &A,
    ) -> Option<RayHit> {
        let tree = self.traversal;
        match query {
            Query::Closest => (self.bvh).closest(tree, ray, &mut self.stack, counter, alpha),
            Query::Blocker => (self.bvh).blocker(tree, ray, &mut self.stack, counter, alpha),
        }
    }
}

impl Cast {
    fn geometry(&self, ray: &Ray, bvh: &Bvh, tree: TraversalKind) -> RayGeometry {
        RayGeometry {
            origin: ray.origin.to_array(),
            direction: ray.direction.to_array(),
            t_min: ray.t_min,
            t_max: ray.t_max,
            hit: self.hit.map(|hit| SlotHit {
                t: hit.t,
                slot: bvh.slot(tree, &hit),
            }),
            stack_depth: self.stack_depth,
        }
    }
}
