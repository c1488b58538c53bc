//! Values by time between the keys of an animation (glTF 2.0, appendix C).

use crate::paths::bracket;
use glam::{DAffine3, DQuat, DVec3, DVec4};

/// How values between keys come about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interpolation {
    /// Linear, rotations along the shorter arc.
    Linear,
    /// The key before.
    Step,
    /// Hermite splines; each key has a tangent before, a value and a tangent after.
    Cubic,
}

impl Interpolation {
    /// Values of a key.
    pub fn values_a_key(self) -> usize {
        match self {
            Self::Cubic => 3,
            Self::Linear | Self::Step => 1,
        }
    }
}

/// Factors of a key's value and of the tangent after it, then of the tangent before the next key and of its
/// value, at a part `t` of the `step` seconds between both. Tangents are per second.
fn hermite(t: f64, step: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        2.0 * t3 - 3.0 * t2 + 1.0,
        step * (t3 - 2.0 * t2 + t),
        step * (t3 - t2),
        3.0 * t2 - 2.0 * t3,
    ]
}

/// Values by time: translations and scales in xyz, rotations as xyzw.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub interpolation: Interpolation,
    /// Seconds, ascending; at least one.
    pub times_s: Vec<f64>,
    /// One a key, three with [`Interpolation::Cubic`].
    pub values: Vec<DVec4>,
}

impl Curve {
    /// The value at a time; before the first key and after the last one it is theirs.
    pub fn at(&self, time_s: f64, is_rotation: bool) -> DVec4 {
        let (key, t) = bracket(&self.times_s, time_s);
        let next = (key + 1).min(self.times_s.len() - 1);
        match self.interpolation {
            Interpolation::Step => self.values[key],
            Interpolation::Linear => {
                let (a, b) = (self.values[key], self.values[next]);
                if is_rotation {
                    let (a, b) = (DQuat::from_vec4(a), DQuat::from_vec4(b));
                    DVec4::from(a.slerp(b, t))
                } else {
                    a.lerp(b, t)
                }
            }
            Interpolation::Cubic => {
                let [value, after, before, last] =
                    hermite(t, self.times_s[next] - self.times_s[key]);
                self.values[3 * key + 1] * value
                    + self.values[3 * key + 2] * after
                    + self.values[3 * next + 1] * last
                    + self.values[3 * next] * before
            }
        }
    }
}

/// Weights of morph targets by time.
#[derive(Clone, Debug)]
pub(crate) struct WeightCurve {
    pub interpolation: Interpolation,
    /// Seconds, ascending; at least one.
    pub times_s: Vec<f64>,
    /// One a target, and as many rows of them as [`Curve::values`] has values.
    pub values: Vec<f64>,
    pub targets: usize,
}

impl WeightCurve {
    /// The weights at a time, one a target.
    pub fn at(&self, time_s: f64) -> Vec<f64> {
        let (key, t) = bracket(&self.times_s, time_s);
        let next = (key + 1).min(self.times_s.len() - 1);
        let row = |number: usize| &self.values[number * self.targets..][..self.targets];
        let sum = |rows: &[(usize, f64)]| {
            let of_target = |target: usize| {
                rows.iter()
                    .map(|&(number, w)| row(number)[target] * w)
                    .sum()
            };
            (0..self.targets).map(of_target).collect()
        };
        match self.interpolation {
            Interpolation::Step => row(key).to_vec(),
            Interpolation::Linear => sum(&[(key, 1.0 - t), (next, t)]),
            Interpolation::Cubic => {
                let [value, after, before, last] =
                    hermite(t, self.times_s[next] - self.times_s[key]);
                let (from, to) = (3 * key, 3 * next);
                sum(&[
                    (from + 1, value),
                    (from + 2, after),
                    (to, before),
                    (to + 1, last),
                ])
            }
        }
    }
}

/// The property that a curve moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channel {
    Translation,
    Rotation,
    Scale,
}

/// A node and what moves it.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Its transform where nothing moves it.
    pub(crate) rest: DAffine3,
    /// Translation, rotation and scale where nothing moves them.
    pub(crate) parts: (DVec3, DQuat, DVec3),
    pub(crate) curves: Vec<(Channel, Curve)>,
}

impl Joint {
    /// To the parent's space.
    pub(crate) fn transform(&self, time_s: f64) -> DAffine3 {
        if self.curves.is_empty() {
            return self.rest;
        }
        let (mut translation, mut rotation, mut scale) = self.parts;
        for (channel, curve) in &self.curves {
            let value = curve.at(time_s, *channel == Channel::Rotation);
            match channel {
                Channel::Translation => translation = value.truncate(),
                Channel::Rotation => rotation = DQuat::from_vec4(value.normalize_or(DVec4::W)),
                Channel::Scale => scale = value.truncate(),
            }
        }
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    }
}
