//! A camera that a glTF file's animation moves.

use super::keys::bracket;
use crate::SceneError;
use crate::files::Origin;
use glam::{Affine3A, Mat3, Quat, Vec3, Vec4};
use std::path::{Path, PathBuf};

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

/// Values by time: translations and scales in xyz, rotations as xyzw.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub interpolation: Interpolation,
    /// Seconds, ascending; at least one.
    pub times_s: Vec<f64>,
    /// One a key, three with [`Interpolation::Cubic`].
    pub values: Vec<Vec4>,
}

/// The property that a curve moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channel {
    Translation,
    Rotation,
    Scale,
}

/// A node on the way from the root to the camera.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Its transform where nothing moves it.
    pub(crate) rest: Affine3A,
    /// Translation, rotation and scale where nothing moves them.
    pub(crate) parts: (Vec3, Quat, Vec3),
    pub(crate) curves: Vec<(Channel, Curve)>,
}

/// An animated camera's pose by time.
#[derive(Clone, Debug)]
pub struct CameraTrack {
    pub(crate) file: PathBuf,
    pub(crate) camera: String,
    /// From the root down to the camera's node.
    pub(crate) joints: Vec<Joint>,
    /// First and last key of all curves, seconds.
    pub(crate) span_s: [f64; 2],
}

impl Curve {
    fn at(&self, time_s: f64, is_rotation: bool) -> Vec4 {
        let (key, t) = bracket(&self.times_s, time_s);
        let t32 = t as f32;
        let last = self.times_s.len() - 1;
        let next = (key + 1).min(last);
        match self.interpolation {
            Interpolation::Step => self.values[key],
            Interpolation::Linear => {
                let (a, b) = (self.values[key], self.values[next]);
                if is_rotation {
                    let (a, b) = (Quat::from_vec4(a), Quat::from_vec4(b));
                    Vec4::from(a.slerp(b, t32))
                } else {
                    a.lerp(b, t32)
                }
            }
            Interpolation::Cubic => {
                // glTF 2.0, appendix C: tangents are per second.
                let step = (self.times_s[next] - self.times_s[key]) as f32;
                let (value, out) = (self.values[3 * key + 1], self.values[3 * key + 2]);
                let (into, next) = (self.values[3 * next], self.values[3 * next + 1]);
                let (t2, t3) = (t32 * t32, t32 * t32 * t32);
                value * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + out * (step * (t3 - 2.0 * t2 + t32))
                    + next * (3.0 * t2 - 2.0 * t3)
                    + into * (step * (t3 - t2))
            }
        }
    }
}

impl Joint {
    fn transform(&self, time_s: f64) -> Affine3A {
        if self.curves.is_empty() {
            return self.rest;
        }
        let (mut translation, mut rotation, mut scale) = self.parts;
        for (channel, curve) in &self.curves {
            let value = curve.at(time_s, *channel == Channel::Rotation);
            match channel {
                Channel::Translation => translation = value.truncate(),
                Channel::Rotation => rotation = Quat::from_vec4(value.normalize_or(Vec4::W)),
                Channel::Scale => scale = value.truncate(),
            }
        }
        Affine3A::from_scale_rotation_translation(scale, rotation, translation)
    }
}

impl CameraTrack {
    /// The file it came from.
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
    /// A camera that looks nowhere at that time, as one that is scaled to nothing.
    pub fn pose(&self, time_s: f64) -> Result<Affine3A, SceneError> {
        let time_s = self.span_s[0] + time_s;
        let world = (self.joints.iter()).fold(Affine3A::IDENTITY, |parent, joint| {
            parent * joint.transform(time_s)
        });
        let back = Vec3::from(world.matrix3.z_axis).normalize_or_zero();
        let up = Vec3::from(world.matrix3.y_axis).normalize_or_zero();
        let right = up.cross(back);
        if !world.is_finite() || right.length() < 1e-4 {
            return Err(Origin::new(&self.file).invalid(
                format!("camera '{}' at {time_s} s", self.camera),
                "a place and a direction",
                "a node that is scaled to nothing or beyond measure",
            ));
        }
        let right = right.normalize();
        let axes = Mat3::from_cols(right, back.cross(right), back);
        Ok(Affine3A::from_mat3_translation(
            axes,
            world.translation.into(),
        ))
    }
}
