//! A ray, and the values that traversal precomputes from it: the shear of the watertight triangle
//! test and padded slabs (Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT
//! 2013).

use glam::{DVec3, Vec3, Vec3A, Vec3Swizzles};

/// A ray segment. `direction` need not have unit length, and `t` is in units of its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start.
    pub origin: Vec3,
    /// Direction, not zero.
    pub direction: Vec3,
    /// Minimum t of hits, exclusive.
    pub t_min: f32,
    /// Maximum t of hits, inclusive.
    pub t_max: f32,
}

impl Ray {
    /// A ray of unlimited length.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_min: 0.0,
            t_max: f32::MAX,
        }
    }

    /// False if a coordinate is not finite, the direction is zero, or the origin lies beyond
    /// [`LARGEST_COORDINATE`]. Such a ray hits nothing.
    #[inline]
    pub fn is_valid(&self) -> bool {
        // Not by the largest element, because that ignores NaN.
        self.origin
            .abs()
            .cmple(Vec3::splat(LARGEST_COORDINATE))
            .all()
            && self.direction.is_finite()
            && self.direction != Vec3::ZERO
            && self.t_max >= self.t_min
    }
}

/// Triangles and rays beyond this coordinate are left out, so that no slab distance overflows.
pub const LARGEST_COORDINATE: f32 = 1e18;

/// Relative error of the sheared coordinates, which a slab must cover (section 3.3 of the paper).
const SLAB_EPSILON: f32 = 5.0 / (1 << 24) as f32;

/// Smallest magnitude of a direction's component, so that no slab distance is NaN. Over a
/// kilometre, the ray deviates by 1e-15 m, far less than the slabs' padding.
const LEAST_DIRECTION: f32 = 1e-18;

/// A ray prepared for traversal.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay<'a> {
    /// The ray.
    pub ray: &'a Ray,
    /// Axes of the sheared space. The direction is longest along the last.
    pub axes: [usize; 3],
    /// Shear constants of the first two axes.
    pub shear: [f32; 2],
    /// 1 where the direction is negative along the axis.
    pub negative: [usize; 3],
    /// Reciprocal direction, rounded towards an earlier entry.
    pub near_reciprocal: Vec3A,
    /// Reciprocal direction, rounded towards a later exit.
    pub far_reciprocal: Vec3A,
    /// Minus the origin, shifted so that slabs start earlier, times the near reciprocal. The
    /// distance of a near plane is `plane * near_reciprocal + near_shift`.
    pub near_shift: Vec3A,
    /// Minus the origin, shifted so that slabs end later, times the far reciprocal.
    pub far_shift: Vec3A,
    /// By axis, how much slabs are padded.
    pub pad: Vec3A,
}

/// Axes of the sheared space, by the axis along which the direction is longest, and whether it is
/// negative there.
const SHEARED_AXES: [[[usize; 3]; 2]; 3] = [
    [[1, 2, 0], [2, 1, 0]],
    [[2, 0, 1], [0, 2, 1]],
    [[0, 1, 2], [1, 0, 2]],
];

/// The axis along which a direction is longest, by the outcomes of x > y, y > z and x > z (bits 0
/// to 2).
const LONGEST_AXIS: [u8; 8] = [2, 2, 1, 2, 2, 0, 1, 0];

impl<'a> PreparedRay<'a> {
    /// Prepares a valid ray for a scene with these bounds.
    #[inline(always)]
    pub fn new(ray: &'a Ray, bounds: (Vec3, Vec3)) -> Self {
        Self::with_pad(ray, bounds, Vec3A::ZERO)
    }

    /// [`Self::new`] with slabs that are padded by more.
    ///
    /// Vector operations without branches, because a short ray spends much of its time here.
    #[inline(always)]
    pub fn with_pad(ray: &'a Ray, bounds: (Vec3, Vec3), more: Vec3A) -> Self {
        let (origin, direction) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
        let size = direction.abs();
        let larger = size.xyx().cmpgt(size.yzz()).bitmask();
        let longest = usize::from(LONGEST_AXIS[larger as usize & 7]);
        let negative = direction.is_negative_bitmask() as usize;
        let axes = SHEARED_AXES[longest][negative >> longest & 1];
        let d: &[f32; 3] = ray.direction.as_ref();
        let pad = slab_pad(origin, longest, bounds) + more;
        let least = Vec3A::splat(LEAST_DIRECTION);
        let direction = Vec3A::select(size.cmplt(least), least.copysign(direction), direction);
        let reciprocal = 1.0 / direction;
        let toward = pad.copysign(direction);
        let near_reciprocal = reciprocal * (1.0 - 2.0 * f32::EPSILON);
        let far_reciprocal = reciprocal * (1.0 + 2.0 * f32::EPSILON);
        Self {
            ray,
            axes,
            shear: [d[axes[0]] / d[axes[2]], d[axes[1]] / d[axes[2]]],
            negative: [negative & 1, negative >> 1 & 1, negative >> 2 & 1],
            near_reciprocal,
            far_reciprocal,
            near_shift: -((origin + toward) * near_reciprocal),
            far_shift: -((origin - toward) * far_reciprocal),
            pad,
        }
    }

