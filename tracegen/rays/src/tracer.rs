//! Whitted-style tracing of one tile: primary rays, shadows, reflection and refraction. Each ray
//! and its work are recorded when it is cast.

use super::bvh::count::Counts;
use super::bvh::{RayHit, TraversalStack};
use super::cast::{Cast, Caster, Query};
use super::light::{dielectric, reflect, refract, schlick};
use super::material::Surface;
use super::ray::{Ray, barycentrics, offset, point_at};
use super::sampling::Noise;
use super::scene::{Colouring, TraceScene};
use formats::raytrace::camera::sample_position_px;
use formats::raytrace::{
    EyeCamera, Hit, NO_PARENT, Outcome, PixelRecord, RayKind, RayLighting, RayRecord, RayTile,
    RayTriangle, TraversalKind, half, normal,
};
use glam::Vec3;

/// Rays that contribute less than this fraction of a pixel are not cast.
const LEAST_WEIGHT: f32 = 0.01;

/// Settings of tracing and recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceSettings {
    /// Levels of reflection and refraction.
    pub max_depth: u32,
    /// Samples per pixel.
    pub samples_per_px: u32,
    /// Record every visited node and triangle.
    pub visits: bool,
    /// Record origin, direction, limits, hit and stack depth of every ray.
    pub geometry: bool,
    /// Tree to traverse.
    pub traversal: TraversalKind,
    /// Light beyond Whitted's model.
    pub lighting: Option<RayLighting>,
    /// Seed of random numbers, which only lighting uses.
    pub seed: u64,
}

mod gather;

/// Radiance, split into parts that depend on the viewpoint and parts that do not.
#[derive(Clone, Copy, Debug, Default)]
struct Radiance {
    view_independent: Vec3,
    view_dependent: Vec3,
}

impl Radiance {
    fn total(&self) -> Vec3 {
        self.view_independent + self.view_dependent
    }
}

/// A ray to cast, with the state inherited from its ancestors.
#[derive(Clone, Copy)]
struct Path {
    ray: Ray,
    kind: RayKind,
    depth: u32,
    /// Reflections and refractions so far.
    levels: u32,
    /// Diffuse rays so far.
    bounces: u32,
    parent: u32,
    /// Largest fraction of the ray's radiance that reaches the pixel.
    weight: f32,
    /// Distance from the eye to the ray's origin, which sets the width of its footprint.
    length: f32,
}

impl Path {
    /// A ray from a point that this one hit.
    fn child(&self, place: &ShadedPoint, kind: RayKind, ray: Ray, weight: f32) -> Self {
        let is_diffuse = kind == RayKind::Diffuse;
        Self {
            ray,
            kind,
            depth: self.depth + 1,
            levels: self.levels + u32::from(!is_diffuse),
            bounces: self.bounces + u32::from(is_diffuse),
            parent: place.number,
            weight,
            length: place.length,
        }
    }
}

/// Traces tiles; one per thread.
pub struct Tracer<'a> {
    scene: &'a TraceScene,
    settings: TraceSettings,
    caster: Caster<'a>,
    /// Width of a pixel at distance 1.
    px_spread: f32,
    /// First ray of the current pixel.
    first_ray: usize,
    noise: Noise,
    /// Earlier eyes at the same position.
    twin: u32,
    /// Radius of point lights in metres and tangent of the angular radius of parallel ones, if any has
    /// a size.
    light_size: Option<[f32; 2]>,
}

impl<'a> Tracer<'a> {
    /// A tracer for one thread.
    pub fn new(scene: &'a TraceScene, settings: TraceSettings) -> Self {
        Self {
            scene,
            settings,
            caster: Caster {
                bvh: &scene.bvh,
                traversal: settings.traversal,
                visits: settings.visits,
                geometry: settings.geometry,
                stack: TraversalStack::default(),
            },
            px_spread: 0.0,
            first_ray: 0,
            noise: Noise::default(),
            twin: 0,
            light_size: settings.lighting.and_then(gather::light_size),
        }
    }

