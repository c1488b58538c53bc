//! Predicts a record from the one before it in the same uv group.

use crate::textrace::QuadRecord;
use std::num::Wrapping;

/// A pair (u, v). All arithmetic wraps, so that prediction is total and lossless.
pub(super) type Pair = [Wrapping<i32>; 2];

/// dx, dy and cross of a quad.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Derivatives {
    pub dx: Pair,
    pub dy: Pair,
    pub cross: Pair,
}

/// State of a uv group: its last record and the change of its derivatives.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Context {
    x: i32,
    y: i32,
    uv: Pair,
    last: Derivatives,
    /// Change of dx from a quad to its right neighbour.
    dx_step: Pair,
    /// Change of dy from a quad to its lower neighbour.
    dy_step: Pair,
}

/// Applies `f` to the components of several pairs.
macro_rules! zip {
    ($($name:ident = $pair:expr),+ => $body:expr) => {{
        let u = { $(let [$name, _] = $pair;)+ $body };
        let v = { $(let [_, $name] = $pair;)+ $body };
        [u, v]
    }};
}

impl Context {
    /// Predicts the derivatives of the quad at column `x` and row `y`.
    #[inline(always)]
    pub(super) fn derivatives(&self, x: i32, y: i32) -> Derivatives {
        let (right, down) = (Wrapping(x - self.x), Wrapping(y - self.y));
        let two = Wrapping(2);
        let Derivatives { dx, dy, cross } = self.last;
        Derivatives {
            dx: zip!(dx = dx, step = self.dx_step, cross = cross => dx
                + right * step
                + two * down * cross),
            dy: zip!(dy = dy, step = self.dy_step, cross = cross => dy
                + down * step
                + two * right * cross),
            cross,
        }
    }

    /// Predicts the coordinates of a quad with known derivatives: first along the row, then down the
    /// column, each by the trapezoid rule over one-pixel differences.
    #[inline(always)]
    pub(super) fn uv(&self, x: i32, y: i32, now: &Derivatives) -> Pair {
        let (right, down) = (Wrapping(x - self.x), Wrapping(y - self.y));
        let two = Wrapping(2);
        let last = &self.last;
        zip!(uv = self.uv,
              dx = last.dx,
              dy = last.dy,
              cross = last.cross,
              dx_now = now.dx,
              dy_now = now.dy => {
            let dx_there = dx_now - two * down * cross;
            let dy_here = dy + two * right * cross;
            uv + along(right, dx, dx_there) + along(down, dy_here, dy_now)
        })
    }

    /// Updates the state with a record of the same primitive as the last one (`same_run`) or of another.
    #[inline(always)]
    pub(super) fn learn(&mut self, x: i32, y: i32, uv: Pair, now: Derivatives, same_run: bool) {
        if same_run {
            let (right, down) = (Wrapping(x - self.x), Wrapping(y - self.y));
            let two = Wrapping(2);
            let last = &self.last;
            if right.0.abs() == 1 {
                self.dx_step = zip!(new = now.dx, old = last.dx, cross = last.cross => right
                    * (new - old - two * down * cross));
            }
            if down.0.abs() == 1 {
                self.dy_step = zip!(new = now.dy, old = last.dy, cross = last.cross => down
                    * (new - old - two * right * cross));
            }
        }
        self.x = x;
        self.y = y;
        self.uv = uv;
        self.last = now;
    }
}

/// Change over `quads` quads (two pixels each) if the one-pixel difference changes from `from` to `to`.
#[inline(always)]
fn along(quads: Wrapping<i32>, from: Wrapping<i32>, to: Wrapping<i32>) -> Wrapping<i32> {
    let bend = if quads.0 == 0 { 0 } else { (to - from).0 >> 1 };
    quads * (from + to) - Wrapping(bend)
}

/// Splits a record into the predictor's numbers.
pub(super) fn split(record: &QuadRecord) -> (Pair, Derivatives) {
    let wrapping = |pair: [i32; 2]| pair.map(Wrapping);
    let derivatives = Derivatives {
        dx: wrapping(record.dx),
        dy: wrapping(record.dy),
        cross: wrapping(record.cross),
    };
    (wrapping(record.uv), derivatives)
}
