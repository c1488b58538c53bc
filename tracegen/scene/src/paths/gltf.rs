//! A camera animated by a glTF file.

use super::keys::bracket;
use crate::SceneError;
use crate::files::Origin;
use glam::{DAffine3, DMat3, DQuat, DVec3, DVec4};
use std::path::{Path, PathBuf};

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

/// Values by time: translations and scales in xyz, rotations as xyzw.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub interpolation: Interpolation,
    /// Seconds, ascending; at least one.
    pub times_s: Vec<f64>,
    /// One per key, or three with [`Interpolation::Cubic`].
    pub values: Vec<DVec4>,
}

/// The property that a curve moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channel {
    Translation,
    Rotation,
    Scale,
}

/// A node on the path from the root to the camera.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Its transform without animation.
    pub(crate) rest: DAffine3,
    /// Translation, rotation and scale without animation.
    pub(crate) parts: (DVec3, DQuat, DVec3),
    pub(crate) curves: Vec<(Channel, Curve)>,
}

/// An animated camera's pose by time.
#[derive(Clone, Debug)]
pub struct CameraTrack {
    pub(crate) file: PathBuf,
    pub(crate) camera: String,
    /// The point that poses are relative to.
    pub(crate) origin: DVec3,
    /// From the root down to the camera's node.
    pub(crate) joints: Vec<Joint>,
    /// First and last key of all curves, seconds.
    pub(crate) span_s: [f64; 2],
}

impl Curve {
    pub(crate) fn at(&self, time_s: f64, is_rotation: bool) -> DVec4 {
        let (key, t) = bracket(&self.times_s, time_s);
        let last = self.times_s.len() - 1;
        let next = (key + 1).min(last);
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
                // glTF 2.0, appendix C: tangents are per second.
                let step = self.times_s[next] - self.times_s[key];
                let (value, out) = (self.values[3 * key + 1], self.values[3 * key + 2]);
                let (into, next) = (self.values[3 * next], self.values[3 * next + 1]);
                let (t2, t3) = (t * t, t * t * t);
                value * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + out * (step * (t3 - 2.0 * t2 + t))
                    + next * (3.0 * t2 - 2.0 * t3)
                    + into * (step * (t3 - t2))
            }
        }
    }
}

impl Joint {
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

impl CameraTrack {
    /// The file of the track.
    #[must_use]
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Seconds from the first key to the last.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.span_s[1] - self.span_s[0]
    }

    /// The camera's pose `time_s` after the first key, without scale.
    ///
    /// # Errors
    /// The camera has no viewing direction at that time, for example because its scale is zero.
    pub fn pose(&self, time_s: f64) -> Result<DAffine3, SceneError> {
        let time_s = self.span_s[0] + time_s;
        let world = (self.joints.iter()).fold(DAffine3::IDENTITY, |parent, joint| {
            parent * joint.transform(time_s)
        });
        let back = world.matrix3.z_axis.normalize_or_zero();
        let up = world.matrix3.y_axis.normalize_or_zero();
        let right = up.cross(back);
        if !world.as_affine3a().is_finite() || right.length() < 1e-4 {
            return Err(Origin::new(&self.file).invalid(
                format!("camera '{}' at {time_s} s", self.camera),
                "a place and a direction",
                "a node that is scaled to nothing or beyond measure",
            ));
        }
        let right = right.normalize();
        let axes = DMat3::from_cols(right, back.cross(right), back);
        let place = world.translation - self.origin;
        Ok(DAffine3::from_mat3_translation(axes, place))
    }
}
