//! Values by time between the keys of an animation (glTF 2.0, appendix C).

use crate::paths::bracket;
use glam::{DAffine3, DQuat, DVec3, DVec4};

/// Interpolation between keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interpolation {
    /// Linear, rotations along the shorter arc.
    Linear,
    /// The value of the previous key.
    Step,
    /// Hermite splines. Each key has an incoming tangent, a value and an outgoing tangent.
    Cubic,
}

impl Interpolation {
    /// Number of values per key.
    pub fn values_per_key(self) -> usize {
        match self {
            Self::Cubic => 3,
            Self::Linear | Self::Step => 1,
        }
    }
}

/// Weights of a key's value, its outgoing tangent, the next key's incoming tangent and the next key's
/// value at the fraction `t` of the `step` seconds between the keys. Tangents are per second.
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
    /// Seconds, ascending or equal; at least one.
    pub times_s: Vec<f64>,
    /// One per key, or three with [`Interpolation::Cubic`].
    pub values: Vec<DVec4>,
}

impl Curve {
    /// The value at a time, clamped to the first and the last key.
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
    /// Seconds, ascending or equal; at least one.
    pub times_s: Vec<f64>,
    /// Rows of one weight per target; as many rows as [`Curve::values`] has values.
    pub values: Vec<f64>,
    pub targets: usize,
}

impl WeightCurve {
    /// The weights at a time, one per target.
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

/// The property that a curve animates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channel {
    Translation,
    Rotation,
    Scale,
}

/// A node and its animation curves.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Its transform without animation.
    pub(crate) rest: DAffine3,
    /// Translation, rotation and scale without animation.
    pub(crate) parts: (DVec3, DQuat, DVec3),
    pub(crate) curves: Vec<(Channel, Curve)>,
}

impl Joint {
    /// The transform to the parent's space.
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
