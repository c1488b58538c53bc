//! The samples of a ray trace as JSON, and their accesses to the hierarchy's memory.

use crate::raytrace::{
    BvhSummary, PixelRecord, RayGeometry, RayKind, RayRecord, RayTile, RaytraceTables, Visit,
};
use crate::view::Eye;
use serde::Serialize;
use std::io;

/// One sample of a pixel with its rays and their visits.
#[derive(Clone, Copy, Debug)]
pub struct RaySample<'a> {
    /// Eye.
    pub eye: Eye,
    /// Tile of the eye's image.
    pub tile: u32,
    /// Column and row in the image.
    pub pixel: [u32; 2],
    /// Number of the sample in its pixel.
    pub sample: u32,
    /// Its hit and colour.
    pub record: &'a PixelRecord,
    /// Its rays.
    pub rays: &'a [RayRecord],
    /// Visits of all rays, or `None` if the trace has no visits.
    visits: Option<&'a [Visit]>,
    /// Geometry of its rays, or `None` if the tile has none.
    pub geometry: Option<&'a [RayGeometry]>,
}

/// The samples of a decoded tile, in file order.
pub fn ray_samples<'a>(
    tables: &'a RaytraceTables,
    eye: Eye,
    number: u32,
    tile: &'a RayTile,
) -> impl Iterator<Item = RaySample<'a>> {
    let samples = tables.meta.samples_per_px.max(1);
    let width = tile.size_px[0].max(1);
    let [left, top] = tile.origin_px;
    let mut visits = tile.visits.as_slice();
    (0u32..).zip(&tile.pixels).map(move |(index, record)| {
        let rays = tile.rays_of(record);
        let count = rays.iter().map(RayRecord::visit_count).sum::<u64>();
        let (own, rest) = visits
            .split_at_checked(usize::try_from(count).unwrap_or(usize::MAX))
            .unwrap_or_default();
        visits = rest;
        let at = index / samples;
        RaySample {
            eye,
            tile: number,
            pixel: [left + at % width, top + at / width],
            sample: index % samples,
            record,
            rays,
            visits: tables.meta.has_visits.then_some(own),
            geometry: geometry_of(tile, record),
        }
    })
}

/// Geometry of the rays of a sample.
fn geometry_of<'a>(tile: &'a RayTile, record: &PixelRecord) -> Option<&'a [RayGeometry]> {
    let first = record.first_ray as usize;
    let end = first.saturating_add(record.ray_count as usize);
    tile.geometry.get(first..end)
}

/// A sample as `replay dump` prints it.
#[derive(Serialize)]
struct SampleLine<'a> {
    eye: Eye,
    tile: u32,
    x: u32,
    y: u32,
    sample: u32,
    hit: Option<crate::raytrace::Hit>,
    view_independent: [f32; 3],
    view_dependent: [f32; 3],
    rays: Vec<RayLine<'a>>,
}

#[derive(Serialize)]
struct RayLine<'a> {
    #[serde(flatten)]
    ray: &'a RayRecord,
    #[serde(flatten)]
    geometry: Option<GeometryLine>,
    #[serde(skip_serializing_if = "Option::is_none")]
    visits: Option<Vec<VisitLine>>,
}

#[derive(Serialize)]
struct GeometryLine {
    origin: [f32; 3],
    direction: [f32; 3],
    t_min: f32,
    t_max: f32,
    t: Option<f32>,
    slot: Option<u32>,
    stack_depth: u32,
}

impl From<&RayGeometry> for GeometryLine {
    fn from(geometry: &RayGeometry) -> Self {
        Self {
            origin: geometry.origin,
            direction: geometry.direction,
            t_min: geometry.t_min,
            t_max: geometry.t_max,
            t: geometry.hit.map(|hit| hit.t),
            slot: geometry.hit.map(|hit| hit.slot),
            stack_depth: geometry.stack_depth,
        }
    }
}

#[derive(Serialize)]
struct VisitLine {
    #[serde(skip_serializing_if = "Option::is_none")]
    node: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangle: Option<u32>,
    address: u64,
}

