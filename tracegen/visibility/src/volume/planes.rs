//! Half-spaces, and the frustum of a clip matrix as six of them.

use super::ROUNDING;
use glam::{DMat4, DVec3, Mat4, Vec3, Vec4};

/// The points with `normal . p + offset >= 0`. The normal has unit length, or is zero if the half-space is
/// all of space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HalfSpace {
    pub normal: DVec3,
    /// Offset in metres.
    pub offset: f64,
}

impl HalfSpace {
    /// All of space.
    pub const EVERYWHERE: Self = Self {
        normal: DVec3::ZERO,
        offset: 1.0,
    };

    /// The smallest half-space with this normal that contains all `points`.
    pub fn around(normal: DVec3, points: impl Iterator<Item = DVec3>) -> Self {
        let lowest = points.map(|p| normal.dot(p)).fold(f64::INFINITY, f64::min);
        Self::scaled(normal, -lowest, 0.0)
    }

    /// A half-space from a plane of any scale, moved outwards by `margin` in that scale.
    pub fn scaled(normal: DVec3, offset: f64, margin: f64) -> Self {
        let length = normal.length();
        let plane = Self {
            normal: normal / length,
            offset: (offset + margin) / length,
        };
        if plane.normal.is_finite() && plane.offset.is_finite() {
            plane
        } else {
            Self::EVERYWHERE
        }
    }

    /// Distance of a point from the plane in metres, positive inside.
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) + self.offset
    }

    pub fn prepare(&self, extent: DVec3) -> PreparedPlane {
        let margin = ROUNDING * (self.normal.abs().dot(extent) + self.offset.abs());
        PreparedPlane {
            normal: self.normal.as_vec3(),
            offset: self.offset as f32,
            margin: margin as f32,
            highest: self.normal.to_array().map(|n| usize::from(n >= 0.0)),
        }
    }
}

/// The intersection of three planes, infinite or NaN if there is none.
pub(crate) fn meeting_point(planes: [HalfSpace; 3]) -> DVec3 {
    let [a, b, c] = planes.map(|plane| plane.normal);
    let [bc, ca, ab] = [b.cross(c), c.cross(a), a.cross(b)];
    -(bc * planes[0].offset + ca * planes[1].offset + ab * planes[2].offset) / a.dot(bc)
}

/// Left, right, bottom, top, near and far planes of the space that a driver may draw with a clip matrix
/// (depth 1 at the near plane to 0 at the far one), for geometry whose coordinates are at most `extent` (Gribb and Hartmann 2001).
///
/// A driver computes each clip coordinate in single precision and compares two of them. Each plane is moved
/// outwards by the rounding errors of both. This is relevant for the far plane, whose two coordinates almost
/// cancel.
pub(crate) fn frustum(clip_from_world: Mat4, extent: DVec3) -> [HalfSpace; 6] {
    let matrix: DMat4 = clip_from_world.as_dmat4();
    let row = |i: usize| matrix.row(i);
    let side = |i: usize, sign: f64| {
        let (own, w) = (row(i), row(3));
        let plane = if i == 2 && sign > 0.0 {
            own
        } else {
            w + own * sign
        };
        let terms = own.abs() + w.abs();
        let margin = ROUNDING * (terms.truncate().dot(extent) + terms.w);
        HalfSpace::scaled(plane.truncate(), plane.w, margin)
    };
    [
        side(0, 1.0),
        side(0, -1.0),
        side(1, 1.0),
        side(1, -1.0),
        side(2, -1.0),
        side(2, 1.0),
    ]
}

/// A half-space in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedPlane {
    normal: Vec3,
    offset: f32,
    margin: f32,
    /// The corner of a box that is highest above the plane: low or high, by axis.
    highest: [usize; 3],
}

impl PreparedPlane {
    /// Bits of the boxes completely outside, and of those completely inside.
    #[inline]
    pub fn test(&self, corners: &[[Vec4; 3]; 2]) -> [u32; 2] {
        let height = |x: Vec4, y: Vec4, z: Vec4| {
            x * self.normal.x + y * self.normal.y + z * self.normal.z + Vec4::splat(self.offset)
        };
        let [x, y, z] = self.highest;
        let highest = height(corners[x][0], corners[y][1], corners[z][2]);
        let lowest = height(corners[1 - x][0], corners[1 - y][1], corners[1 - z][2]);
        // Comparisons with NaN are false, so such a box is neither outside nor inside.
        [
            highest.cmplt(Vec4::splat(-self.margin)).bitmask(),
            lowest.cmpge(Vec4::splat(self.margin)).bitmask(),
        ]
    }
}
