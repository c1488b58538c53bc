//! Lights and the laws of reflection and refraction.

use super::sampling::{across, disk};
use formats::raytrace::RayLight;
use glam::Vec3;

/// Light that reaches a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Distance to it, infinite for parallel light.
    pub distance: f32,
    /// Irradiance on a surface that faces it.
    pub irradiance: Vec3,
}

/// The light at a point, or `None` if the point coincides with the light.
pub fn incident(light: &RayLight, at: Vec3) -> Option<Incident> {
    match *light {
        RayLight::Directional { direction, color } => Some(Incident {
            direction: -Vec3::from(direction),
            distance: f32::MAX,
            irradiance: Vec3::from(color),
        }),
        RayLight::Point { position, color } => {
            let to = Vec3::from(position) - at;
            let distance = to.length();
            (distance > 0.0 && distance.is_finite()).then(|| Incident {
                direction: to / distance,
                distance,
                irradiance: Vec3::from(color) / (distance * distance).max(0.01),
            })
        }
    }
}

/// The light at a point from a random point of a light that has a size: a sphere of `radius_m`, of
/// which the disk that faces the point is sampled, or a sun of which `sun_tangent` is the tangent
/// of the angular radius.
pub(crate) fn incident_of_size(
    light: &RayLight,
    at: Vec3,
    radius_m: f32,
    sun_tangent: f32,
    point: [f32; 2],
) -> Option<Incident> {
    let centre = incident(light, at)?;
    let [right, up] = across(centre.direction);
    let [x, y] = disk(point);
    let aside = x * right + y * up;
    match *light {
        RayLight::Directional { .. } => Some(Incident {
            direction: (centre.direction + sun_tangent * aside).normalize(),
            ..centre
        }),
        RayLight::Point { position, color } => {
            let position = (Vec3::from(position) + radius_m * aside).to_array();
            incident(&RayLight::Point { position, color }, at)
        }
    }
}

/// Schlick's approximation of Fresnel reflectance.
pub fn schlick(normal_incidence: Vec3, cosine: f32) -> Vec3 {
    let f = (1.0 - cosine).clamp(0.0, 1.0);
    let f5 = f * f * f * f * f;
    normal_incidence + (Vec3::ONE - normal_incidence) * f5
}

/// Reflectance of a dielectric boundary for unpolarised light (Fresnel's equations). `eta` is the
/// ratio of the refractive indices, incident over transmitted.
pub fn dielectric(cosine: f32, eta: f32) -> f32 {
    let sine2 = eta * eta * (1.0 - cosine * cosine);
    if sine2 >= 1.0 {
        return 1.0;
    }
    let transmitted = (1.0 - sine2).sqrt();
    let perpendicular = (eta * cosine - transmitted) / (eta * cosine + transmitted);
    let parallel = (cosine - eta * transmitted) / (cosine + eta * transmitted);
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

/// Direction of the refracted ray (Snell's law); `None` at total internal reflection. The normal
/// faces the incident side.
pub fn refract(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cosine = -direction.dot(normal);
    let k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    (k > 0.0).then(|| (eta * direction + (eta * cosine - k.sqrt()) * normal).normalize())
}

/// Direction of the mirrored ray.
pub fn reflect(direction: Vec3, normal: Vec3) -> Vec3 {
    (direction - 2.0 * direction.dot(normal) * normal).normalize()
}

/// Blinn-Phong lobe times the cosine, normalised to reflect all light at normal incidence
/// (Giesen 2009).
pub fn blinn_phong(normal: Vec3, to_light: Vec3, to_eye: Vec3, exponent: u32) -> f32 {
    let n_l = normal.dot(to_light);
    let half = (to_light + to_eye).normalize_or_zero();
    let n_h = normal.dot(half);
    if n_l <= 0.0 || n_h <= 0.0 {
        return 0.0;
    }
    let n = exponent as f32;
    // 2^(-n/2), negligible for n >= 60.
    let tail = 0.5f32.powi(exponent.min(120) as i32).sqrt();
    let scale = (n + 2.0) * (n + 4.0) / (8.0 * std::f32::consts::PI * (tail + n));
    scale * n_h.powi(exponent as i32) * n_l
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_reflects_four_percent_at_normal_incidence_and_all_at_grazing() {
        assert!((dielectric(1.0, 1.0 / 1.5) - 0.04).abs() < 1e-6);
        assert!(dielectric(1e-4, 1.0 / 1.5) > 0.999);
        // From inside, beyond the critical angle of 41.8 degrees.
        assert_eq!(dielectric(45f32.to_radians().cos(), 1.5), 1.0);
    }

    #[test]
    fn refraction_obeys_snells_law_and_is_reversible() {
        let normal = Vec3::Y;
        let incoming = Vec3::new(0.6, -0.8, 0.0);
        let inside = refract(incoming, normal, 1.0 / 1.5).expect("refracts");
        assert!((inside.x * 1.5 - 0.6).abs() < 1e-6, "{inside}");
        let out = refract(inside, normal, 1.5).expect("refracts");
        assert!((out - incoming).length() < 1e-6, "{out}");
    }

    #[test]
    fn a_highlight_reflects_all_light_at_normal_incidence() {
        for exponent in [1, 6, 16, 64, 1024] {
            // Albedo of the lobe at normal incidence, by midpoint rule over the hemisphere.
            let steps = 400;
            let mut albedo = 0.0;
            for i in 0..steps {
                let theta = (i as f32 + 0.5) / steps as f32 * std::f32::consts::FRAC_PI_2;
                let out = Vec3::new(theta.sin(), theta.cos(), 0.0);
                let ring = std::f32::consts::TAU * theta.sin() * std::f32::consts::FRAC_PI_2
                    / steps as f32;
                albedo += blinn_phong(Vec3::Y, out, Vec3::Y, exponent) * ring;
            }
            assert!((albedo - 1.0).abs() < 0.01, "{exponent}: {albedo}");
        }
    }
}