impl VisitLine {
    fn new(bvh: &BvhSummary, visit: Visit) -> Self {
        let (node, triangle) = match visit {
            Visit::Node(index) => (Some(index), None),
            Visit::Triangle(slot) => (None, Some(slot)),
        };
        Self {
            node,
            triangle,
            address: bvh.address(visit),
        }
    }
}

impl RaySample<'_> {
    /// Each ray with its visits.
    fn rays_and_visits(&self) -> impl Iterator<Item = (&RayRecord, Option<&[Visit]>)> {
        let mut visits = self.visits;
        self.rays.iter().map(move |ray| {
            let count = usize::try_from(ray.visit_count()).unwrap_or(usize::MAX);
            let split = visits.and_then(|visits| visits.split_at_checked(count));
            visits = split.map(|(_, rest)| rest);
            (ray, split.map(|(own, _)| own))
        })
    }

    /// The sample as one line of JSON.
    ///
    /// # Errors
    /// None in practice; the signature is the serialiser's.
    pub fn to_json(&self, bvh: &BvhSummary) -> serde_json::Result<String> {
        let mut geometry = self.geometry.unwrap_or_default().iter();
        let rays = self.rays_and_visits().map(|(ray, visits)| RayLine {
            ray,
            geometry: geometry.next().map(GeometryLine::from),
            visits: visits.map(|all| all.iter().map(|v| VisitLine::new(bvh, *v)).collect()),
        });
        serde_json::to_string(&SampleLine {
            eye: self.eye,
            tile: self.tile,
            x: self.pixel[0],
            y: self.pixel[1],
            sample: self.sample,
            hit: self.record.hit,
            view_independent: self.record.view_independent,
            view_dependent: self.record.view_dependent,
            rays: rays.collect(),
        })
    }

    /// Calls `visit` for each access to the hierarchy, in execution order. Stops at the first error.
    ///
    /// # Errors
    /// Errors of `visit`.
    pub fn accesses(
        &self,
        bvh: &BvhSummary,
        mut visit: impl FnMut(&RayAccess) -> io::Result<()>,
    ) -> io::Result<()> {
        for ((ray, visits), number) in self.rays_and_visits().zip(0u32..) {
            for each in visits.unwrap_or_default() {
                let (entry, index) = match *each {
                    Visit::Node(index) => (Entry::Node, index),
                    Visit::Triangle(slot) => (Entry::Triangle, slot),
                };
                visit(&RayAccess {
                    address: bvh.address(*each),
                    bytes: bvh.visit_bytes(*each),
                    eye: self.eye,
                    tile: self.tile,
                    x: self.pixel[0],
                    y: self.pixel[1],
                    sample: self.sample,
                    ray: number,
                    kind: ray.kind,
                    entry,
                    index,
                })?;
            }
        }
        Ok(())
    }
}

/// Kind of data that an access reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// An inner node.
    Node,
    /// A triangle.
    Triangle,
}

/// One read of the hierarchy's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayAccess {
    /// Address of the first byte.
    pub address: u64,
    /// Bytes read.
    pub bytes: u32,
    /// Eye.
    pub eye: Eye,
    /// Tile of the eye's image.
    pub tile: u32,
    /// Column of the pixel in the image.
    pub x: u32,
    /// Row of the pixel.
    pub y: u32,
    /// Sample of the pixel.
    pub sample: u32,
    /// Number of the ray within its sample.
    pub ray: u32,
    /// Kind of the ray.
    pub kind: RayKind,
    /// Node or triangle.
    pub entry: Entry,
    /// Number of the node, or slot of the triangle.
    pub index: u32,
}

impl RayAccess {
    /// Addresses of the cache lines of the access; `line_bytes` is a power of two.
    pub fn lines(&self, line_bytes: u32) -> impl Iterator<Item = u64> + use<> {
        let line_bytes = u64::from(line_bytes.max(1));
        let last = self.address + u64::from(self.bytes.max(1)) - 1;
        (self.address / line_bytes..=last / line_bytes).map(move |line| line * line_bytes)
    }
}