    /// The slabs' padding for a part of the scene with these bounds.
    #[inline(always)]
    pub fn pad_within(&self, bounds: (Vec3, Vec3)) -> Vec3A {
        slab_pad(self.ray.origin.into(), self.axes[2], bounds)
    }

    /// Distance to a box's near plane on this axis, rounded towards an earlier entry.
    #[inline(always)]
    pub fn near_distance(&self, axis: usize, plane: f32) -> f32 {
        plane.mul_add(self.near_reciprocal[axis], self.near_shift[axis])
    }

    /// Distance to a box's far plane on this axis, rounded towards a later exit.
    #[inline(always)]
    pub fn far_distance(&self, axis: usize, plane: f32) -> f32 {
        plane.mul_add(self.far_reciprocal[axis], self.far_shift[axis])
    }

    /// Entry and exit of a box along the whole line. Entry is later than exit if the line misses.
    ///
    /// Every operation is monotonic, so a box inside another never has an earlier entry or a later
    /// exit.
    #[inline(always)]
    pub fn slab(&self, min: [f32; 3], max: [f32; 3]) -> (f32, f32) {
        let mut near = f32::MIN;
        let mut far = f32::MAX;
        for axis in 0..3 {
            let (enter, leave) = if self.negative[axis] == 1 {
                (max[axis], min[axis])
            } else {
                (min[axis], max[axis])
            };
            near = near.max(self.near_distance(axis, enter));
            far = far.min(self.far_distance(axis, leave));
        }
        (near, far)
    }

    /// True if the line passes through the triangle, including its edges and vertices.
    ///
    /// Neighbours evaluate a shared edge with the same vertices and get the same sign, so no ray
    /// passes between them.
    #[inline]
    pub fn line_hits(&self, v: &[[f32; 3]; 3]) -> bool {
        let [a, b, c] = self.sheared(v);
        let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
        if u == 0.0 || v == 0.0 || w == 0.0 {
            return line_hits_sheared_f64(a, b, c);
        }
        (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0)
    }

    /// True if the line would pass through the triangle after moving each sheared vertex by at
    /// most so much.
    #[inline]
    pub fn line_nears(&self, v: &[[f32; 3]; 3], sheared_pad: f32) -> bool {
        let [a, b, c] = self.sheared(v);
        let size = [a, b, c]
            .as_flattened()
            .iter()
            .fold(0.0, |size: f32, x| size.max(x.abs()));
        let margin = near_margin(size, sheared_pad);
        let edges = [edge(c, b), edge(a, c), edge(b, a)];
        edges.iter().all(|e| *e >= -margin) || edges.iter().all(|e| *e <= margin)
    }

    /// The vertices in the sheared space, in which the ray goes along the last axis.
    #[inline]
    fn sheared(&self, v: &[[f32; 3]; 3]) -> [[f32; 2]; 3] {
        let [kx, ky, kz] = self.axes;
        let [sx, sy] = self.shear;
        let o = self.ray.origin.to_array();
        let sheared = |p: &[f32; 3]| {
            let z = p[kz] - o[kz];
            [(p[kx] - o[kx]) - sx * z, (p[ky] - o[ky]) - sy * z]
        };
        [sheared(&v[0]), sheared(&v[1]), sheared(&v[2])]
    }

    /// Distance to a triangle whose line test passed, or `None` if it is outside the segment.
    #[inline(always)]
    pub fn distance(&self, v: &[[f32; 3]; 3]) -> Option<f32> {
        let (near, far) = self.triangle_slab(v);
        if near > far {
            return None;
        }
        let t = self.distance_within(v, near, far)?;
        (t > self.ray.t_min && t <= self.ray.t_max).then_some(t)
    }

    /// Entry and exit of a triangle's box.
    #[inline(always)]
    pub fn triangle_slab(&self, v: &[[f32; 3]; 3]) -> (f32, f32) {
        let min = |a: usize| v[0][a].min(v[1][a]).min(v[2][a]);
        let max = |a: usize| v[0][a].max(v[1][a]).max(v[2][a]);
        self.slab([min(0), min(1), min(2)], [max(0), max(1), max(2)])
    }

    /// Distance to the plane of a triangle, clamped to its slabs `near` and `far`.
    ///
    /// The plane equation in `f64` is exact to within rounding, whereas the error of the sheared z
    /// in the 2013 paper exceeds 1e-4 for some rays. Because the result is clamped to the
    /// triangle's own slabs, no enclosing box can start behind it, so every traversal order and
    /// tree finds the same nearest triangle, bit for bit.
    #[inline(always)]
    pub fn distance_within(&self, v: &[[f32; 3]; 3], near: f32, far: f32) -> Option<f32> {
        let [v0, v1, v2] = [to_f64(v[0]), to_f64(v[1]), to_f64(v[2])];
        let normal = (v1 - v0).cross(v2 - v0);
        let slope = normal.dot(self.ray.direction.as_dvec3());
        let t = normal.dot(v0 - self.ray.origin.as_dvec3()) / slope;
        t.is_finite().then(|| (t as f32).clamp(near, far))
    }
}

