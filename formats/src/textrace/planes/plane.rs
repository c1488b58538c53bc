//! The plane of a primitive's texture coordinates over the screen.
//!
//! `u * w`, `v * w` and `w` are linear in screen space. With w scaled to 1 at an origin, seven numbers in
//! addition to the origin's coordinates determine u and v everywhere. All numbers are `f32`, with
//! additions, multiplications and divisions in a fixed order, so every machine predicts the same values.
#![deny(clippy::indexing_slicing)]

use crate::textrace::QuadRecord;
use crate::textrace::invariant::QUAD_POSITIONS;
use glam::{Vec2, Vec4, Vec4Swizzles};

/// uv, dx, dy and cross of a quad, each u and v.
pub(super) type Quad = [[i32; 2]; 4];

/// The numbers of a record in the order of [`Quad`].
pub(super) fn quad_of(record: &QuadRecord) -> Quad {
    [record.uv, record.dx, record.dy, record.cross]
}

/// Lower bound of w, which prevents infinite results.
const LEAST_W: f32 = 1.0 / 1024.0;
/// Weight of the expected tilt against the tilt from a quad's cross: the square of about half a fixed-point
/// step in units of the tilt's usual error, 2^-9 per pixel.
const PRIOR: f32 = 65536.0;

/// A plane in perspective around the top-left lane of a quad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Plane {
    /// Pixel column and row of the origin in the tile.
    origin: [f32; 2],
    /// u and v at the origin: whole steps, and the fraction.
    base: [i32; 2],
    start: [f32; 2],
    /// Slope of u and v to the right, then down, both times w.
    pub slopes: [f32; 4],
    /// Change of w by pixel, to the right and down; w is 1 at the origin.
    tilt: [f32; 2],
}

impl Plane {
    /// The plane through the quad at a position on the Morton curve, with the given tilt.
    #[inline(always)]
    pub fn through(morton: u8, quad: &Quad, tilt: [f32; 2]) -> Self {
        let [base, [dx_u, dx_v], [dy_u, dy_v], _] = *quad;
        let [p, q] = tilt;
        let by_w = Vec4::new(1.0 + p, 1.0 + p, 1.0 + q, 1.0 + q);
        let [right, down] = quad_at(morton);
        Self {
            origin: [right.x, down.x],
            base,
            start: [0.0; 2],
            slopes: (four([dx_u, dx_v, dy_u, dy_v]) * by_w).to_array(),
            tilt,
        }
    }

    /// The same plane with tilt, slopes and start changed by a correction in the units of `level`, which is
    /// at least 1.
    #[inline(always)]
    pub fn corrected(morton: u8, quad: &Quad, tilt: [f32; 2], level: u32, by: &Quad) -> Self {
        let [start, [right_u, right_v], [down_u, down_v], change] = *by;
        let units = Units::new(level, quad);
        let ([p, q], [dp, dq]) = (tilt, floats(change));
        let tilt = [
            within_one(p + dp * units.tilt),
            within_one(q + dq * units.tilt),
        ];
        let mut plane = Self::through(morton, quad, tilt);
        let slopes = four([right_u, right_v, down_u, down_v]) * Vec4::splat(units.slope);
        plane.slopes = (Vec4::from_array(plane.slopes) + slopes).to_array();
        let [start_u, start_v] = floats(start);
        plane.start = [start_u * units.start, start_v * units.start];
        plane
    }

    /// Predicts the quad at a position on the Morton curve.
    #[inline(always)]
    pub fn predict(&self, morton: u8) -> Quad {
        // u and v of a lane and of the lane to its right: the upper two lanes, then the lower two.
        const OF_RIGHT: Vec4 = Vec4::new(0.0, 0.0, 1.0, 1.0);
        let [left, top] = self.origin.map(Vec4::splat);
        let [right, down] = quad_at(morton);
        let (right, down) = (right - left, down - top);
        let slopes = Vec4::from_array(self.slopes);
        let (to_right, to_down) = (slopes.xyxy(), slopes.zwzw());
        let [p, q] = self.tilt.map(Vec4::splat);
        let w = Vec4::ONE + p * right + q * down;
        let bend = to_right * right + to_down * down;
        let least = Vec4::splat(LEAST_W);
        let upper = bend / w.max(least);
        let lower = (bend + to_down) / (w + q).max(least);
        let by_row = lower - upper;
        let ([base_u, base_v], [start_u, start_v]) = (self.base, self.start);
        let start = Vec4::new(start_u, start_v, 0.0, 0.0);
        let [uv, dx] = rounded(
            upper + (start - upper.xyxy() * OF_RIGHT),
            [base_u, base_v, 0, 0],
        );
        let [dy, cross] = rounded(by_row - by_row.xyxy() * OF_RIGHT, [0; 4]);
        [uv, dx, dy, cross]
    }

    /// Tilt around a quad, scaled to w = 1 there.
    #[inline(always)]
    pub fn tilt_at(&self, morton: u8) -> [f32; 2] {
        let [left, top] = self.origin;
        let [right, down] = quad_at(morton);
        let [p, q] = self.tilt;
        let w = 1.0 + p * (right.x - left) + q * (down.x - top);
        let w = if w > LEAST_W { w } else { LEAST_W };
        [within_one(p / w), within_one(q / w)]
    }
}

