//! Predicts the geometry of a ray from its parent, its siblings and the rays before it in the tile.
//!
//! FORMAT.md defines the predictions. All arithmetic is IEEE 754 basic operations and square roots in `f64`,
//! rounded to `f32` at the end, so that every reader computes the same values.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::camera::sample_position_px;
use super::geometry::RayGeometry;
use super::{EyeCamera, PixelRecord, RayKind, RayLight, RayRecord, RayTile, RaytraceTables};

/// Values of the last ray of a kind.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfKind {
    /// Bits of the last difference between a first child's origin and the point of its parent.
    pub offset: [u32; 3],
    /// Last direction.
    pub direction: [f32; 3],
    /// Last minimum distance.
    pub t_min: f32,
    /// Last maximum distance that no light predicted.
    pub t_max: f32,
    /// Last distance of a hit.
    pub t: f32,
    /// Last slot.
    pub slot: u32,
}

impl Default for OfKind {
    fn default() -> Self {
        Self {
            offset: [0; 3],
            direction: [0.0; 3],
            t_min: 0.0,
            t_max: f32::MAX,
            t: 0.0,
            slot: 0,
        }
    }
}

/// What a ray's children need to know about it.
#[derive(Clone, Copy, Debug, Default)]
struct Family {
    geometry: RayGeometry,
    /// Origin of the last child on the ray's side of the surface, and of the last refraction ray.
    origins: [Option<[f32; 3]>; 2],
    /// Light that the next shadow ray is expected to go to.
    next_light: u32,
}

/// The ray to predict.
#[derive(Clone, Copy, Debug)]
pub(super) struct Subject<'a> {
    pub record: &'a RayRecord,
    pub pixel: &'a PixelRecord,
    /// Number of the sample in the tile.
    pub sample: u32,
}

/// A predicted origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    pub value: [f32; 3],
    /// Bits by which the stored value is expected to differ from `value`.
    pub offset: [u32; 3],
    /// Whether the difference is kept for the next first child.
    pub keeps_offset: bool,
}

/// State of predictions within a tile.
#[derive(Debug)]
pub(super) struct Predictor<'a> {
    lights: &'a [RayLight],
    eye: &'a EyeCamera,
    samples_per_px: u32,
    origin_px: [u32; 2],
    width_px: u32,
    kinds: [OfKind; 6],
    /// Rays of the current sample.
    families: Vec<Family>,
}

impl<'a> Predictor<'a> {
    pub fn new(tables: &'a RaytraceTables, eye: &'a EyeCamera, tile: &RayTile) -> Self {
        Self {
            lights: &tables.lights,
            eye,
            samples_per_px: tables.meta.samples_per_px.max(1),
            origin_px: tile.origin_px,
            width_px: tile.size_px[0].max(1),
            kinds: [OfKind::default(); 6],
            families: Vec::new(),
        }
    }

    /// Begins the rays of a sample.
    pub fn begin_sample(&mut self) {
        self.families.clear();
    }

    /// The last values of a kind.
    #[allow(clippy::indexing_slicing, reason = "six kinds")]
    pub fn of_kind(&mut self, kind: RayKind) -> &mut OfKind {
        &mut self.kinds[kind as usize]
    }

    fn parent(&self, record: &RayRecord) -> Family {
        let parent = self.families.get(record.parent as usize);
        parent.copied().unwrap_or_default()
    }

    pub fn origin(&mut self, subject: &Subject<'_>) -> Origin {
        let record = subject.record;
        let known = |value| Origin {
            value,
            offset: [0; 3],
            keeps_offset: false,
        };
        if record.kind == RayKind::Primary {
            return known(self.eye.position);
        }
        let parent = self.parent(record);
        let [reflected, refracted] = parent.origins;
        let sibling = match record.kind {
            RayKind::Refraction => refracted,
            _ => reflected,
        };
        if let Some(origin) = sibling {
            return known(origin);
        }
        let RayGeometry {
            origin,
            direction,
            hit,
            ..
        } = parent.geometry;
        let t = f64::from(hit.map_or(0.0, |hit| hit.t));
        let offset = self.of_kind(record.kind).offset;
        Origin {
            value: zip3(origin, direction, |o, d| narrow(o + t * d)),
            offset,
            keeps_offset: true,
        }
    }