    /// The tracer of an eye: of `earlier` ones, those at the same position have their own noise.
    #[must_use]
    pub fn after(self, earlier: &[EyeCamera], eye: &EyeCamera) -> Self {
        let place = |eye: &EyeCamera| eye.position.map(f32::to_bits);
        let twins = earlier.iter().filter(|other| place(other) == place(eye));
        Self {
            twin: twins.count() as u32,
            ..self
        }
    }

    /// Traces the pixels of `out.origin_px` and `out.size_px` into `out`.
    pub fn tile(&mut self, eye: &EyeCamera, out: &mut RayTile) {
        let f = &eye.fov;
        self.px_spread = (f.up + f.down) / eye.size_px[1] as f32;
        let ([x0, y0], [width, height]) = (out.origin_px, out.size_px);
        for y in y0..y0 + height {
            for x in x0..x0 + width {
                for sample in 0..self.settings.samples_per_px {
                    let at = sample_position_px(x, y, sample, self.settings.samples_per_px);
                    if self.settings.lighting.is_some() {
                        self.noise = Noise::new(self.settings.seed, eye, self.twin, [x, y], sample);
                    }
                    let pixel = self.pixel(eye, at, out);
                    out.pixels.push(pixel);
                }
            }
        }
    }

    fn pixel(&mut self, eye: &EyeCamera, at_px: [f32; 2], out: &mut RayTile) -> PixelRecord {
        self.first_ray = out.rays.len();
        let direction = eye.direction(at_px);
        let path = Path {
            ray: Ray::new(eye.position.into(), direction.into()),
            kind: RayKind::Primary,
            depth: 0,
            levels: 0,
            bounces: 0,
            parent: NO_PARENT,
            weight: 1.0,
            length: 0.0,
        };
        let (found, _) = self.cast(&path, out);
        let (radiance, hit) = match found {
            None => {
                let sky = Radiance {
                    view_dependent: self.scene.sky.background(path.ray.direction),
                    ..Radiance::default()
                };
                (sky, None)
            }
            Some(found) => {
                let (radiance, shading_normal, uv) = self.shade(&path, &found, 0, out);
                let triangle = self.triangle(found.primitive);
                let code = normal::encode(shading_normal.to_array());
                let hit = Hit::new(eye, direction, found.t, &triangle, code, uv);
                (radiance, Some(hit))
            }
        };
        PixelRecord {
            hit,
            view_independent: half::round3(radiance.view_independent.to_array()),
            view_dependent: half::round3(radiance.view_dependent.to_array()),
            first_ray: self.first_ray as u32,
            ray_count: (out.rays.len() - self.first_ray) as u32,
        }
    }

    /// The table entry of a primitive.
    pub fn triangle(&self, primitive: u32) -> RayTriangle {
        triangle(self.scene, primitive)
    }

    /// Casts a closest-hit ray and records it. The number is its index among the pixel's rays.
    fn cast(&mut self, path: &Path, out: &mut RayTile) -> (Option<RayHit>, u32) {
        let number = (out.rays.len() - self.first_ray) as u32;
        let alpha = self.scene.stopping();
        let (visits, geometry) = (&mut out.visits, &mut out.geometry);
        let Cast { hit, counts, .. } =
            (self.caster).cast(Query::Closest, &path.ray, &alpha, visits, geometry);
        let outcome = if hit.is_some() {
            Outcome::Hit
        } else {
            Outcome::Miss
        };
        out.rays
            .push(record(path.kind, outcome, path.depth, path.parent, counts));
        (hit, number)
    }

    /// Casts a shadow or ambient-occlusion ray and records it. Returns the light that passes.
    fn cast_any(
        &mut self,
        kind: RayKind,
        ray: &Ray,
        depth: u32,
        parent: u32,
        out: &mut RayTile,
    ) -> Vec3 {
        let (visits, geometry) = (&mut out.visits, &mut out.geometry);
        let coloured = kind == RayKind::Shadow
            && (self.settings.lighting).is_some_and(|lighting| lighting.coloured_shadows);
        let (Cast { hit, counts, .. }, light) = if coloured {
            let alpha = Colouring::new(self.scene, ray.direction);
            let cast = (self.caster).cast(Query::Blocker, ray, &alpha, visits, geometry);
            (cast, alpha.light())
        } else {
            let alpha = self.scene.shading();
            let cast = (self.caster).cast(Query::Blocker, ray, &alpha, visits, geometry);
            (cast, Vec3::ONE)
        };
        let outcome = if hit.is_some() {
            Outcome::Occluded
        } else {
            Outcome::Miss
        };
        out.rays.push(record(kind, outcome, depth, parent, counts));
        if hit.is_some() { Vec3::ZERO } else { light }
    }

