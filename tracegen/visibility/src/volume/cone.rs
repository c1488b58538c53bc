//! Circular and oblique cones.

use super::ROUNDING;
use glam::{DVec3, Vec3, Vec4};

/// An affine function of world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Affine {
    pub gradient: DVec3,
    pub constant: f64,
}

impl Affine {
    /// `gradient . (p - origin)`.
    pub fn around(gradient: DVec3, origin: DVec3) -> Self {
        Self {
            gradient,
            constant: -gradient.dot(origin),
        }
    }

    pub fn at(&self, point: DVec3) -> f64 {
        self.gradient.dot(point) + self.constant
    }

    /// `self + scale * other`.
    pub fn plus(self, scale: f64, other: Self) -> Self {
        Self {
            gradient: self.gradient + scale * other.gradient,
            constant: self.constant + scale * other.constant,
        }
    }

    pub fn times(self, scale: f64) -> Self {
        Self {
            gradient: self.gradient * scale,
            constant: self.constant * scale,
        }
    }

    /// Largest possible sum of the magnitudes of its terms.
    fn magnitude(&self, extent: DVec3) -> f64 {
        self.gradient.abs().dot(extent) + self.constant.abs()
    }

    fn prepare(&self) -> PreparedAffine {
        PreparedAffine {
            gradient: self.gradient.as_vec3(),
            constant: self.constant as f32,
        }
    }
}

/// The points at which `(x, y)` is not longer than `radius`, which grows along the cone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    pub x: Affine,
    pub y: Affine,
    pub radius: Affine,
}

impl Cone {
    pub fn contains(&self, point: DVec3) -> bool {
        self.x.at(point).hypot(self.y.at(point)) <= self.radius.at(point)
    }

