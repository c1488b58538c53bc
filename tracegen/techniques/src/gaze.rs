//! The direction of the gaze.

use formats::view::Hmd;
use glam::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// Direction of the gaze in degrees to the right and up from straight ahead, the same for both eyes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Gaze {
    /// The same in every frame.
    Fixed([f32; 2]),
    /// Samples by ascending time; interpolated linearly, and constant before the first and after the last.
    Path(Vec<GazeSample>),
}

/// One sample of a gaze path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GazeSample {
    /// Time since the first frame.
    pub time_s: f32,
    /// Degrees to the right and up of straight ahead.
    pub deg: [f32; 2],
}

impl Default for Gaze {
    fn default() -> Self {
        Self::Fixed([0.0; 2])
    }
}

impl Gaze {
    /// Degrees to the right and up of straight ahead at a time.
    pub fn at(&self, time_s: f32) -> [f32; 2] {
        let samples = match self {
            Self::Fixed(deg) => return *deg,
            Self::Path(samples) => samples,
        };
        let after = samples.partition_point(|sample| sample.time_s <= time_s);
        match (after.checked_sub(1).map(|i| samples[i]), samples.get(after)) {
            (Some(a), Some(b)) => {
                let t = (time_s - a.time_s) / (b.time_s - a.time_s);
                [0, 1].map(|axis| a.deg[axis] + t * (b.deg[axis] - a.deg[axis]))
            }
            (Some(held), None) => held.deg,
            (None, first) => first.map_or([0.0; 2], |first| first.deg),
        }
    }

    /// All directions that define it.
    pub(crate) fn directions(&self) -> Vec<[f32; 2]> {
        match self {
            Self::Fixed(deg) => vec![*deg],
            Self::Path(samples) => samples.iter().map(|sample| sample.deg).collect(),
        }
    }
}

/// Whether the angles are valid: less than 90 degrees to each side.
pub(crate) fn is_ahead(deg: [f32; 2]) -> bool {
    deg.iter().all(|angle| (-89.9..=89.9).contains(angle))
}

/// Unit vector of a direction in the coordinates of an eye (0 left, 1 right) that looks along -z. The angles
/// are in degrees: to the right from straight ahead, seen from above, and up, seen from the side.
pub(crate) fn direction(hmd: &Hmd, eye: usize, deg: [f32; 2]) -> Vec3 {
    let [x, y] = deg.map(|angle| angle.to_radians().tan());
    // The left eye is rotated to the left, a positive angle about +y.
    let side = if eye == 0 { 1.0 } else { -1.0 };
    (Mat3::from_rotation_y(-side * hmd.cant_deg.to_radians()) * Vec3::new(x, y, -1.0)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_linear_between_samples_and_held_outside() {
        let sample = |time_s, x, y| GazeSample {
            time_s,
            deg: [x, y],
        };
        let path = Gaze::Path(vec![sample(1.0, 0.0, 10.0), sample(3.0, 8.0, -10.0)]);
        assert_eq!(path.at(0.0), [0.0, 10.0]);
        assert_eq!(path.at(1.0), [0.0, 10.0]);
        assert_eq!(path.at(1.5), [2.0, 5.0]);
        assert_eq!(path.at(3.0), [8.0, -10.0]);
        assert_eq!(path.at(99.0), [8.0, -10.0]);
        assert_eq!(Gaze::Path(Vec::new()).at(1.0), [0.0, 0.0]);
    }
}
