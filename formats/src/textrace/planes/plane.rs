//! A primitive's plane: its texture coordinates over the screen.
//!
//! `u * w`, `v * w` and `w` are linear in screen space. With w scaled to 1 at an origin, seven
//! numbers besides the origin's coordinates give u and v everywhere. All of it is `f64` with
//! additions, multiplications and divisions in a stated order, so every machine predicts the same.
#![deny(clippy::indexing_slicing)]

use crate::textrace::QuadRecord;
use glam::{Vec4, Vec4Swizzles};

/// uv, dx, dy and cross of a quad, each u and v.
pub(super) type Quad = [[i32; 2]; 4];

/// The numbers of a record in the order of [`Quad`].
pub(super) fn quad_of(record: &QuadRecord) -> Quad {
    [record.uv, record.dx, record.dy, record.cross]
}

/// w is taken as at least this, so that nothing becomes infinite.
const LEAST_W: f32 = 1.0 / 1024.0;
/// Weight of the expected slope of w against what a quad's cross tells: the square of about half a
/// fixed-point step in units of the slope's usual error, 2^-9 a pixel.
const PRIOR: f64 = 65536.0;

/// A plane in perspective around the top-left lane of a quad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Plane {
    /// Pixel column and row of the origin in the tile.
    pub origin: [f64; 2],
    /// u and v at the origin.
    pub start: [f64; 2],
    /// Slope of u and v to the right and down, both times w.
    pub slopes: [[f64; 2]; 2],
    /// Change of w by pixel, to the right and down; w is 1 at the origin.
    pub tilt: [f64; 2],
}

impl Plane {
    /// The plane through a quad's own numbers, with a slope of w.
    #[inline]
    pub fn through(x: u8, y: u8, quad: &Quad, tilt: [f64; 2]) -> Self {
        let [uv, dx, dy, _] = *quad;
        let (uv, dx, dy) = (floats(uv), floats(dx), floats(dy));
        let [p, q] = tilt;
        Self {
            origin: [f64::from(2 * x), f64::from(2 * y)],
            start: uv,
            slopes: [times(dx, 1.0 + p), times(dy, 1.0 + q)],
            tilt,
        }
    }

    /// The plane with slopes of w, slopes and start changed by a correction in the units of `level`.
    #[inline]
    pub fn corrected(x: u8, y: u8, quad: &Quad, tilt: [f64; 2], level: u32, by: &Quad) -> Self {
        let [start, right, down, change] = *by;
        let (start, right, down) = (floats(start), floats(right), floats(down));
        let units = Units::new(level, quad);
        let ([p, q], [dp, dq]) = (tilt, floats(change));
        let tilt = [
            within_one(p + dp * units.tilt),
            within_one(q + dq * units.tilt),
        ];
        let mut plane = Self::through(x, y, quad, tilt);
        let [of_right, of_down] = plane.slopes;
        plane.slopes = [
            plus(of_right, times(right, units.slope)),
            plus(of_down, times(down, units.slope)),
        ];
        plane.start = plus(plane.start, times(start, units.start));
        plane
    }
}

/// A plane as it is remembered and asked: in `f32`, four lanes at once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Surface {
    /// Pixel column and row of the origin in the tile.
    origin: [f32; 2],
    /// u and v at the origin: whole steps, and what is left over.
    base: [i32; 2],
    start: [f32; 2],
    slopes: [[f32; 2]; 2],
    tilt: [f32; 2],
}

impl From<&Plane> for Surface {
    #[inline(always)]
    fn from(plane: &Plane) -> Self {
        let [u, v] = plane.start;
        let base = round(plane.start);
        let [base_u, base_v] = base;
        let [right, down] = plane.slopes;
        Self {
            origin: singles(plane.origin),
            base,
            start: singles([u - f64::from(base_u), v - f64::from(base_v)]),
            slopes: [singles(right), singles(down)],
            tilt: singles(plane.tilt),
        }
    }
}

impl Surface {
    /// What the plane says of a quad.
    #[inline(always)]
    pub fn predict(&self, x: u8, y: u8) -> Quad {
        // u and v of a lane and of the one to its right; the upper two lanes, then the lower two.
        const OF_RIGHT: Vec4 = Vec4::new(0.0, 0.0, 1.0, 1.0);
        let [left, top] = self.origin;
        let right = Vec4::splat(f32::from(2 * x) - left) + OF_RIGHT;
        let down = Vec4::splat(f32::from(2 * y) - top);
        let [[right_u, right_v], [down_u, down_v]] = self.slopes;
        let to_right = Vec4::new(right_u, right_v, right_u, right_v);
        let to_down = Vec4::new(down_u, down_v, down_u, down_v);
        let [p, q] = self.tilt.map(Vec4::splat);
        let w = Vec4::ONE + p * right + q * down;
        let bend = to_right * right + to_down * down;
        let least = Vec4::splat(LEAST_W);
        let upper = bend / w.max(least);
        let lower = (bend + to_down) / (w + q).max(least);
        let by_row = lower - upper;
        let ([base_u, base_v], [start_u, start_v]) = (self.base, self.start);
        let start = Vec4::new(start_u, start_v, 0.0, 0.0);
        let [uv_u, uv_v, dx_u, dx_v] = rounded(upper + (start - upper.xyxy() * OF_RIGHT));
        let [dy_u, dy_v, cross_u, cross_v] = rounded(by_row - by_row.xyxy() * OF_RIGHT);
        [
            [uv_u.wrapping_add(base_u), uv_v.wrapping_add(base_v)],
            [dx_u, dx_v],
            [dy_u, dy_v],
            [cross_u, cross_v],
        ]
    }