    /// Radiance of a secondary ray.
    fn follow(&mut self, path: &Path, out: &mut RayTile) -> Vec3 {
        match self.cast(path, out) {
            (None, _) => self.scene.sky.background(path.ray.direction),
            (Some(hit), number) => self.shade(path, &hit, number, out).0.total(),
        }
    }

    /// Returns the radiance that leaves a hit towards the ray's origin, the shading normal and the
    /// texture coordinates.
    fn shade(
        &mut self,
        path: &Path,
        hit: &RayHit,
        number: u32,
        out: &mut RayTile,
    ) -> (Radiance, Vec3, [f32; 2]) {
        let TraceScene {
            scene: source,
            soup,
            materials,
            ..
        } = self.scene;
        let bary = barycentrics(&path.ray, &hit.vertices);
        let at = soup.attributes(source, hit.primitive, bary);
        let direction = path.ray.direction;
        let front = at.geometric_normal.dot(direction) <= 0.0;
        let facing = if front { 1.0 } else { -1.0 };
        let geometric = at.geometric_normal * facing;
        let mut shading = facing_shading_normal(at.shading_normal, geometric);
        let length = path.length + hit.t;
        let mut cosine = (-direction.dot(shading)).clamp(0.0, 1.0);
        // The footprint lengthens as the surface turns away. The square root is a mean of its two
        // widths.
        let footprint = length * self.px_spread / cosine.max(0.1).sqrt();
        let material = soup.material(source, hit.primitive);
        let surface = materials.surface(material, &at, footprint);
        if (self.settings.lighting).is_some_and(|lighting| lighting.normal_maps) {
            let bent = materials.bent_normal(material, &at, footprint);
            let bent = if shading == at.shading_normal {
                bent
            } else {
                -bent
            };
            // A normal that points into the surface would hide it from every light.
            if bent.dot(geometric) > 0.0 {
                shading = bent;
                cosine = (-direction.dot(shading)).clamp(0.0, 1.0);
            }
        }
        let place = ShadedPoint {
            point: point_at(&hit.vertices, bary),
            geometric,
            shading,
            to_eye: -direction,
            cosine,
            length,
            number,
            surface,
        };

        let mut radiance = self.direct(path, &place, out);
        radiance.view_independent += surface.emissive + self.ambient(path, &place, out);
        radiance.view_dependent += self.reflection(path, &place, out);
        if surface.transmission > 0.0 {
            let passed = self.glass(path, &place, front, out);
            radiance.view_dependent += passed;
        }
        if surface.alpha < 1.0 {
            let behind = self.behind(path, &place, out);
            radiance.view_independent *= surface.alpha;
            radiance.view_dependent *= surface.alpha;
            radiance.view_dependent += behind * (1.0 - surface.alpha);
        }
        (radiance, shading, at.uv[0].to_array())
    }

    /// Reflection of an opaque surface: a ray if it is polished, or else the mean radiance of the
    /// sky.
    fn reflection(&mut self, path: &Path, place: &ShadedPoint, out: &mut RayTile) -> Vec3 {
        let surface = &place.surface;
        if surface.transmission > 0.0 {
            return Vec3::ZERO;
        }
        let fresnel = schlick(surface.specular, place.cosine);
        let strength = surface.mirror_tint * surface.mirror + fresnel * (1.0 - surface.mirror);
        let mirrored = reflect(-place.to_eye, place.shading);
        if !surface.polished {
            let rough = surface.specular * if surface.exponent > 0 { 1.0 } else { 0.5 };
            return rough * self.scene.sky.ambient(mirrored);
        }
        let weight = strength.max_element() * path.weight;
        strength * self.mirror_ray(path, place, mirrored, weight, out)
    }

