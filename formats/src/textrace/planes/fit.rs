//! Fits a plane to a primitive's quads: least squares by Gauss-Newton.
//!
//! Only the encoder uses it. The fit affects only the size, because the residuals make the records exact.

use super::plane::{Quad, quad_of};
use crate::textrace::QuadRecord;

/// A plane in `f64`.
#[derive(Clone, Copy)]
pub(super) struct Fitted {
    /// Pixel column and row of the origin in the tile.
    pub origin: [f64; 2],
    /// u and v at the origin.
    pub start: [f64; 2],
    /// Slope of u and v to the right and down, both times w.
    pub slopes: [[f64; 2]; 2],
    /// Change of w by pixel, to the right and down; w is 1 at the origin.
    pub tilt: [f64; 2],
}

impl Fitted {
    /// The plane through a record's own numbers, with the given tilt.
    pub fn through(record: &QuadRecord, tilt: [f32; 2]) -> Self {
        let [p, q] = tilt.map(f64::from);
        Self {
            origin: [record.x, record.y].map(|at| f64::from(2 * at)),
            start: record.uv.map(f64::from),
            slopes: [
                record.dx.map(|slope| f64::from(slope) * (1.0 + p)),
                record.dy.map(|slope| f64::from(slope) * (1.0 + q)),
            ],
            tilt: [p, q],
        }
    }
}

/// Number of unknowns: start, slope to the right and slope down of u and of v, then the tilt.
const UNKNOWNS: usize = 8;
/// Number of iterations, which start near the solution.
const STEPS: usize = 3;

/// Fits a plane to a quad and `others`, starting from one through the quad with the given tilt; `None` if
/// the equations have no solution.
pub(super) fn fit(quad: &QuadRecord, tilt: [f32; 2], others: &[QuadRecord]) -> Option<Fitted> {
    let mut plane = Fitted::through(quad, tilt);
    let quad = quad_of(quad);
    for _ in 0..STEPS {
        let mut equations = Equations::default();
        equations.add(&plane, [0.0; 2], &quad);
        for record in others {
            let [left, top] = plane.origin;
            let at = [
                f64::from(2 * record.x) - left,
                f64::from(2 * record.y) - top,
            ];
            equations.add(&plane, at, &quad_of(record));
        }
        let change = equations.solve(&plane)?;
        for axis in 0..2 {
            plane.start[axis] += change[3 * axis];
            plane.slopes[0][axis] += change[3 * axis + 1];
            plane.slopes[1][axis] += change[3 * axis + 2];
            plane.tilt[axis] += change[6 + axis];
        }
        let sound = plane.tilt.iter().all(|slope| slope.abs() < 0.9);
        if !sound {
            return None;
        }
    }
    Some(plane)
}

/// Normal equations, with the right-hand side in the last column.
#[derive(Default)]
struct Equations([[f64; UNKNOWNS + 1]; UNKNOWNS]);

impl Equations {
    /// Adds the eight numbers of a quad at `at` pixels from the origin.
    #[allow(
        clippy::needless_range_loop,
        reason = "several arrays have the same index"
    )]
    fn add(&mut self, plane: &Fitted, at: [f64; 2], quad: &Quad) {
        let lanes = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let places = lanes.map(|[i, j]| [at[0] + i, at[1] + j]);
        let scales = places.map(|[right, down]| {
            1.0 / (1.0 + plane.tilt[0] * right + plane.tilt[1] * down).max(1.0 / 64.0)
        });
        for axis in 0..2 {
            let mut value = [0.0; 4];
            // By unknown: start, right, down, both tilts; then by lane.
            let mut slope = [[0.0; 4]; 5];
            for lane in 0..4 {
                let ([right, down], scale) = (places[lane], scales[lane]);
                let bend = plane.slopes[0][axis] * right + plane.slopes[1][axis] * down;
                value[lane] = bend * scale;
                slope[0][lane] = 1.0;
                slope[1][lane] = right * scale;
                slope[2][lane] = down * scale;
                slope[3][lane] = -bend * right * scale * scale;
                slope[4][lane] = -bend * down * scale * scale;
            }
            let value = differences(value);
            let slope = slope.map(differences);
            let unknowns = [3 * axis, 3 * axis + 1, 3 * axis + 2, 6, 7];
            for number in 0..4 {
                let mut left = f64::from(quad[number][axis]) - value[number];
                if number == 0 {
                    left -= plane.start[axis];
                }
                for (row, by) in unknowns.iter().zip(&slope) {
                    for (column, of) in unknowns.iter().zip(&slope) {
                        self.0[*row][*column] += by[number] * of[number];
                    }
                    self.0[*row][UNKNOWNS] += by[number] * left;
                }
            }
        }
    }

    /// Solves by elimination, with a small weight on no change.
    fn solve(mut self, plane: &Fitted) -> Option<[f64; UNKNOWNS]> {
        let slopes = plane.slopes.as_flattened();
        let steepest = slopes.iter().fold(1.0f64, |most, s| most.max(s.abs()));
        for at in 0..UNKNOWNS {
            self.0[at][at] += if at < 6 {
                1e-6
            } else {
                1e-8 * steepest * steepest
            };
        }
        for at in 0..UNKNOWNS {
            let pivot = (at..UNKNOWNS).max_by(|a, b| {
                let size = |row: &usize| self.0[*row][at].abs();
                size(a).total_cmp(&size(b))
            })?;
            self.0.swap(at, pivot);
            let row = self.0[at];
            if row[at].abs() < 1e-9 {
                return None;
            }
            for (number, other) in self.0.iter_mut().enumerate() {
                let factor = other[at] / row[at];
                if number != at {
                    other
                        .iter_mut()
                        .zip(row)
                        .for_each(|(to, by)| *to -= factor * by);
                }
            }
        }
        let solution: [f64; UNKNOWNS] =
            std::array::from_fn(|at| self.0[at][UNKNOWNS] / self.0[at][at]);
        solution.iter().all(|v| v.is_finite()).then_some(solution)
    }
}

/// Differences of the four lanes: top left, dx, dy and cross.
fn differences([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [a, b - a, c - a, d - c - (b - a)]
}