    /// Slope of w around a quad, where w there is 1.
    #[inline]
    pub fn tilt_at(&self, x: u8, y: u8) -> [f64; 2] {
        let [left, top] = self.origin;
        let [right, down] = [f32::from(2 * x) - left, f32::from(2 * y) - top];
        let [p, q] = self.tilt;
        let w = 1.0 + p * right + q * down;
        let w = if w > LEAST_W { w } else { LEAST_W };
        [within_one(f64::from(p / w)), within_one(f64::from(q / w))]
    }
}

/// Nearest integers, ties to even: adding 1.5 * 2^23 leaves them in the low bits. Right below 2^22; beyond,
/// a prediction is a bad one, but the same everywhere.
#[inline(always)]
fn rounded(numbers: Vec4) -> [i32; 4] {
    const MAGIC: f32 = 12_582_912.0;
    let of = |magic: f32| {
        let bits = magic.to_bits();
        bits.wrapping_sub(MAGIC.to_bits()).cast_signed()
    };
    let [a, b, c, d] = (numbers + Vec4::splat(MAGIC)).to_array();
    [of(a), of(b), of(c), of(d)]
}

#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "the nearest f32 is meant")]
fn singles([a, b]: [f64; 2]) -> [f32; 2] {
    [a as f32, b as f32]
}

/// What a correction of 1 stands for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Units {
    pub start: f64,
    pub slope: f64,
    pub tilt: f64,
}

impl Units {
    /// The finer, the higher the level; slopes of w the finer, too, the larger dx and dy are.
    pub fn new(level: u32, quad: &Quad) -> Self {
        let [_, [a, b], [c, d], _] = *quad;
        let (ab, cd) = (
            a.unsigned_abs().max(b.unsigned_abs()),
            c.unsigned_abs().max(d.unsigned_abs()),
        );
        let largest = ab.max(cd);
        Self {
            start: 0.25,
            slope: power(level),
            tilt: power(2 * level + (32 - largest.leading_zeros())),
        }
    }
}

/// 2^-n, exact.
fn power(n: u32) -> f64 {
    1.0 / (1u64 << n.min(63)) as f64
}

/// cross of a quad whose dx and dy are known, with a slope of w.
#[inline]
pub(super) fn cross(dx: [i32; 2], dy: [i32; 2], tilt: [f64; 2]) -> [i32; 2] {
    let [p, q] = tilt;
    let w = (1.0 + p + q).max(LEAST_W.into());
    let of = |dx: i32, dy: i32| (f64::from(dx) * q + f64::from(dy) * p) / -w;
    let ([dx_u, dx_v], [dy_u, dy_v]) = (dx, dy);
    round([of(dx_u, dy_u), of(dx_v, dy_v)])
}

/// The slope of w that a quad's own numbers tell, kept near an expected one: cross is
/// `-(dx * q + dy * p) / (1 + p + q)` for u and for v, so least squares with a prior.
#[inline]
pub(super) fn tilt_of(quad: &Quad, expected: [f64; 2]) -> [f64; 2] {
    let [_, dx, dy, cross] = *quad;
    let (dx, dy, cross) = (floats(dx), floats(dy), floats(cross));
    let [p, q] = expected;
    let ([dx_u, dx_v], [dy_u, dy_v], [c_u, c_v]) = (dx, dy, cross);
    let (a_u, b_u, a_v, b_v) = (c_u + dy_u, c_u + dx_u, c_v + dy_v, c_v + dx_v);
    let left_u = -(c_u + p * a_u + q * b_u);
    let left_v = -(c_v + p * a_v + q * b_v);
    let (aa, bb) = (a_u * a_u + a_v * a_v, b_u * b_u + b_v * b_v);
    let ab = a_u * b_u + a_v * b_v;
    let (ae, be) = (a_u * left_u + a_v * left_v, b_u * left_u + b_v * left_v);
    let area = a_u * b_v - a_v * b_u;
    // (aa + PRIOR) * (bb + PRIOR) - ab * ab, without a difference that could round to zero.
    let determinant = PRIOR * (PRIOR + aa + bb) + area * area;
    [
        within_one(p + ((bb + PRIOR) * ae - ab * be) / determinant),
        within_one(q + ((aa + PRIOR) * be - ab * ae) / determinant),
    ]
}

/// Not `map`, which is not always inlined.
#[inline(always)]
fn floats([a, b]: [i32; 2]) -> [f64; 2] {
    [a.into(), b.into()]
}

#[inline]
fn within_one(slope: f64) -> f64 {
    slope.clamp(-1.0, 1.0)
}

#[inline(always)]
fn plus([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a + c, b + d]
}

#[inline(always)]
fn times([a, b]: [f64; 2], by: f64) -> [f64; 2] {
    [a * by, b * by]
}

/// Nearest integers, ties to even, modulo 2^32: adding 1.5 * 2^52 leaves them in the low bits.
///
/// Right below 2^51, where all predictions are: slopes stay below 2^34, offsets below 2^5, and
/// w is at least 2^-10.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    reason = "predictions wrap like the numbers that they predict"
)]
fn round([u, v]: [f64; 2]) -> [i32; 2] {
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    let of = |value: f64| ((value + MAGIC).to_bits() as u32).cast_signed();
    [of(u), of(v)]
}
