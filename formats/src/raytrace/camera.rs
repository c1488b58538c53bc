//! The camera of an eye of the ray tracer: pixel to ray and point to pixel.
//!
//! Both programs use these functions, so replay computes exactly the rays that were traced. Only IEEE 754
//! basic operations and square roots are used.

use crate::view::{EyeView, FovTangents};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A pinhole eye relative to the trace's origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EyeCamera {
    /// Position relative to the trace's origin, metres.
    pub position: [f32; 3],
    /// Unit vector to the right.
    pub right: [f32; 3],
    /// Unit vector up.
    pub up: [f32; 3],
    /// Unit vector along the view direction.
    pub forward: [f32; 3],
    /// Tangents of the half-angles.
    pub fov: FovTangents,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
}

impl EyeCamera {
    /// The camera of an eye's view, relative to `origin`.
    pub fn new(view: &EyeView, fov: FovTangents, size_px: [u32; 2], origin: [f64; 3]) -> Self {
        let [x, y, z, _] = view.world_to_eye;
        // A rotation's inverse is its transpose, so the rows of world-to-eye are the eye's axes.
        let axis = |row: usize| Vec3::new(x[row], y[row], z[row]).normalize_or_zero();
        let position = std::array::from_fn(|a| (f64::from(view.position[a]) - origin[a]) as f32);
        Self {
            position,
            right: axis(0).to_array(),
            up: axis(1).to_array(),
            forward: (-axis(2)).to_array(),
            fov,
            size_px,
        }
    }

    /// Unit direction of the ray through a point of the image, in pixels from the top left
    /// (the centre of the first pixel is 0.5, 0.5).
    pub fn direction(&self, point_px: [f32; 2]) -> [f32; 3] {
        let f = &self.fov;
        let u = point_px[0] / self.size_px[0] as f32;
        let v = point_px[1] / self.size_px[1] as f32;
        let x = u * (f.left + f.right) - f.left;
        let y = f.up - v * (f.up + f.down);
        let d = Vec3::from(self.forward) + Vec3::from(self.right) * x + Vec3::from(self.up) * y;
        (d / d.dot(d).sqrt()).to_array()
    }

    /// Image position of a point in pixels from the top left, and its depth along the view direction in
    /// metres. `None` for points behind the eye.
    pub fn project(&self, position: [f32; 3]) -> Option<([f32; 2], f32)> {
        let d = Vec3::from(position) - Vec3::from(self.position);
        let depth = d.dot(Vec3::from(self.forward));
        if depth <= 0.0 || depth.is_nan() {
            return None;
        }
        let f = &self.fov;
        let x = d.dot(Vec3::from(self.right)) / depth;
        let y = d.dot(Vec3::from(self.up)) / depth;
        let u = (x + f.left) / (f.left + f.right) * self.size_px[0] as f32;
        let v = (f.up - y) / (f.up + f.down) * self.size_px[1] as f32;
        Some(([u, v], depth))
    }

    /// The point at distance `t` metres from the eye along a direction.
    pub fn at(&self, direction: [f32; 3], t: f32) -> [f32; 3] {
        std::array::from_fn(|a| self.position[a] + t * direction[a])
    }
}

/// Image position of a sample of a pixel: the centre for a single sample, else points of the R2 sequence
/// shifted by a hash of the pixel (the same for both eyes).
pub fn sample_position_px(x: u32, y: u32, sample: u32, samples_per_px: u32) -> [f32; 2] {
    if samples_per_px <= 1 {
        return [x as f32 + 0.5, y as f32 + 0.5];
    }
    let [u, v] = r2_point(sample, hash(x.wrapping_mul(0x9E37_79B9) ^ hash(y)));
    [x as f32 + u, y as f32 + v]
}

/// A point of Roberts's low-discrepancy sequence R2 in the unit square, shifted by a random number.
pub fn r2_point(number: u32, shift: u32) -> [f32; 2] {
    // Fractions of 2^32. The sequence's generators are 1/g and 1/g^2 with g = 1.3247179572.
    let fraction = |generator: u32, shift: u32| {
        let bits = generator.wrapping_mul(number).wrapping_add(shift);
        (bits >> 8) as f32 / (1u32 << 24) as f32
    };
    [
        fraction(3_242_174_889, shift),
        fraction(2_447_445_414, hash(shift)),
    ]
}

/// Integer hash with full avalanche (Wellons' lowbias32).
pub fn hash(mut v: u32) -> u32 {
    v ^= v >> 16;
    v = v.wrapping_mul(0x7FEB_352D);
    v ^= v >> 15;
    v = v.wrapping_mul(0x846C_A68B);
    v ^ (v >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> EyeCamera {
        EyeCamera {
            position: [1.0, 2.0, 3.0],
            right: [1.0, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            forward: [0.0, 0.0, -1.0],
            fov: FovTangents::new(1.2, 0.9, 1.1, 1.0),
            size_px: [960, 1080],
        }
    }

    #[test]
    fn a_point_on_a_pixels_ray_projects_onto_the_pixel() {
        let eye = camera();
        for (x, y) in [(0u32, 0u32), (959, 1079), (17, 803), (480, 540)] {
            let at = sample_position_px(x, y, 0, 1);
            let p = eye.at(eye.direction(at), 7.5);
            let ([u, v], depth) = eye.project(p).expect("in front of the eye");
            assert!(
                (u - at[0]).abs() < 1e-3 && (v - at[1]).abs() < 1e-3,
                "{u} {v}"
            );
            assert!(depth > 0.0 && depth <= 7.5);
        }
    }

    #[test]
    fn a_point_behind_the_eye_is_not_visible() {
        assert_eq!(camera().project([1.0, 2.0, 4.0]), None);
    }

    #[test]
    fn samples_are_inside_their_pixel_and_differ() {
        let points: Vec<_> = (0..16).map(|s| sample_position_px(5, 9, s, 16)).collect();
        for (i, [x, y]) in points.iter().enumerate() {
            assert!((5.0..6.0).contains(x) && (9.0..10.0).contains(y));
            assert!(!points[..i].contains(&[*x, *y]));
        }
    }
}
