//! Look-ups of shadow maps: the cascade and the coordinates of a fragment, from its world position and normal.

use super::geometry::{Coordinates, Geometry, SLIVER_PX};
use super::piece::Piece;
use super::vertex_error::UNIT;
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4, Mat3, Mat4};
use raster::cascades::Cascade;

/// Edge of a cascade, texels.
const SIZE: f64 = 2048.0;
/// Distance from the surface at which shadows are looked up, texels.
const OFFSET_TEXELS: f64 = 1.6;
/// Border of a cascade without look-ups, texels.
const BORDER_TEXELS: f64 = 2.0;
/// Roundings of a transformed vertex or point.
const ROUNDINGS: f64 = 8.0;
/// Error of texels and depth that always has to be expected.
const SMALL: DVec3 = DVec3::new(1.0 / 64.0, 1.0 / 64.0, 1e-6);

/// The shadow maps of a frame, nearest cascade first.
pub struct Shadows {
    /// World to texels (y down) and depth, and the edge of a texel in metres.
    cascades: Vec<(DMat4, f64)>,
}

/// Whether a point is in a cascade.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Inside,
    /// Rounding decides.
    Border,
    Outside,
}

impl Shadows {
    /// Of a frame's cascades.
    pub fn new(cascades: &[Cascade]) -> Self {
        let half = DVec3::new(SIZE / 2.0, -SIZE / 2.0, 1.0);
        let start = DVec3::new(SIZE / 2.0, SIZE / 2.0, 0.0);
        let texels_from_clip = DMat4::from_translation(start) * DMat4::from_scale(half);
        let map = |c: &Cascade| {
            (
                texels_from_clip * c.clip_from_world.as_dmat4(),
                f64::from(c.texel_m),
            )
        };
        Self {
            cascades: cascades.iter().map(map).collect(),
        }
    }

    /// Number of cascades.
    pub fn count(&self) -> usize {
        self.cascades.len()
    }

    /// Look-ups of a piece's fragments.
    pub(super) fn on<'a>(&'a self, geometry: &'a Geometry<'_>, piece: &'a Piece) -> Receiver<'a> {
        let call = geometry.call(piece);
        let world = Mat4::from(call.transform).as_dmat4();
        let matrix = Mat3::from(call.transform.matrix3);
        let normal = if matrix.inverse().is_finite() {
            matrix.as_dmat3().inverse().transpose()
        } else {
            matrix.as_dmat3()
        };
        let [positions, normals] = geometry.vertices(piece);
        let terms = |m: DMat3, v: DVec3| {
            m.x_axis.abs() * v.x.abs() + m.y_axis.abs() * v.y.abs() + m.z_axis.abs() * v.z.abs()
        };
        let largest = |of: [DVec3; 3]| of[0].max(of[1]).max(of[2]);
        let start = world.w_axis.truncate().abs();
        let world_error = largest(positions.map(|p| terms(DMat3::from_mat4(world), p) + start));
        let normal_error = largest(normals.map(|n| terms(normal, n)));
        Receiver {
            shadows: self,
            geometry,
            piece,
            positions: positions.map(|p| world.transform_point3(p)),
            normals: normals.map(|n| normal * n),
            errors: [world_error, normal_error].map(|terms| ROUNDINGS * UNIT * terms),
            front: piece.counter_clockwise != call.mirrored,
        }
    }
}

/// The look-ups of a piece's fragments.
#[derive(Clone, Copy)]
pub(super) struct Receiver<'a> {
    shadows: &'a Shadows,
    geometry: &'a Geometry<'a>,
    piece: &'a Piece,
    /// Of the vertices, in the world.
    positions: [DVec3; 3],
    normals: [DVec3; 3],
    /// Errors of both.
    errors: [DVec3; 2],
    front: bool,
}

