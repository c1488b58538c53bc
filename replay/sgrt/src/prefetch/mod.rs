//! Prefetchers of ray units: what a ray's step fetches ahead into the node and triangle caches. One a file, each a row of
//! the table.
//!
//! A prefetcher sees each step with the ray's traversal stack, which [`stacks`] reconstructs from the trace. It names nodes
//! and leaves; [`super::cycles`] fetches their lines.

mod none;
mod stacks;
mod treelet;
mod ttp;

use super::config::Prefetch;
use super::frame::{FrameError, RaySource};
use formats::raytrace::{BvhSummary, ChildKind, Hierarchy, RayGeometry, RayRecord, Visit};
use sim::registry::Named;
use stacks::{Stacks, visits_of};

/// A row of the table of prefetchers.
#[derive(Debug)]
pub struct PrefetchRow {
    /// Name.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// Builds it for a hierarchy; `None` if nothing is ever fetched ahead.
    build: Option<Build>,
}

type Build = fn(&Prefetch, &BvhSummary, &Hierarchy) -> Box<dyn RayPrefetcher>;

/// A named prefetcher.
pub type RayPrefetching = Named<PrefetchRow>;

sim::rows! { PrefetchRow:
    RayPrefetching::new(&none::ROW);
    RayPrefetching::new(&treelet::ROW);
    RayPrefetching::new(&ttp::ROW);
}

impl Default for Prefetch {
    fn default() -> Self {
        Self {
            prefetcher: RayPrefetching::new(&none::ROW),
            treelet_bytes: 512,
            stack_entries: 1,
            visits_dropped: false,
        }
    }
}

/// A step of a ray: an inner node, or the first triangle of a leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<'a> {
    /// What the ray visits.
    pub visit: Visit,
    /// Entries popped since the last step that went down to a child or pushed one; 0 if this one goes down.
    pub pops: u32,
    /// Entries left on the stack; the last one is popped next.
    pub stack: &'a [ChildKind],
}

/// A prefetching algorithm.
pub trait RayPrefetcher: Sync {
    /// Appends what to fetch ahead when a ray takes a step, first one first.
    fn observe(&self, step: &Step<'_>, ahead: &mut Vec<ChildKind>);
}

/// The rays' stacks, and what a prefetcher makes of them.
pub(super) struct Prefetcher {
    algorithm: Option<Box<dyn RayPrefetcher>>,
    visits_dropped: bool,
    hierarchy: Hierarchy,
    bvh: BvhSummary,
}

impl Prefetcher {
    /// Reads the hierarchy if the configuration needs stacks of rays.
    ///
    /// # Errors
    /// [`FrameError`] for a trace without hierarchy, or with an unreadable one.
    pub(super) fn new(
        config: &Prefetch,
        source: &dyn RaySource,
    ) -> Result<Option<Self>, FrameError> {
        let build = config.prefetcher.row().build;
        if build.is_none() && !config.visits_dropped {
            return Ok(None);
        }
        let hierarchy = source.hierarchy().map_err(FrameError::Hierarchy)?;
        let hierarchy = hierarchy.ok_or(FrameError::NoColumns(
            "cycles.prefetch",
            config.prefetcher.name(),
        ))?;
        let bvh = &source.tables().bvh;
        Ok(Some(Self {
            algorithm: build.map(|build| build(config, bvh, &hierarchy)),
            visits_dropped: config.visits_dropped,
            hierarchy,
            bvh: bvh.clone(),
        }))
    }

    /// Calls `each` with each visit of a ray, and with what is fetched ahead when it begins.
    pub(super) fn for_visits(
        &self,
        ray: &RayRecord,
        geometry: &RayGeometry,
        visits: &[Visit],
        mut each: impl FnMut(Visit, &mut dyn Iterator<Item = Visit>),
    ) {
        let mut ahead = Vec::new();
        let is_ended = ray.kind.ends_at_any_hit() && geometry.hit.is_some();
        let stacks = Stacks::new(&self.hierarchy, &self.bvh);
        stacks.for_visits(
            (geometry, is_ended),
            visits,
            self.visits_dropped,
            |visit, step| {
                ahead.clear();
                if let (Some(step), Some(algorithm)) = (step, &self.algorithm) {
                    algorithm.observe(step, &mut ahead);
                }
                each(visit, &mut ahead.iter().copied().flat_map(visits_of));
            },
        );
    }
}

#[cfg(test)]
mod tests;
