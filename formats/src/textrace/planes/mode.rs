//! What a residual stands for: how far a quad departs from its plane, told in one of three ways.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::plane::Quad;
use super::residual::{Pair, sum};

/// How a run's residuals are told, whichever is smallest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Mode {
    /// Departures of uv, dx, dy and cross.
    #[default]
    Plain,
    /// Departures of the four lanes: smaller where each lane was rounded for itself, coarsely.
    Lanes,
    /// Changes of the departure since the last quad: smaller where the surface is no plane.
    Following,
}

impl Mode {
    pub const ALL: [Self; 3] = [Self::Plain, Self::Lanes, Self::Following];

    /// By number; the first one for a number that is none.
    pub fn of(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }
}

/// The departure of a group's last quad, from which that of the next follows.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Departure {
    pub mode: Mode,
    x: i32,
    y: i32,
    quad: Quad,
}

impl Departure {
    /// That of a run's first quad: none.
    pub fn start(mode: Mode, x: u8, y: u8) -> Self {
        Self {
            mode,
            x: x.into(),
            y: y.into(),
            quad: Quad::default(),
        }
    }

    /// The departure that a residual stands for.
    #[inline(always)]
    pub fn read(&mut self, x: u8, y: u8, residual: &Quad) -> Quad {
        let [uv, dx, dy, cross] = *residual;
        match self.mode {
            Mode::Plain => *residual,
            Mode::Lanes => {
                let rest = minus(sum(cross, uv), sum(dx, dy));
                [uv, minus(dx, uv), minus(dy, uv), rest]
            }
            Mode::Following => {
                let [last_uv, last_dx, last_dy, last_cross] = self.quad;
                let (dx, dy) = (sum(last_dx, dx), sum(last_dy, dy));
                let step = self.step(x, y, dx, dy);
                let uv = sum(sum(last_uv, step), uv);
                self.note(x, y, [uv, dx, dy, sum(last_cross, cross)])
            }
        }
    }

    /// The residual that stands for a departure.
    pub fn write(&mut self, x: u8, y: u8, quad: &Quad) -> Quad {
        let [uv, dx, dy, cross] = *quad;
        match self.mode {
            Mode::Plain => *quad,
            Mode::Lanes => {
                let (dx, dy) = (sum(dx, uv), sum(dy, uv));
                [uv, dx, dy, minus(sum(cross, sum(dx, dy)), uv)]
            }
            Mode::Following => {
                let [last_uv, last_dx, last_dy, last_cross] = self.quad;
                let step = self.step(x, y, dx, dy);
                self.note(x, y, *quad);
                [
                    minus(minus(uv, last_uv), step),
                    minus(dx, last_dx),
                    minus(dy, last_dy),
                    minus(cross, last_cross),
                ]
            }
        }
    }

    /// How uv changes from the last quad, two pixels each, by the trapezoid rule.
    #[inline(always)]
    fn step(&self, x: u8, y: u8, dx: Pair, dy: Pair) -> Pair {
        let [_, last_dx, last_dy, _] = self.quad;
        let right = i32::from(x) - self.x;
        let down = i32::from(y) - self.y;
        let times = |n: i32, pair: Pair| pair.map(|d| d.wrapping_mul(n));
        sum(
            times(right, sum(last_dx, dx)),
            times(down, sum(last_dy, dy)),
        )
    }

    #[inline(always)]
    fn note(&mut self, x: u8, y: u8, quad: Quad) -> Quad {
        *self = Self {
            mode: self.mode,
            x: x.into(),
            y: y.into(),
            quad,
        };
        quad
    }
}

#[inline(always)]
fn minus([a, b]: Pair, [c, d]: Pair) -> Pair {
    [a.wrapping_sub(c), b.wrapping_sub(d)]
}
