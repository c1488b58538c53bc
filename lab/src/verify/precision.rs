//! Bounds of the errors of single precision in a capture, derived from the arithmetic; none is fitted.
//!
//! [`UNIT`] is the relative error of one rounding. A bound is the sum of the roundings of a computation, each
//! times the magnitude of its terms (Higham 2002, chapter 3); docs/use/verify.md derives them.

use super::geometry::Coordinates;
use super::piece::Corner;
use super::vertex_error::UNIT;
use formats::textrace::SUBTEXELS;
use glam::{DVec2, DVec3};

/// A plane over the screen that passes through the values of three corners.
struct Plane {
    values: [f64; 3],
    gradient: DVec2,
}

impl Plane {
    fn new(corners: &[Corner; 3], values: [f64; 3]) -> Self {
        let [a, b, c] = corners.each_ref().map(|corner| corner.at);
        let (ab, ac) = (b - a, c - a);
        let (fab, fac) = (values[1] - values[0], values[2] - values[0]);
        let area = ab.perp_dot(ac);
        Self {
            values,
            gradient: DVec2::new(fab * ac.y - fac * ab.y, fac * ab.x - fab * ac.x) / area,
        }
    }

    /// Error of its value at a point, for the setup of planes in drivers: gradients from two differences and
    /// the inverse area, a value at the screen's corner from the first corner's, and from there to the point.
    fn error(&self, corners: &[Corner; 3], p: DVec2) -> f64 {
        let [a, b, c] = corners.each_ref().map(|corner| corner.at);
        let (ab, ac) = (b - a, c - a);
        let area = ab.perp_dot(ac).abs();
        let [f0, f1, f2] = self.values.map(f64::abs);
        let largest = f0.max(f1).max(f2);
        let (fab, fac) = (
            self.values[1] - self.values[0],
            self.values[2] - self.values[0],
        );
        let area_error = 4.0 * ((ab.x * ac.y).abs() + (ab.y * ac.x).abs()) / area + 2.0;
        let gradient_error = |along: f64, db: f64, dc: f64| {
            let terms = 4.0 * ((fab * dc).abs() + (fac * db).abs());
            let values = 4.0 * largest * (db.abs() + dc.abs());
            (terms + values) / area + along.abs() * area_error
        };
        let errors = DVec2::new(
            gradient_error(self.gradient.x, ab.y, ac.y),
            gradient_error(self.gradient.y, ab.x, ac.x),
        );
        let away = corners.iter().map(|corner| (p - corner.at).abs());
        let away = away.fold(DVec2::ZERO, DVec2::max);
        let start = corners.iter().map(|corner| corner.at.abs());
        let start = start.fold(DVec2::ZERO, DVec2::max);
        let steps = 4.0 * (largest + self.gradient.abs().dot(start + p.abs()));
        UNIT * (errors.dot(away) + steps)
    }
}

impl Coordinates<'_> {
    /// The largest bound of [`Self::single_precision`] at points around a fragment, over the triangles that
    /// clipping at the screen's border may have created: the planes of thin ones lose digits.
    pub fn single_precision_cut<const N: usize>(
        &self,
        fragment: DVec2,
        size_px: [u32; 2],
        points: [DVec2; N],
    ) -> [DVec2; N] {
        let mut bounds = points.map(|p| self.single_precision(p));
        for triangle in self.piece().cut_at_border(size_px, fragment) {
            let cut = self.on(&triangle);
            for (bound, p) in bounds.iter_mut().zip(points) {
                *bound = bound.max(cut.single_precision(p));
            }
        }
        bounds
    }

    /// Error of coordinates at a point of the screen in single precision, in repeats: moved vertices,
    /// interpolation, the texture's transform, and the record's sums. Infinite if there is no bound.
    pub fn single_precision(&self, p: DVec2) -> DVec2 {
        let corners = self.piece().corners();
        let set = self.set();
        let over_w = |values: [f64; 3]| {
            let corner = |i: usize| values[i] * corners[i].inverse_w;
            Plane::new(corners, [corner(0), corner(1), corner(2)])
        };
        let of_corner = |i: usize| {
            let w = corners[i].weights;
            set[0] * w.x + set[1] * w.y + set[2] * w.z
        };
        let uv = [of_corner(0), of_corner(1), of_corner(2)];
        let screen = self.piece().screen_weights(p);
        let shares = [0, 1, 2].map(|i| screen[i] * corners[i].inverse_w);
        let below: f64 = shares.iter().sum();
        if below.is_nan() || below <= 0.0 {
            return DVec2::INFINITY;
        }
        let here = (0..3).map(|i| uv[i] * shares[i]).sum::<DVec2>() / below;
        let one = over_w([1.0; 3]);
        let one_error = one.error(corners, p);
        let mut raw = DVec2::ZERO;
        let mut by = [DVec2::ZERO; 2];
        for axis in 0..2 {
            let above = over_w(uv.map(|uv| uv[axis]));
            let gradient = (above.gradient - here[axis] * one.gradient) / below;
            by[axis] = gradient;
            let interpolated = (above.error(corners, p) + here[axis].abs() * one_error) / below
                + 3.0 * UNIT * here[axis].abs();
            let moved: f64 = (0..3)
                .map(|i| {
                    let place = screen[i].abs() * gradient.abs().dot(corners[i].moves_px);
                    let depth = shares[i].abs() / below * corners[i].inverse_w_error;
                    place + depth * (uv[i][axis] - here[axis]).abs()
                })
                .sum();
            raw[axis] = interpolated + moved;
        }
        let rows = self.rows();
        let transformed = [0, 1].map(|axis: usize| {
            let DVec3 { x, y, z } = rows[axis];
            let own = x.abs() * raw.x + y.abs() * raw.y;
            let value = x.abs() * here.x.abs() + y.abs() * here.y.abs() + z.abs();
            // Their change over the quad.
            let gradient = (x * by[0] + y * by[1]).abs().element_sum();
            own + UNIT * (3.0 * value + 8.0 * (value + gradient))
        });
        let bound = DVec2::from(transformed);
        if bound.is_nan() {
            DVec2::INFINITY
        } else {
            bound
        }
    }
}

/// Error of rounding to the trace's steps in a lane of a record, texels of the group: half a step per term.
pub(super) fn rounding_texels(lane: u32) -> f64 {
    let terms = match lane {
        0 => 1.0,
        1 | 2 => 2.0,
        _ => 4.0,
    };
    terms * 0.5 / f64::from(SUBTEXELS)
}
