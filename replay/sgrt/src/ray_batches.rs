//! The rays of a trace as input of the cycle-level model.

use super::compose::Reuse;
use super::cycles::{Batch, BatchSource, Item, Machine, Pipeline, Request, merge};
use super::detect::Decision;
use super::frame::{FrameError, RaySource};
use super::hardware::{TileWork, decoded, for_rays, is_traced};
use super::prefetch::Prefetcher;
use super::srp;
use super::ways::{Model, Way};
use super::work::RayClass;
use formats::raytrace::{BvhSummary, RayTile, Visit};
use formats::view::Eye;
use sim::order::WorkItem;
use sim::order::rays::{RayPlan, eye_of};
use std::ops::Range;

/// A ray's requests, and its eye.
type RayPath = (Range<usize>, Eye);

/// The batches of one or both eyes in one way, in the order of a plan.
///
/// A warp consists of rays of one class and unit. The rays of a tile are all available at once, as in the closed form:
/// a shadow ray does not wait for the shading of its parent's hit.
pub(super) struct RayBatches<'a> {
    source: &'a dyn RaySource,
    model: &'a Model<'a>,
    plan: &'a RayPlan,
    way: Way,
    /// Of every right sample; not used for the reference.
    decisions: &'a [Decision],
    reuse: Reuse,
    work: &'a [TileWork],
    machine: &'a Machine,
    eyes: &'a [Eye],
    prefetcher: Option<&'a Prefetcher>,
    /// The next batches.
    batches: Box<dyn Iterator<Item = &'a [WorkItem]> + Send + 'a>,
    /// Rays of the batch by unit and class, as ranges of its requests.
    rays: Vec<[Vec<RayPath>; 3]>,
}

impl<'a> RayBatches<'a> {
    /// The batches of the reference.
    pub(super) fn reference(
        source: &'a dyn RaySource,
        model: &'a Model<'a>,
        plan: &'a RayPlan,
        work: &'a [TileWork],
        (machine, prefetcher): (&'a Machine, Option<&'a Prefetcher>),
        eyes: &'a [Eye],
    ) -> Self {
        Self {
            source,
            model,
            plan,
            way: Way::Reference,
            decisions: &[],
            reuse: Reuse::Primary,
            work,
            machine,
            eyes,
            prefetcher,
            batches: Box::new(plan.batches()),
            rays: vec![Default::default(); machine.units],
        }
    }

    /// The batches of both eyes in a way that reprojects.
    pub(super) fn reprojected(
        self,
        way: Way,
        decisions: &'a [Decision],
        reuse: Reuse,
    ) -> RayBatches<'a> {
        Self {
            way,
            decisions,
            reuse,
            ..self
        }
    }

    /// Adds the requests of the batch's rays, and their ranges to `self.rays`.
    fn add_rays(&mut self, items: &[WorkItem], tiles: &[RayTile], batch: &mut Batch) {
        let frame = self.model.frame;
        let bvh = &frame.tables.bvh;
        let line_bytes = self.model.config.cache.line_bytes;
        for_rays(frame, self.plan, self.model.config, items, tiles, |of| {
            let eye = eye_of(of.at);
            let is_complete = eye == Eye::Left || self.way == Way::Reference;
            let decision = self.decisions.get(of.sample).filter(|_| !is_complete);
            let rays = &mut self.rays[of.unit % self.machine.units];
            if let Some(decision) = decision.filter(|of_pixel| of.is_first && of_pixel.tests > 0) {
                let first = batch.requests.len();
                for test in 0..u32::from(decision.tests) {
                    batch.requests.push(retest(decision, test, bvh, line_bytes));
                }
                rays[RayClass::Primary as usize].push((first..batch.requests.len(), eye));
            }
            let class = RayClass::of(of.ray);
            if decision.is_none_or(|decision| is_traced(decision, class, self.reuse)) {
                let first = batch.requests.len();
                if let (Some(prefetcher), Some(geometry)) = (self.prefetcher, of.geometry) {
                    prefetcher.for_visits(of.ray, geometry, of.visits, |visit, ahead| {
                        let from = batch.prefetches.len() as u32;
                        let requests = ahead.map(|visit| request(visit, bvh, line_bytes));
                        batch.prefetches.extend(requests);
                        batch.ahead.resize(batch.requests.len(), 0..0);
                        batch.ahead.push(from..batch.prefetches.len() as u32);
                        batch.requests.push(request(visit, bvh, line_bytes));
                    });
                } else {
                    let requests = of.visits.iter();
                    let requests = requests.map(|visit| request(*visit, bvh, line_bytes));
                    batch.requests.extend(requests);
                }
                rays[class as usize].push((first..batch.requests.len(), eye));
            }
        });
    }

    /// Makes the batch's items of the collected rays.
    fn make_items(&mut self, batch: &mut Batch) {
        for (rays, items) in self.rays.iter_mut().zip(&mut batch.items) {
            if self.machine.warp_rays == 1 {
                items.extend(rays.iter_mut().flat_map(|of_class| of_class.drain(..)).map(
                    |(range, eye)| Item {
                        first: range.start as u32,
                        end: range.end as u32,
                        rays: 1,
                        eye,
                    },
                ));
                // In order of the trace, whatever the class.
                items.sort_by_key(|item| (item.first, item.end));
                continue;
            }
            for of_class in rays {
                for warp in of_class.chunks(self.machine.warp_rays as usize) {
                    let mut merged = Vec::new();
                    let paths: Vec<&[Request]> = (warp.iter())
                        .map(|(range, _)| &batch.requests[range.clone()])
                        .collect();
                    merge(&paths, &mut merged);
                    let first = batch.requests.len() as u32;
                    batch.requests.extend(merged);
                    items.push(Item {
                        first,
                        end: batch.requests.len() as u32,
                        rays: warp.len() as u32,
                        eye: warp[0].1,
                    });
                }
                of_class.clear();
            }
        }
    }
}

