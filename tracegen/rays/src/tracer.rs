//! Whitted-style tracing of one tile: primary rays, shadows, reflection and refraction. Each ray
//! and its work are recorded when it is cast.

use super::bvh::count::Counts;
use super::bvh::{RayHit, TraversalStack};
use super::cast::{Cast, Caster, Query};
use super::light::{Incident, blinn_phong, dielectric, incident, reflect, refract, schlick};
use super::material::Surface;
use super::ray::{Ray, barycentrics, offset, point_at};
use super::scene::TraceScene;
use formats::raytrace::camera::sample_position_px;
use formats::raytrace::{
    EyeCamera, Hit, NO_PARENT, Outcome, PixelRecord, RayKind, RayRecord, RayTile, RayTriangle,
    TraversalKind, half, normal,
};
use glam::Vec3;

/// Rays that contribute less than this fraction of a pixel are not cast.
const LEAST_WEIGHT: f32 = 0.01;
/// Shadow rays for less than this radiance are not cast.
const LEAST_RADIANCE: f32 = 1.0 / 1024.0;

/// Settings of tracing and recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
}

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
    parent: u32,
    /// Largest fraction of the ray's radiance that reaches the pixel.
    weight: f32,
    /// Distance from the eye to the ray's origin, which sets the width of its footprint.
    length: f32,
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
}

impl<'a> Tracer<'a> {
    /// A tracer for one thread.
    #[must_use]
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
    #[must_use]
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

    /// Casts a shadow ray and records it. Returns true if the light is blocked.
    fn cast_shadow(&mut self, ray: &Ray, depth: u32, parent: u32, out: &mut RayTile) -> bool {
        let alpha = self.scene.shading();
        let (visits, geometry) = (&mut out.visits, &mut out.geometry);
        let Cast { hit, counts, .. } =
            (self.caster).cast(Query::Blocker, ray, &alpha, visits, geometry);
        let outcome = if hit.is_some() {
            Outcome::Occluded
        } else {
            Outcome::Miss
        };
        out.rays
            .push(record(RayKind::Shadow, outcome, depth, parent, counts));
        hit.is_some()
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
            sky,
            ..
        } = self.scene;
        let bary = barycentrics(&path.ray, &hit.vertices);
        let at = soup.attributes(source, hit.primitive, bary);
        let direction = path.ray.direction;
        let front = at.geometric_normal.dot(direction) <= 0.0;
        let facing = if front { 1.0 } else { -1.0 };
        let geometric = at.geometric_normal * facing;
        let shading = facing_shading_normal(at.shading_normal, geometric);
        let length = path.length + hit.t;
        let cosine = (-direction.dot(shading)).clamp(0.0, 1.0);
        // The footprint lengthens as the surface turns away. The square root is a mean of its two
        // widths.
        let footprint = length * self.px_spread / cosine.max(0.1).sqrt();
        let surface = materials.surface(soup.material(source, hit.primitive), &at, footprint);
        let place = ShadedPoint {
            point: point_at(&hit.vertices, bary),
            geometric,
            shading,
            to_eye: -direction,
            cosine,
            length,
            number,
        };

        let mut radiance = self.direct(path, &surface, &place, out);
        radiance.view_independent += surface.emissive + surface.albedo * sky.ambient(shading);
        radiance.view_dependent += self.reflection(path, &surface, &place, out);
        if surface.transmission > 0.0 {
            let passed = self.glass(path, &surface, &place, front, out);
            radiance.view_dependent += passed;
        }
        if surface.alpha < 1.0 {
            let behind = self.behind(path, &surface, &place, out);
            radiance.view_independent *= surface.alpha;
            radiance.view_dependent *= surface.alpha;
            radiance.view_dependent += behind * (1.0 - surface.alpha);
        }
        (radiance, shading, at.uv[0].to_array())
    }

    /// Light directly from the light sources, each tested with a shadow ray.
    fn direct(
        &mut self,
        path: &Path,
        surface: &Surface,
        place: &ShadedPoint,
        out: &mut RayTile,
    ) -> Radiance {
        let mut radiance = Radiance::default();
        let origin = offset(place.point, place.geometric);
        for light in &self.scene.lights {
            let Some(Incident {
                direction,
                distance,
                irradiance,
            }) = incident(light, place.point)
            else {
                continue;
            };
            let cosine = place.shading.dot(direction);
            if cosine <= 0.0 || place.geometric.dot(direction) <= 0.0 {
                continue;
            }
            let diffuse = surface.albedo * std::f32::consts::FRAC_1_PI * irradiance * cosine;
            let highlight = if surface.exponent > 0 {
                let lobe = blinn_phong(place.shading, direction, place.to_eye, surface.exponent);
                irradiance * schlick(surface.specular, place.cosine) * lobe
            } else {
                Vec3::ZERO
            };
            if (diffuse + highlight).max_element() * path.weight < LEAST_RADIANCE {
                continue;
            }
            let ray = Ray {
                t_max: distance,
                ..Ray::new(origin, direction)
            };
            if !self.cast_shadow(&ray, path.depth + 1, place.number, out) {
                radiance.view_independent += diffuse;
                radiance.view_dependent += highlight;
            }
        }
        radiance
    }

    /// Reflection of an opaque surface: a ray if it is polished, or else the mean radiance of the
    /// sky.
    fn reflection(
        &mut self,
        path: &Path,
        surface: &Surface,
        place: &ShadedPoint,
        out: &mut RayTile,
    ) -> Vec3 {
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
        if path.depth >= self.settings.max_depth || weight < LEAST_WEIGHT {
            return self.scene.sky.ambient(mirrored);
        }
        // With a shading normal, the mirrored ray can point into the surface. Then the geometric
        // normal is used.
        let direction = if mirrored.dot(place.geometric) > 0.0 {
            mirrored
        } else {
            reflect(-place.to_eye, place.geometric)
        };
        let next = Path {
            ray: Ray::new(offset(place.point, place.geometric), direction),
            kind: RayKind::Reflection,
            depth: path.depth + 1,
            parent: place.number,
            weight,
            length: place.length,
        };
        self.follow(&next, out)
    }

    /// Glass: Fresnel's equations divide the light between a mirrored and a refracted ray.
    fn glass(
        &mut self,
        path: &Path,
        surface: &Surface,
        place: &ShadedPoint,
        front: bool,
        out: &mut RayTile,
    ) -> Vec3 {
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
    fn behind(
        &mut self,
        path: &Path,
        surface: &Surface,
        place: &ShadedPoint,
        out: &mut RayTile,
    ) -> Vec3 {
        self.through(path, place, -place.to_eye, 1.0 - surface.alpha, out)
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
        if path.depth >= self.settings.max_depth || weight < LEAST_WEIGHT {
            return self.scene.sky.ambient(direction);
        }
        let next = Path {
            ray: Ray::new(offset(place.point, -place.geometric), direction),
            kind: RayKind::Refraction,
            depth: path.depth + 1,
            parent: place.number,
            weight,
            length: place.length,
        };
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
#[must_use]
pub fn triangle(scene: &TraceScene, primitive: u32) -> RayTriangle {
    RayTriangle {
        primitive,
        object: scene.soup.objects[primitive as usize],
        material: scene.soup.material(&scene.scene, primitive) as u32,
        vertices: scene.soup.triangles[primitive as usize],
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