    /// The light to which a shadow ray is expected to go; 0 for other rays.
    pub fn light(&self, record: &RayRecord) -> u32 {
        if record.kind != RayKind::Shadow {
            return 0;
        }
        let next = self.parent(record).next_light;
        if (next as usize) < self.lights.len() {
            next
        } else {
            0
        }
    }

    /// Number of lights.
    pub fn lights(&self) -> usize {
        self.lights.len()
    }

    /// Direction and maximum distance of a ray from `origin`; a shadow ray goes to `light`.
    pub fn direction(
        &mut self,
        subject: &Subject<'_>,
        origin: [f32; 3],
        light: u32,
    ) -> ([f32; 3], Option<f32>) {
        let record = subject.record;
        let last = self.of_kind(record.kind).direction;
        match record.kind {
            RayKind::Primary => (self.primary_direction(subject.sample), None),
            RayKind::Shadow => match self.lights.get(light as usize) {
                Some(RayLight::Directional { direction, .. }) => (direction.map(|d| -d), None),
                Some(RayLight::Point { position, .. }) => {
                    let (direction, distance) = towards(origin, *position);
                    (direction, Some(distance))
                }
                None => (last, None),
            },
            RayKind::Reflection => match subject.pixel.hit {
                Some(hit) if record.parent == 0 => {
                    let parent = self.parent(record).geometry.direction;
                    (mirrored(parent, hit.shading_normal), None)
                }
                _ => (last, None),
            },
            RayKind::Refraction => (self.parent(record).geometry.direction, None),
            RayKind::AmbientOcclusion | RayKind::Diffuse => (last, None),
        }
    }

    fn primary_direction(&self, sample: u32) -> [f32; 3] {
        let at = sample / self.samples_per_px;
        let x = self.origin_px[0] + at % self.width_px;
        let y = self.origin_px[1] + at / self.width_px;
        let number = sample % self.samples_per_px;
        let point = sample_position_px(x, y, number, self.samples_per_px);
        self.eye.direction(point)
    }

    /// The distance at which a ray is expected to hit.
    pub fn distance(&mut self, subject: &Subject<'_>) -> f32 {
        match subject.record.kind {
            RayKind::Primary => subject.pixel.hit.map_or(0.0, |hit| hit.t),
            kind => self.of_kind(kind).t,
        }
    }

    /// Records a ray, after its values of the kind were updated.
    pub fn push(&mut self, record: &RayRecord, geometry: &RayGeometry, light: u32) {
        let side = usize::from(record.kind == RayKind::Refraction);
        if let Some(parent) = self.families.get_mut(record.parent as usize) {
            if let Some(origin) = parent.origins.get_mut(side) {
                *origin = Some(geometry.origin);
            }
            if record.kind == RayKind::Shadow {
                parent.next_light = light.saturating_add(1);
            }
        }
        self.families.push(Family {
            geometry: *geometry,
            ..Family::default()
        });
    }
}

#[allow(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
fn narrow(value: f64) -> f32 {
    value as f32
}

fn zip3(a: [f32; 3], b: [f32; 3], with: impl Fn(f64, f64) -> f32) -> [f32; 3] {
    let [ax, ay, az] = a.map(f64::from);
    let [bx, by, bz] = b.map(f64::from);
    [with(ax, bx), with(ay, by), with(az, bz)]
}

/// Product of two vectors, summed from left to right.
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    let ([ax, ay, az], [bx, by, bz]) = (a, b);
    ax * bx + ay * by + az * bz
}

/// Unit direction and distance from a point to another one; a zero direction between equal points.
fn towards(from: [f32; 3], to: [f32; 3]) -> ([f32; 3], f32) {
    let ([fx, fy, fz], [tx, ty, tz]) = (from.map(f64::from), to.map(f64::from));
    let way = [tx - fx, ty - fy, tz - fz];
    let distance = dot(way, way).sqrt();
    if distance == 0.0 {
        return ([0.0; 3], 0.0);
    }
    (way.map(|w| narrow(w / distance)), narrow(distance))
}

/// A direction mirrored at a normal, of unit length; zero where it has no length.
fn mirrored(direction: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    let (d, n) = (direction.map(f64::from), normal.map(f64::from));
    let twice = 2.0 * dot(d, n);
    let ([dx, dy, dz], [nx, ny, nz]) = (d, n);
    let r = [dx - twice * nx, dy - twice * ny, dz - twice * nz];
    let length = dot(r, r).sqrt();
    if length == 0.0 {
        return [0.0; 3];
    }
    r.map(|x| narrow(x / length))
}