    fn mirror_ray(
        &mut self,
        path: &Path,
        place: &ShadedPoint,
        mirrored: Vec3,
        weight: f32,
        out: &mut RayTile,
    ) -> Vec3 {
        if path.levels >= self.settings.max_depth || weight < LEAST_WEIGHT {
            return self.scene.sky.ambient(mirrored);
        }
        // With a shading normal, the mirrored ray can point into the surface. Then the geometric
        // normal is used.
        let direction = if mirrored.dot(place.geometric) > 0.0 {
            mirrored
        } else {
            reflect(-place.to_eye, place.geometric)
        };
        let ray = Ray::new(offset(place.point, place.geometric), direction);
        let next = path.child(place, RayKind::Reflection, ray, weight);
        self.follow(&next, out)
    }

    /// Glass: Fresnel's equations divide the light between a mirrored and a refracted ray.
    fn glass(&mut self, path: &Path, place: &ShadedPoint, front: bool, out: &mut RayTile) -> Vec3 {
        let surface = &place.surface;
        let eta = if front {
            1.0 / surface.ior
        } else {
            surface.ior
        };
        let refracted = refract(-place.to_eye, place.shading, eta);
        let reflectance = match refracted {
            Some(_) => dielectric(place.cosine, eta),
            None => 1.0,
        };
        let mirrored = reflect(-place.to_eye, place.shading);
        let weight = reflectance * path.weight;
        let mut light = Vec3::ZERO;
        if weight >= LEAST_WEIGHT {
            light += reflectance * self.mirror_ray(path, place, mirrored, weight, out);
        }
        if let Some(direction) = refracted {
            // The colour is applied once, on entry.
            let tint = if front { surface.tint } else { Vec3::ONE };
            let passing = tint * (surface.transmission * (1.0 - reflectance));
            light += passing * self.through(path, place, direction, passing.max_element(), out);
        }
        light
    }

    /// The radiance behind a blended surface: the ray continues straight.
    fn behind(&mut self, path: &Path, place: &ShadedPoint, out: &mut RayTile) -> Vec3 {
        let fraction = 1.0 - place.surface.alpha;
        self.through(path, place, -place.to_eye, fraction, out)
    }

    fn through(
        &mut self,
        path: &Path,
        place: &ShadedPoint,
        direction: Vec3,
        fraction: f32,
        out: &mut RayTile,
    ) -> Vec3 {
        let weight = fraction * path.weight;
        if path.levels >= self.settings.max_depth || weight < LEAST_WEIGHT {
            return self.scene.sky.ambient(direction);
        }
        let ray = Ray::new(offset(place.point, -place.geometric), direction);
        let next = path.child(place, RayKind::Refraction, ray, weight);
        self.follow(&next, out)
    }
}

/// A shaded point.
struct ShadedPoint {
    point: Vec3,
    /// Normals on the ray's side.
    geometric: Vec3,
    shading: Vec3,
    to_eye: Vec3,
    /// Cosine of the angle between shading normal and ray.
    cosine: f32,
    /// Distance travelled from the eye.
    length: f32,
    /// The ray's index among the pixel's rays.
    number: u32,
    surface: Surface,
}

/// The interpolated normal on the ray's side of the surface.
fn facing_shading_normal(shading: Vec3, geometric: Vec3) -> Vec3 {
    if shading.dot(geometric) < 0.0 {
        -shading
    } else {
        shading
    }
}

/// The table entry of a primitive.
pub fn triangle(scene: &TraceScene, primitive: u32) -> RayTriangle {
    RayTriangle {
        primitive,
        object: scene.soup.object(primitive),
        material: scene.soup.material(&scene.scene, primitive) as u32,
        vertices: scene.soup.triangle(&scene.scene, primitive),
    }
}

fn record(kind: RayKind, outcome: Outcome, depth: u32, parent: u32, counts: Counts) -> RayRecord {
    RayRecord {
        kind,
        outcome,
        depth: depth as u8,
        parent,
        steps: counts.steps,
        triangle_tests: counts.triangle_tests,
        alpha_tests: counts.alpha_tests,
    }
}
