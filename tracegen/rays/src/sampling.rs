//! Random points and directions that depend only on the seed, the pixel and the ray, so that a
//! trace is the same with any number of threads.

use formats::raytrace::EyeCamera;
use formats::raytrace::camera::{hash, r2_point};
use glam::Vec3;
use std::f64::consts::TAU;

/// Random numbers of a sample of a pixel.
///
/// The samples of a pixel, and the rays of a purpose, go through one low-discrepancy sequence
/// (Roberts's R2), shifted by a random vector that differs between pixels, eyes, rays and purposes
/// (Cranley and Patterson 1976).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Noise {
    pixel: u32,
    sample: u32,
}

/// What a random point is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// A point on the light of this number.
    Light(u32),
    /// An ambient-occlusion ray.
    Occlusion,
    /// A diffuse ray.
    Diffuse,
}

impl Purpose {
    fn number(self) -> u32 {
        match self {
            Self::Occlusion => 0,
            Self::Diffuse => 1,
            Self::Light(light) => light.wrapping_add(2),
        }
    }
}

impl Noise {
    /// Random numbers of a pixel. Both eyes have their own, because shared noise would look like a
    /// pane in front of the scene. Eyes differ by their position; `twin` is the number of earlier eyes at the
    /// same position.
    pub fn new(seed: u64, eye: &EyeCamera, twin: u32, [x, y]: [u32; 2], sample: u32) -> Self {
        let place = eye.position.map(f32::to_bits);
        let words = [
            seed as u32,
            (seed >> 32) as u32,
            place[0],
            place[1],
            place[2],
            x,
            y,
        ];
        Self {
            pixel: words
                .into_iter()
                .chain(Some(twin).filter(|twin| *twin > 0))
                .fold(0, |sum, word| hash(sum ^ word).wrapping_add(word)),
            sample,
        }
    }

    /// The point of number `index` of `count` that a sample takes for a ray and a purpose, in the unit
    /// square.
    pub fn point(&self, ray: u32, purpose: Purpose, index: u32, count: u32) -> [f32; 2] {
        let shift = hash(hash(self.pixel ^ ray.wrapping_mul(0x9E37_79B9)) ^ purpose.number());
        let number = self.sample.wrapping_mul(count).wrapping_add(index);
        r2_point(number, shift)
    }
}

/// A point of the unit disk, uniform by area.
pub(crate) fn disk([u, v]: [f32; 2]) -> [f32; 2] {
    // In f64, so that the results do not depend on the accuracy of a system's functions.
    let (sine, cosine) = (TAU * f64::from(v)).sin_cos();
    [u.sqrt() * cosine as f32, u.sqrt() * sine as f32]
}

/// Two unit vectors at right angles to a unit vector and to each other (Duff et al. 2017).
pub(crate) fn across(n: Vec3) -> [Vec3; 2] {
    let sign = 1f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vec3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

/// A direction of the hemisphere of a normal, with a density proportional to the cosine.
pub(crate) fn cosine_direction(normal: Vec3, point: [f32; 2]) -> Vec3 {
    let [x, y] = disk(point);
    let [right, up] = across(normal);
    let height = (1.0 - point[0]).max(0.0).sqrt();
    (x * right + y * up + height * normal).normalize_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_at_right_angles() {
        for n in [
            Vec3::Z,
            Vec3::NEG_Z,
            Vec3::X,
            Vec3::new(0.3, -0.5, -0.8).normalize(),
        ] {
            let [a, b] = across(n);
            for (x, y, dot) in [
                (a, a, 1.0),
                (b, b, 1.0),
                (a, b, 0.0),
                (a, n, 0.0),
                (b, n, 0.0),
            ] {
                assert!((x.dot(y) - dot).abs() < 1e-6, "{n}");
            }
        }
    }

    #[test]
    fn directions_have_the_moments_of_a_cosine_density() {
        let normal = Vec3::new(0.6, 0.0, -0.8);
        let eye = EyeCamera {
            position: [0.0; 3],
            right: [1.0, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            forward: [0.0, 0.0, -1.0],
            fov: formats::view::FovTangents::new(1.0, 1.0, 1.0, 1.0),
            size_px: [1, 1],
        };
        let count = 4096;
        let noise = Noise::new(7, &eye, 0, [3, 4], 0);
        let (mut mean, mut squares) = (0.0, 0.0);
        for index in 0..count {
            let point = noise.point(0, Purpose::Diffuse, index, count);
            let cosine = cosine_direction(normal, point).dot(normal);
            assert!(cosine >= 0.0);
            mean += f64::from(cosine) / f64::from(count);
            squares += f64::from(cosine * cosine) / f64::from(count);
        }
        assert!((mean - 2.0 / 3.0).abs() < 1e-3, "{mean}");
        assert!((squares - 0.5).abs() < 1e-3, "{squares}");
    }
}
