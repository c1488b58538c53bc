//! A camera animated by a glTF file.

use crate::SceneError;
use crate::animation::Joint;
use crate::files::Origin;
use glam::{DAffine3, DMat3, DVec3};
use std::path::{Path, PathBuf};

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

impl CameraTrack {
    /// The file of the track.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Seconds from the first key to the last.
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