    pub fn prepare(&self, extent: DVec3) -> PreparedCone {
        let magnitude: f64 = [self.x, self.y, self.radius]
            .iter()
            .map(|affine| affine.magnitude(extent))
            .sum();
        PreparedCone {
            x: self.x.prepare(),
            y: self.y.prepare(),
            radius: self.radius.prepare(),
            // Counted twice, because the box's centre and half size are rounded, and then the sums with them.
            margin: (2.0 * ROUNDING * magnitude) as f32,
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct PreparedAffine {
    gradient: Vec3,
    constant: f32,
}

impl PreparedAffine {
    fn at(&self, [x, y, z]: [Vec4; 3]) -> Vec4 {
        let g = self.gradient;
        x * g.x + y * g.y + z * g.z + Vec4::splat(self.constant)
    }

    /// Largest change from a box's centre to its corners; the argument is half the box's size.
    fn reach(&self, [x, y, z]: [Vec4; 3]) -> Vec4 {
        let g = self.gradient.abs();
        x * g.x + y * g.y + z * g.z
    }
}

/// A cone in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedCone {
    x: PreparedAffine,
    y: PreparedAffine,
    radius: PreparedAffine,
    margin: f32,
}

impl PreparedCone {
    /// Bits of boxes that are separated from the cone by a plane, and of boxes completely inside.
    ///
    /// The plane touches the cone along the line nearest to the box's centre. For a sphere this is the test
    /// `rho <= z tan + r / cos`. It keeps a few large boxes near the cone's apex that are outside, but never
    /// rejects a box that is not.
    #[inline]
    pub fn test(&self, [low, high]: &[[Vec4; 3]; 2]) -> [u32; 2] {
        let half = Vec4::splat(0.5);
        let center = [0, 1, 2].map(|axis| (low[axis] + high[axis]) * half);
        let size = [0, 1, 2].map(|axis| (high[axis] - low[axis]) * half);
        let [x, y, radius] = [&self.x, &self.y, &self.radius].map(|affine| affine.at(center));
        let squared = x * x + y * y;
        let distance = Vec4::new(
            squared.x.sqrt(),
            squared.y.sqrt(),
            squared.z.sqrt(),
            squared.w.sqrt(),
        );
        // Without a direction, there is no plane that touches the cone.
        let away = distance.cmpgt(Vec4::splat(f32::MIN_POSITIVE));
        let cos = Vec4::select(away, x / distance, Vec4::ONE);
        let sin = Vec4::select(away, y / distance, Vec4::ZERO);
        let slope = |axis: usize| {
            let gradient = |affine: &PreparedAffine| Vec4::splat(affine.gradient[axis]);
            cos * gradient(&self.x) + sin * gradient(&self.y) - gradient(&self.radius)
        };
        let reach = slope(0).abs() * size[0] + slope(1).abs() * size[1] + slope(2).abs() * size[2];
        let height = cos * x + sin * y - radius;
        let outside = (height - reach).cmpgt(Vec4::splat(self.margin));
        let [x, y] = [x.abs() + self.x.reach(size), y.abs() + self.y.reach(size)];
        let room = radius - self.radius.reach(size) - Vec4::splat(self.margin);
        let inside = room.cmpgt(Vec4::ZERO) & (x * x + y * y).cmple(room * room);
        [outside.bitmask(), inside.bitmask()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::units;

    /// A cone along -z with its apex at the origin.
    fn cone(tangent: f64) -> Cone {
        Cone {
            x: Affine::around(DVec3::X, DVec3::ZERO),
            y: Affine::around(DVec3::Y, DVec3::ZERO),
            radius: Affine::around(DVec3::NEG_Z, DVec3::ZERO).times(tangent),
        }
    }

    fn test(tangent: f64, low: Vec3, high: Vec3) -> [bool; 2] {
        let corners = [low, high].map(|corner| corner.to_array().map(Vec4::splat));
        let prepared = cone(tangent).prepare(DVec3::splat(100.0));
        prepared.test(&corners).map(|bits| {
            assert!(bits == 0 || bits == 15, "the same box in all lanes");
            bits != 0
        })
    }

    #[test]
    fn boxes_outside_inside_and_across_are_distinguished() {
        let cube = |center: Vec3, half: f32| test(0.5, center - half, center + half);
        assert_eq!(cube(Vec3::new(0.0, 0.0, -10.0), 1.0), [false, true]);
        assert_eq!(cube(Vec3::new(5.0, 0.0, -10.0), 1.0), [false, false]);
        assert_eq!(cube(Vec3::new(8.0, 0.0, -10.0), 1.0), [true, false]);
        assert_eq!(cube(Vec3::new(0.0, 0.0, 10.0), 1.0), [true, false]);
        assert_eq!(cube(Vec3::ZERO, 1.0), [false, false]);
        assert_eq!(test(0.5, Vec3::NAN, Vec3::NAN), [false, false]);
    }

    /// Closed form: a sphere is kept if `rho <= z tan + r / cos`. A box must be rejected if its bounding
    /// sphere is, and kept if the largest sphere inside it is.
    #[test]
    fn boxes_are_classified_between_their_outer_and_inner_spheres() {
        let mut random = units(3);
        let (mut lost, mut kept) = (0, 0);
        for _ in 0..20_000 {
            let tangent = 0.1 + 2.0 * f64::from(random());
            let center = Vec3::new(random() - 0.5, random() - 0.5, -random()) * 40.0;
            let half = Vec3::new(random(), random(), random()) * 3.0;
            let cos = 1.0 / (1.0 + tangent * tangent).sqrt();
            let rho = f64::from(center.truncate().length());
            let sphere = f64::from(half.length()) / cos - f64::from(center.z) * tangent;
            // The largest sphere inside the box.
            let within = f64::from(half.min_element()) / cos - f64::from(center.z) * tangent;
            let [outside, _] = test(tangent, center - half, center + half);
            if rho > sphere + 1e-3 {
                assert!(outside, "{center} {half} {tangent}");
                lost += 1;
            }
            if rho < within - 1e-3 {
                assert!(!outside, "{center} {half} {tangent}");
                kept += 1;
            }
        }
        assert!(lost > 1000 && kept > 1000, "{lost} {kept}");
    }

    #[test]
    fn boxes_with_points_inside_and_outside_are_classified_correctly() {
        let mut random = units(9);
        let mut seen = [0; 2];
        for _ in 0..20_000 {
            let tangent = 0.05 + 3.0 * f64::from(random());
            let mut point = || Vec3::new(random() - 0.5, random() - 0.5, random() - 0.8) * 20.0;
            let (p, q) = (point(), point());
            let (low, high) = (p.min(q), p.max(q));
            let [outside, inside] = test(tangent, low, high);
            for _ in 0..8 {
                let t = Vec3::new(random(), random(), random());
                let within = cone(tangent).contains((low + t * (high - low)).as_dvec3());
                assert!(!(within && outside), "{low} {high} {tangent}");
                assert!(within || !inside, "{low} {high} {tangent}");
                seen[usize::from(within)] += 1;
            }
        }
        assert!(seen[0] > 1000 && seen[1] > 1000, "{seen:?}");
    }
}