impl Receiver<'_> {
    /// The look-ups, and those of the other face if rounding may turn the piece over.
    pub fn faces(self) -> impl Iterator<Item = Self> {
        let turns = self.piece.height_px() <= SLIVER_PX;
        let other = Self {
            front: !self.front,
            ..self
        };
        std::iter::once(self).chain(turns.then_some(other))
    }

    fn interpolated(&self, values: &[DVec3; 3], p: DVec2) -> DVec3 {
        let over_w = self.piece.weights_over_w(p);
        let [a, b, c] = values;
        (*a * over_w.x + *b * over_w.y + *c * over_w.z) / over_w.element_sum()
    }

    /// Texels and depth in a cascade of a point of the screen.
    fn place(&self, cascade: usize, p: DVec2) -> DVec3 {
        let (matrix, texel_m) = self.shadows.cascades[cascade];
        let normal = self.interpolated(&self.normals, p);
        let normal = normal / normal.length_squared().max(1e-12).sqrt();
        let normal = if self.front { normal } else { -normal };
        let world = self.interpolated(&self.positions, p) + normal * (OFFSET_TEXELS * texel_m);
        matrix.transform_point3(world)
    }

    /// Coordinates of the look-up in a cascade, texels.
    pub fn texels(&self, cascade: usize, p: DVec2) -> DVec2 {
        self.place(cascade, p).truncate()
    }

    /// Error in single precision of texels and depth; also of what clipping at the screen's border makes of
    /// the piece, if `cut`.
    fn error(&self, cascade: usize, p: DVec2, cut: bool) -> DVec3 {
        let (matrix, texel_m) = self.shadows.cascades[cascade];
        let of = |values: &[DVec3; 3]| {
            let pair = |x: usize, y: usize| {
                let set = values.map(|v| DVec2::new(v[x], v[y]));
                let values = self.geometry.values(self.piece, set);
                let bound = |c: &Coordinates<'_>| match cut {
                    true => c.single_precision_cut(p, self.geometry.size_px, [p])[0],
                    false => c.single_precision(p),
                };
                bound(&values)
            };
            let ([x, y], [z, _]) = (pair(0, 1).to_array(), pair(2, 2).to_array());
            DVec3::new(x, y, z)
        };
        let world = self.interpolated(&self.positions, p);
        let length = self.interpolated(&self.normals, p).length().max(1e-6);
        let turn = (of(&self.normals) + self.errors[1]).element_sum() / length + 8.0 * UNIT;
        let moved = of(&self.positions) + self.errors[0] + 2.0 * turn * OFFSET_TEXELS * texel_m;
        let rows = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|c: DVec4| c.truncate().abs());
        let through = |v: DVec3| rows[0] * v.x + rows[1] * v.y + rows[2] * v.z;
        let terms =
            through(world.abs()) + matrix.w_axis.truncate().abs() + DVec3::new(SIZE, SIZE, 1.0);
        through(moved) + ROUNDINGS * UNIT * terms
    }

    /// Error of the texels of a look-up.
    pub fn error_texels(&self, cascade: usize, p: DVec2, cut: bool) -> DVec2 {
        self.error(cascade, p, cut).truncate()
    }

    fn place_in(&self, cascade: usize, p: DVec2, error: DVec3) -> Place {
        let at = self.place(cascade, p);
        let edge = |v: f64| (v - BORDER_TEXELS).min(SIZE - BORDER_TEXELS - v);
        let distances = DVec3::new(edge(at.x), edge(at.y), 1.0 - at.z);
        if distances.cmpgt(error).all() {
            Place::Inside
        } else if distances.cmplt(-error).any() {
            Place::Outside
        } else {
            Place::Border
        }
    }

    /// Whether the fragment at `p` may be looked up in a cascade, or in none: in the first one that it is in.
    pub fn may_take(&self, cascade: Option<usize>, p: DVec2) -> bool {
        let by = |error: &dyn Fn(usize) -> DVec3| {
            let place = |k: usize| self.place_in(k, p, error(k));
            let before = 0..cascade.unwrap_or(self.shadows.count());
            before.into_iter().all(|k| place(k) != Place::Inside)
                && cascade.is_none_or(|k| place(k) != Place::Outside)
        };
        by(&|_| DVec3::ZERO) || by(&|k| self.error(k, p, true) + SMALL)
    }
}
