//! Modes: the ways in which a residual encodes the deviation of a quad from its plane.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::plane::Quad;
use super::residual::{Pair, sum};

/// Meaning of a run's residuals; the encoder uses the smallest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Mode {
    /// Deviations of uv, dx, dy and cross.
    #[default]
    Plain,
    /// Deviations of the four lanes: smaller if each lane was rounded separately and coarsely.
    Lanes,
    /// Residuals of encoding 1's prediction from the last quad's deviation: smaller for curved surfaces.
    Bending,
    /// As `Bending`, but the last quad's slopes are predicted to stay.
    Following,
}

impl Mode {
    pub const ALL: [Self; 4] = [Self::Plain, Self::Lanes, Self::Bending, Self::Following];

    /// The mode with a number.
    pub fn of(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }
}

/// The deviation of a group's last quad. The next one is predicted from it as encoding 1 predicts records.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Deviation {
    pub mode: Mode,
    at: [i32; 2],
    uv: Pair,
    /// dx, then dy.
    slopes: Four,
    cross: Pair,
    /// Change of dx from a quad to its right neighbour, then of dy to the lower one.
    steps: Four,
}

/// Two pairs, for one vector instruction.
type Four = [i32; 4];

impl Deviation {
    /// The deviation of a run's first quad, which is zero.
    #[inline(always)]
    pub fn start(mode: Mode, x: u8, y: u8) -> Self {
        Self {
            mode,
            at: [x.into(), y.into()],
            ..Self::default()
        }
    }

    /// The deviation encoded by a residual.
    #[inline(always)]
    pub fn read(&mut self, x: u8, y: u8, residual: &Quad) -> Quad {
        let [uv, dx, dy, cross] = *residual;
        match self.mode {
            Mode::Plain => *residual,
            Mode::Lanes => {
                let rest = minus(sum(cross, uv), sum(dx, dy));
                [uv, minus(dx, uv), minus(dy, uv), rest]
            }
            Mode::Bending | Mode::Following => {
                let way = self.way(x, y);
                let slopes = four(self.guess(&way), joined(dx, dy), i32::wrapping_add);
                let uv = sum(self.expected_uv(&way, slopes), uv);
                self.learn(x, y, [uv, sum(self.cross, cross)], slopes);
                let [dx, dy] = parted(slopes);
                [uv, dx, dy, self.cross]
            }
        }
    }

    /// The residual that encodes a deviation.
    pub fn write(&mut self, x: u8, y: u8, quad: &Quad) -> Quad {
        let [uv, dx, dy, cross] = *quad;
        match self.mode {
            Mode::Plain => *quad,
            Mode::Lanes => {
                let (dx, dy) = (sum(dx, uv), sum(dy, uv));
                [uv, dx, dy, minus(sum(cross, sum(dx, dy)), uv)]
            }
            Mode::Bending | Mode::Following => {
                let way = self.way(x, y);
                let slopes = joined(dx, dy);
                let of_slopes = four(slopes, self.guess(&way), i32::wrapping_sub);
                let of_uv = minus(uv, self.expected_uv(&way, slopes));
                let of_cross = minus(cross, self.cross);
                self.learn(x, y, [uv, cross], slopes);
                let [of_dx, of_dy] = parted(of_slopes);
                [of_uv, of_dx, of_dy, of_cross]
            }
        }
    }

    /// The offset from the last quad to another one.
    #[inline(always)]
    fn way(&self, x: u8, y: u8) -> Way {
        let [right, down] = minus([x.into(), y.into()], self.at);
        let ([u, v], [twice_right, twice_down]) = (self.cross, [2 * right, 2 * down]);
        let turn = [twice_down, twice_down, twice_right, twice_right];
        Way {
            quads: [right, right, down, down],
            turn: four(turn, [u, v, u, v], i32::wrapping_mul),
        }
    }

    /// Predicts dx and dy.
    #[inline(always)]
    fn guess(&self, way: &Way) -> Four {
        if self.mode != Mode::Bending {
            return self.slopes;
        }
        let steps = four(way.quads, self.steps, i32::wrapping_mul);
        four(
            four(self.slopes, steps, i32::wrapping_add),
            way.turn,
            i32::wrapping_add,
        )
    }

    /// Predicts uv from known dx and dy, and updates their change. First along the row, then down the
    /// column, each by the trapezoid rule over one-pixel differences.
    #[inline(always)]
    fn expected_uv(&mut self, way: &Way, slopes: Four) -> Pair {
        let [right_u, right_v, down_u, down_v] = way.turn;
        let from = four(self.slopes, [0, 0, down_u, down_v], i32::wrapping_add);
        let to = four(slopes, [right_u, right_v, 0, 0], i32::wrapping_sub);
        let change = four(to, from, i32::wrapping_sub);
        let both = four(
            four(from, to, i32::wrapping_add),
            way.quads,
            i32::wrapping_mul,
        );
        let bend = four(
            change,
            way.quads,
            |change, quads| if quads == 0 { 0 } else { change >> 1 },
        );
        let [along_row, down_column] = parted(four(both, bend, i32::wrapping_sub));
        let steps = four(change, way.quads, i32::wrapping_mul);
        for ((step, new), quads) in self.steps.iter_mut().zip(steps).zip(way.quads) {
            *step = if quads.wrapping_mul(quads) == 1 {
                new
            } else {
                *step
            };
        }
        sum(sum(self.uv, along_row), down_column)
    }

    #[inline(always)]
    fn learn(&mut self, x: u8, y: u8, [uv, cross]: [Pair; 2], slopes: Four) {
        self.at = [x.into(), y.into()];
        (self.uv, self.cross, self.slopes) = (uv, cross, slopes);
    }
}

/// Offset from one quad to another.
struct Way {
    /// Quads to the right (twice, for u and v), then down.
    quads: Four,
    /// Change of dx over the rows, then of dy over the columns.
    turn: Four,
}

#[inline(always)]
fn four(a: Four, b: Four, of: impl Fn(i32, i32) -> i32) -> Four {
    let ([a, b, c, d], [e, f, g, h]) = (a, b);
    [of(a, e), of(b, f), of(c, g), of(d, h)]
}

#[inline(always)]
fn joined([a, b]: Pair, [c, d]: Pair) -> Four {
    [a, b, c, d]
}

#[inline(always)]
fn parted([a, b, c, d]: Four) -> [Pair; 2] {
    [[a, b], [c, d]]
}

#[inline(always)]
fn minus([a, b]: Pair, [c, d]: Pair) -> Pair {
    [a.wrapping_sub(c), b.wrapping_sub(d)]
}