impl BatchSource for RayBatches<'_> {
    type Error = FrameError;

    fn next(&mut self, batch: &mut Batch) -> Result<bool, FrameError> {
        let is_of_eyes = |item: &&WorkItem| item.tiles().any(|at| self.eyes.contains(&eye_of(at)));
        let items = loop {
            let Some(items) = self.batches.next() else {
                return Ok(false);
            };
            let of_eyes = items.iter().filter(is_of_eyes).map(|item| match *item {
                WorkItem::Pair(left, right, _) if self.eyes.len() == 1 => {
                    WorkItem::Tile([left, right][self.eyes[0] as usize])
                }
                item => item,
            });
            let of_eyes: Vec<WorkItem> = of_eyes.collect();
            if !of_eyes.is_empty() {
                break of_eyes;
            }
        };
        let sort = self.model.config.tni.ray_sort;
        let needs_geometry = self.prefetcher.is_some() || sort.row().needs_geometry;
        let tiles = decoded(self.source, &items, needs_geometry)?;
        self.add_rays(&items, &tiles, batch);
        self.make_items(batch);
        let of_cores = &self.model.batch(self.way, &items, self.work);
        let config = self.model.config;
        let cycles = srp::cycles(&of_cores.work, config).total();
        batch.core_cycles = (cycles * config.tni.clock_mhz / config.srp.clock_mhz).ceil() as u64;
        let bytes = self.model.dram_bytes(of_cores, &Default::default()).total();
        batch.core_lines = bytes.div_ceil(config.cache.line_bytes);
        Ok(true)
    }
}

fn request(visit: Visit, bvh: &BvhSummary, line_bytes: u64) -> Request {
    let first = bvh.address(visit);
    let last = first + u64::from(bvh.visit_bytes(visit)).max(1) - 1;
    let first_line = first / line_bytes;
    Request {
        first_line: first_line as u32,
        lines: (last / line_bytes - first_line + 1) as u32,
        pipeline: match visit {
            Visit::Node(_) => Pipeline::Traversal,
            Visit::Triangle(_) => Pipeline::Intersection,
        },
    }
}

/// The request of a re-test. The trace has no slots of re-tested triangles, so that the reused triangle's number and the
/// next ones stand for them: equal triangles have equal addresses, and neighbours in the mesh near ones.
fn retest(decision: &Decision, test: u32, bvh: &BvhSummary, line_bytes: u64) -> Request {
    let slot = (u64::from(decision.primitive) + u64::from(test)) % bvh.triangles.max(1);
    request(Visit::Triangle(slot as u32), bvh, line_bytes)
}
