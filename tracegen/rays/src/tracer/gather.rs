//! Light that reaches a shaded point: from the lights, and from all around.

use super::{LEAST_WEIGHT, Path, Radiance, ShadedPoint, Tracer};
use crate::light::{Incident, blinn_phong, incident, incident_of_size, schlick};
use crate::ray::{Ray, offset};
use crate::sampling::{Purpose, cosine_direction};
use formats::raytrace::{RayKind, RayLight, RayLighting, RayTile};
use glam::Vec3;

/// Shadow rays for less than this radiance are not cast.
const LEAST_RADIANCE: f32 = 1.0 / 1024.0;

/// Radius of point lights in metres and tangent of the angular radius of parallel ones, if any has a
/// size.
pub(super) fn light_size(lighting: RayLighting) -> Option<[f32; 2]> {
    let tangent = f64::from(lighting.sun_radius_deg).to_radians().tan();
    let size = [lighting.light_radius_m, tangent as f32];
    (size != [0.0; 2]).then_some(size)
}

impl Tracer<'_> {
    /// Light directly from the light sources, each tested with a shadow ray.
    pub(super) fn direct(
        &mut self,
        path: &Path,
        place: &ShadedPoint,
        out: &mut RayTile,
    ) -> Radiance {
        let surface = &place.surface;
        let mut radiance = Radiance::default();
        let origin = offset(place.point, place.geometric);
        for (number, light) in (0u32..).zip(&self.scene.lights) {
            let Some(Incident {
                direction,
                distance,
                irradiance,
            }) = self.incident(number, light, place)
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
            let (kind, depth) = (RayKind::Shadow, path.depth + 1);
            let light = self.cast_any(kind, &ray, depth, place.number, out);
            radiance.view_independent += light * diffuse;
            radiance.view_dependent += light * highlight;
        }
        radiance
    }

    /// A light as a point sees it. The noise differs between lights and rays.
    fn incident(&self, number: u32, light: &RayLight, place: &ShadedPoint) -> Option<Incident> {
        match self.light_size {
            None => incident(light, place.point),
            Some([radius_m, tangent]) => {
                let point = self.noise.point(place.number, Purpose::Light(number), 0, 1);
                incident_of_size(light, place.point, radius_m, tangent, point)
            }
        }
    }

    /// Light from all around that a diffuse surface scatters: by a diffuse ray, by the sky as far as
    /// ambient-occlusion rays do not meet anything, or by the whole sky.
    pub(super) fn ambient(&mut self, path: &Path, place: &ShadedPoint, out: &mut RayTile) -> Vec3 {
        let surface = &place.surface;
        let sky = surface.albedo * self.scene.sky.ambient(place.shading);
        let lighting = self.settings.lighting.unwrap_or_default();
        let weight = surface.albedo.max_element() * path.weight;
        if lighting.bounces > 0 {
            if path.bounces >= lighting.bounces {
                return Vec3::ZERO;
            }
            if weight < LEAST_WEIGHT {
                return sky;
            }
            let point = self.noise.point(place.number, Purpose::Diffuse, 0, 1);
            let ray = self.scattered(place, point);
            let next = path.child(place, RayKind::Diffuse, ray, weight);
            return surface.albedo * self.follow(&next, out);
        }
        if lighting.occlusion_rays == 0 || path.depth > 0 || sky.max_element() <= 0.0 {
            return sky;
        }
        let (count, mut open) = (lighting.occlusion_rays, Vec3::ZERO);
        for index in 0..count {
            let point = self
                .noise
                .point(place.number, Purpose::Occlusion, index, count);
            let ray = Ray {
                t_max: lighting.occlusion_m,
                ..self.scattered(place, point)
            };
            open += self.cast_any(RayKind::AmbientOcclusion, &ray, 1, place.number, out);
        }
        sky * open / count as f32
    }

    /// A ray in a random direction of a surface's hemisphere.
    fn scattered(&self, place: &ShadedPoint, point: [f32; 2]) -> Ray {
        let direction = cosine_direction(place.shading, point);
        // Directions below the surface, which shading normals can give, are mirrored at it.
        let below = direction.dot(place.geometric).min(0.0);
        let direction = (direction - 2.0 * below * place.geometric).normalize();
        Ray::new(offset(place.point, place.geometric), direction)
    }
}