/// By axis, the padding of slabs for triangles within bounds, for a direction that is longest along
/// an axis.
#[inline(always)]
fn slab_pad(origin: Vec3A, longest: usize, bounds: (Vec3, Vec3)) -> Vec3A {
    let reach = (origin - Vec3A::from(bounds.0))
        .abs()
        .max((origin - Vec3A::from(bounds.1)).abs());
    let reach_z = reach.to_array()[longest];
    // Twice the paper's bound, plus the rounding of the shifted origin and its product.
    2.0 * SLAB_EPSILON * (reach + reach_z) + 2.0 * f32::EPSILON * origin.abs()
}

/// An edge function of the sheared space.
#[inline]
fn edge(p: [f32; 2], q: [f32; 2]) -> f32 {
    p[0] * q[1] - p[1] * q[0]
}

/// Bound of an edge function's change if coordinates of at most `size` move by `pad`, and of its
/// rounding.
#[inline]
pub fn near_margin(size: f32, pad: f32) -> f32 {
    4.0 * (size + pad) * (pad + f32::EPSILON * size)
}

fn to_f64(p: [f32; 3]) -> DVec3 {
    DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))
}

/// The edge test if an edge function is zero in `f32`. Products of two `f32` are exact in `f64`, so
/// each sign is that of the exact difference.
#[cold]
pub fn line_hits_sheared_f64(a: [f32; 2], b: [f32; 2], c: [f32; 2]) -> bool {
    let edge = |p: [f32; 2], q: [f32; 2]| {
        f64::from(p[0]) * f64::from(q[1]) - f64::from(p[1]) * f64::from(q[0])
    };
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    let outside = (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0);
    !outside && u + v + w != 0.0
}

/// Weights of the second and third vertex at the point where a line meets a triangle, within 0..1.
pub fn barycentrics(ray: &Ray, v: &[[f32; 3]; 3]) -> [f32; 2] {
    let o = ray.origin.as_dvec3();
    let d = ray.direction.as_dvec3();
    let [a, b, c] = [to_f64(v[0]) - o, to_f64(v[1]) - o, to_f64(v[2]) - o];
    let (wa, wb, wc) = (d.dot(c.cross(b)), d.dot(a.cross(c)), d.dot(b.cross(a)));
    let sum = wa + wb + wc;
    if sum == 0.0 {
        return [0.0; 2];
    }
    [
        (wb / sum).clamp(0.0, 1.0) as f32,
        (wc / sum).clamp(0.0, 1.0) as f32,
    ]
}

/// A point on a triangle, given by weights, accurate to the rounding of the vertices.
pub fn point_at(v: &[[f32; 3]; 3], bary: [f32; 2]) -> Vec3 {
    let [v0, v1, v2] = [to_f64(v[0]), to_f64(v[1]), to_f64(v[2])];
    let (b, c) = (f64::from(bary[0]), f64::from(bary[1]));
    (v0 + (v1 - v0) * b + (v2 - v0) * c).as_vec3()
}

/// Offsets a point from its surface along the normal by a few units in the last place (Waechter and
/// Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems 2019). The
/// offset just exceeds the rounding error of the point at any distance from the origin.
pub fn offset(point: Vec3, normal: Vec3) -> Vec3 {
    const NEAR_ORIGIN: f32 = 1.0 / 32.0;
    const FLOAT_SCALE: f32 = 1.0 / 65536.0;
    const INT_SCALE: f32 = 256.0;
    let moved = |p: f32, n: f32| {
        if p.abs() < NEAR_ORIGIN {
            return p + FLOAT_SCALE * n;
        }
        let ulps = (INT_SCALE * n) as i32;
        let ulps = if p < 0.0 { -ulps } else { ulps };
        f32::from_bits((p.to_bits() as i32).wrapping_add(ulps) as u32)
    };
    Vec3::new(
        moved(point.x, normal.x),
        moved(point.y, normal.y),
        moved(point.z, normal.z),
    )
}

/// The traversal's answer without a tree: every triangle is tested with the traversal's own tests.
pub fn brute_force_f32(
    triangles: &[[[f32; 3]; 3]],
    bounds: (Vec3, Vec3),
    ray: &Ray,
) -> Option<(f32, u32)> {
    let prepared = PreparedRay::new(ray, bounds);
    triangles
        .iter()
        .zip(0u32..)
        .filter(|(v, _)| prepared.line_hits(v))
        .filter_map(|(v, i)| prepared.distance(v).map(|t| (t, i)))
        .reduce(|a, b| if b < a { b } else { a })
}
