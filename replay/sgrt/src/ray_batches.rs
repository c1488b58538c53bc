//! The rays of a trace as input of the cycle-level model.

use super::compose::Reuse;
use super::cycles::{Batch, BatchSource, Item, Machine, Pipeline, Request, merge};
use super::detect::Decision;
use super::frame::{FrameError, RaySource};
use super::hardware::{TileWork, is_traced};
use super::srp;
use super::ways::{Model, Way};
use super::work::RayClass;
use formats::raytrace::{BvhSummary, RayTile, Visit};
use formats::view::Eye;
use std::ops::Range;

/// The batches of one or both eyes in one way: tiles in order, left before right, pixels assigned to the units round
/// robin.
///
/// A warp consists of rays of one class and unit. The rays of a tile are all available at once, as in the closed form:
/// a shadow ray does not wait for the shading of its parent's hit.
pub(super) struct RayBatches<'a> {
    source: &'a dyn RaySource,
    model: &'a Model<'a>,
    way: Way,
    /// Of every right sample; not used for the reference.
    decisions: &'a [Decision],
    reuse: Reuse,
    work: &'a [TileWork],
    machine: &'a Machine,
    eyes: &'a [Eye],
    /// Number of the next batch.
    next: usize,
    tile: RayTile,
    /// Rays of the batch by unit and class, as ranges of its requests.
    rays: Vec<[Vec<Range<usize>>; 3]>,
}

impl<'a> RayBatches<'a> {
    /// The batches of the reference.
    pub(super) fn reference(
        source: &'a dyn RaySource,
        model: &'a Model<'a>,
        work: &'a [TileWork],
        machine: &'a Machine,
        eyes: &'a [Eye],
    ) -> Self {
        Self {
            source,
            model,
            way: Way::Reference,
            decisions: &[],
            reuse: Reuse::Primary,
            work,
            machine,
            eyes,
            next: 0,
            tile: RayTile::default(),
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
    fn add_rays(&mut self, tile: u32, eye: Eye, batch: &mut Batch) {
        let frame = self.model.frame;
        let bvh = &frame.tables.bvh;
        let line_bytes = self.model.config.cache.line_bytes;
        let is_complete = eye == Eye::Left || self.way == Way::Reference;
        let mut at = 0usize;
        let pixels = self.tile.pixels.iter().zip(frame.tile_samples(tile));
        for (turn, (pixel, sample)) in pixels.enumerate() {
            let decision = self.decisions.get(sample).filter(|_| !is_complete);
            let rays = &mut self.rays[turn % self.machine.units];
            if let Some(decision) = decision
                && decision.tests > 0
            {
                let first = batch.requests.len();
                for test in 0..u32::from(decision.tests) {
                    batch.requests.push(retest(decision, test, bvh, line_bytes));
                }
                rays[RayClass::Primary as usize].push(first..batch.requests.len());
            }
            for ray in self.tile.rays_of(pixel) {
                let end = at.saturating_add(ray.visit_count() as usize);
                let visits = self.tile.visits.get(at..end).unwrap_or(&[]);
                at = end;
                let class = RayClass::of(ray);
                if decision.is_none_or(|decision| is_traced(decision, class, self.reuse)) {
                    let first = batch.requests.len();
                    let requests = visits.iter().map(|visit| request(*visit, bvh, line_bytes));
                    batch.requests.extend(requests);
                    rays[class as usize].push(first..batch.requests.len());
                }
            }
        }
    }

    /// Makes the batch's items of the collected rays.
    fn make_items(&mut self, batch: &mut Batch) {
        for (rays, items) in self.rays.iter_mut().zip(&mut batch.items) {
            if self.machine.warp_rays == 1 {
                items.extend(rays.iter_mut().flat_map(|of_class| of_class.drain(..)).map(
                    |range| Item {
                        first: range.start as u32,
                        end: range.end as u32,
                        rays: 1,
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
                        .map(|range| &batch.requests[range.clone()])
                        .collect();
                    merge(&paths, &mut merged);
                    let first = batch.requests.len() as u32;
                    batch.requests.extend(merged);
                    items.push(Item {
                        first,
                        end: batch.requests.len() as u32,
                        rays: warp.len() as u32,
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
        let (tile, eye) = (self.next / self.eyes.len(), self.next % self.eyes.len());
        let Some(work) = self.work.get(tile) else {
            return Ok(false);
        };
        let (tile, eye) = (tile as u32, self.eyes[eye]);
        self.next += 1;
        self.source
            .tile(eye, tile, &mut self.tile)
            .map_err(|source| FrameError::Tile { eye, tile, source })?;
        self.add_rays(tile, eye, batch);
        self.make_items(batch);
        let of_cores = &self.model.batches(self.way, tile, work)[eye as usize];
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
