//! What a residual stands for: how far a quad departs from its plane, told in one of several ways.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::plane::Quad;
use super::residual::{Pair, sum};
use crate::textrace::delta::predict::{Context, Derivatives};
use std::num::Wrapping;

/// How a run's residuals are told, whichever is smallest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Mode {
    /// Departures of uv, dx, dy and cross.
    #[default]
    Plain,
    /// Departures of the four lanes: smaller where each lane was rounded for itself, coarsely.
    Lanes,
    /// What encoding 1's prediction from the last quad's departure leaves: smaller where the surface
    /// is curved.
    Bending,
    /// The same where the last quad's slopes are expected to stay.
    Following,
}

impl Mode {
    pub const ALL: [Self; 4] = [Self::Plain, Self::Lanes, Self::Bending, Self::Following];

    /// By number.
    pub fn of(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }
}

/// The departure of a group's last quad, from which that of the next follows.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Departure {
    pub mode: Mode,
    last: Context,
}

impl Departure {
    /// That of a run's first quad: none.
    pub fn start(mode: Mode, x: u8, y: u8) -> Self {
        let mut last = Context::default();
        let none = [Wrapping(0); 2];
        last.learn(x.into(), y.into(), none, Derivatives::default(), false);
        Self { mode, last }
    }

    /// What is expected of dx, dy and cross.
    #[inline(always)]
    fn guess(&self, x: i32, y: i32) -> Derivatives {
        if self.mode == Mode::Bending {
            self.last.derivatives(x, y)
        } else {
            self.last.last()
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
            Mode::Bending | Mode::Following => {
                let (x, y) = (x.into(), y.into());
                let guess = self.guess(x, y);
                let now = Derivatives {
                    dx: plus(guess.dx, dx),
                    dy: plus(guess.dy, dy),
                    cross: plus(guess.cross, cross),
                };
                let uv = plus(self.last.uv(x, y, &now), uv);
                self.last.learn(x, y, uv, now, true);
                [plain(uv), plain(now.dx), plain(now.dy), plain(now.cross)]
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
            Mode::Bending | Mode::Following => {
                let (x, y) = (x.into(), y.into());
                let guess = self.guess(x, y);
                let [as_uv, dx, dy, cross] = quad.map(|[u, v]| [Wrapping(u), Wrapping(v)]);
                let now = Derivatives { dx, dy, cross };
                let guess_uv = self.last.uv(x, y, &now);
                self.last.learn(x, y, as_uv, now, true);
                [
                    minus(uv, plain(guess_uv)),
                    minus(plain(dx), plain(guess.dx)),
                    minus(plain(dy), plain(guess.dy)),
                    minus(plain(cross), plain(guess.cross)),
                ]
            }
        }
    }
}

#[inline(always)]
fn plus([a, b]: [Wrapping<i32>; 2], [c, d]: Pair) -> [Wrapping<i32>; 2] {
    [a + Wrapping(c), b + Wrapping(d)]
}

#[inline(always)]
fn plain([u, v]: [Wrapping<i32>; 2]) -> Pair {
    [u.0, v.0]
}

#[inline(always)]
fn minus([a, b]: Pair, [c, d]: Pair) -> Pair {
    [a.wrapping_sub(c), b.wrapping_sub(d)]
}