/// By position on the Morton curve: the columns of the left lane (twice, for u and v) and of the right one,
/// and the row of the upper lanes, in the tile.
static QUADS: [[[f32; 4]; 2]; 64] = {
    let mut quads = [[[0.0; 4]; 2]; 64];
    let mut at = 0;
    while at < 64 {
        #[allow(clippy::indexing_slicing, reason = "evaluated when compiled")]
        {
            let (x, y) = QUAD_POSITIONS[at];
            let (left, top) = (2.0 * x as f32, 2.0 * y as f32);
            quads[at] = [[left, left, left + 1.0, left + 1.0], [top; 4]];
        }
        at += 1;
    }
    quads
};

/// Columns and rows from [`QUADS`].
#[inline(always)]
fn quad_at(morton: u8) -> [Vec4; 2] {
    let found = QUADS.get(usize::from(morton) % QUADS.len()).copied();
    let [right, down] = found.unwrap_or_default();
    [Vec4::from_array(right), Vec4::from_array(down)]
}

/// Rounds to the nearest integers, ties to even, and adds others. Adding 1.5 * 2^23 leaves them in the low
/// bits. Exact below 2^22; beyond, predictions are poor but the same on every machine.
#[inline(always)]
fn rounded(numbers: Vec4, and: [i32; 4]) -> [[i32; 2]; 2] {
    let [a, b, c, d] = (numbers + Vec4::splat(MAGIC)).to_array();
    let [to_a, to_b, to_c, to_d] = and;
    [
        [near(a, to_a), near(b, to_b)],
        [near(c, to_c), near(d, to_d)],
    ]
}

const MAGIC: f32 = 12_582_912.0;

/// Adds an integer to the one in the low bits of a sum with [`MAGIC`].
#[inline(always)]
fn near(sum: f32, and: i32) -> i32 {
    let bits = sum.to_bits().cast_signed();
    bits.wrapping_add(and.wrapping_sub(MAGIC.to_bits().cast_signed()))
}

/// Units of a correction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Units {
    pub start: f32,
    pub slope: f32,
    pub tilt: f32,
}

impl Units {
    /// Higher levels have finer units. The units of the tilt are also finer for larger dx and dy.
    #[inline(always)]
    pub fn new(level: u32, quad: &Quad) -> Self {
        let [_, [a, b], [c, d], _] = *quad;
        // Number of bits of the largest magnitude (or of its complement).
        let all = (a ^ a >> 31) | (b ^ b >> 31) | (c ^ c >> 31) | (d ^ d >> 31);
        Self {
            start: 0.25,
            slope: power(level),
            tilt: power(2 * level + (32 - all.leading_zeros())),
        }
    }
}

/// 2^-n for n up to 126, exact.
#[inline(always)]
fn power(n: u32) -> f32 {
    f32::from_bits((127 - n.min(126)) << 23)
}

/// Predicts a quad's cross from its dx and dy and the tilt, assuming w = 1 over the whole quad.
#[inline(always)]
pub(super) fn cross(dx: [i32; 2], dy: [i32; 2], tilt: [f32; 2]) -> [i32; 2] {
    let [p, q] = tilt;
    let ([dx_u, dx_v], [dy_u, dy_v]) = (floats(dx), floats(dy));
    let of = |dx: f32, dy: f32| near(MAGIC - (dx * q + dy * p), 0);
    [of(dx_u, dy_u), of(dx_v, dy_v)]
}

/// Estimates the tilt from a quad's numbers, close to the expected one. cross is
/// `-(dx * q + dy * p) / (1 + p + q)` for u and for v, so this is least squares with a prior.
#[inline(always)]
pub(super) fn tilt_of(quad: &Quad, expected: [f32; 2]) -> [f32; 2] {
    let [_, dx, dy, cross] = quad.map(|pair| Vec2::from_array(floats(pair)));
    let [p, q] = expected;
    let (a, b) = (cross + dy, cross + dx);
    let left = -(cross + p * a + q * b);
    let (aa, bb, ab) = (a.dot(a), b.dot(b), a.dot(b));
    let (ae, be) = (a.dot(left), b.dot(left));
    let area = a.x * b.y - a.y * b.x;
    // (aa + PRIOR) * (bb + PRIOR) - ab * ab, without a difference that could round to zero.
    let determinant = PRIOR * (PRIOR + aa + bb) + area * area;
    [
        within_one(p + ((bb + PRIOR) * ae - ab * be) / determinant),
        within_one(q + ((aa + PRIOR) * be - ab * ae) / determinant),
    ]
}

/// Written out because `map` is not always inlined.
#[inline(always)]
#[allow(clippy::cast_precision_loss, reason = "the nearest f32 is meant")]
fn floats([a, b]: [i32; 2]) -> [f32; 2] {
    [a as f32, b as f32]
}

#[inline(always)]
#[allow(clippy::cast_precision_loss, reason = "the nearest f32 is meant")]
fn four([a, b, c, d]: [i32; 4]) -> Vec4 {
    Vec4::new(a as f32, b as f32, c as f32, d as f32)
}

/// Clamps to -1..=1; NaN becomes 1.
#[inline(always)]
fn within_one(slope: f32) -> f32 {
    let slope = if slope < 1.0 { slope } else { 1.0 };
    if slope > -1.0 { slope } else { -1.0 }
}
