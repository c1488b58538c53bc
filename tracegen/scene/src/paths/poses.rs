//! Recorded head poses.

use super::keys::bracket;
use super::table;
use crate::SceneError;
use crate::files::Origin;
use glam::{DAffine3, DQuat, DVec3};
use std::path::{Path, PathBuf};

/// The header of a file of poses. Position between the eyes in metres; the rotation, a unit
/// quaternion, turns head space (x right, y up, looking down -z) to the world's axes.
const COLUMNS: [&str; 8] = ["time_s", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"];

/// Tolerance of a quaternion's length: six decimals are far more accurate.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Largest coordinate of a position. Beyond it, 64-bit steps exceed a tenth of a micrometre.
const MAX_POSITION_M: f64 = 1e9;

/// Head poses by time.
#[derive(Clone, Debug)]
pub struct PoseTrack {
    file: PathBuf,
    /// Seconds from the first pose, ascending.
    times_s: Vec<f64>,
    pub(super) poses: Vec<(DVec3, DQuat)>,
}

impl PoseTrack {
    /// Reads a CSV file with the header `time_s,x_m,y_m,z_m,qx,qy,qz,qw`.
    ///
    /// # Errors
    /// A file that cannot be read; otherwise the first invalid line and column.
    pub fn read(file: &Path) -> Result<Self, SceneError> {
        let origin = Origin::new(file);
        let rows = table::read(file, COLUMNS)?;
        let start_s = rows.first().map_or(0.0, |row| row.values[0]);
        let mut track = Self {
            file: file.to_owned(),
            times_s: Vec::with_capacity(rows.len()),
            poses: Vec::with_capacity(rows.len()),
        };
        for table::Row { line, values } in rows {
            let [time_s, x, y, z, qx, qy, qz, qw] = values;
            let position = DVec3::new(x, y, z);
            if position.abs().max_element() > MAX_POSITION_M {
                return Err(origin.invalid(
                    format!("line {line}, columns x_m to z_m"),
                    format!("a position of at most {MAX_POSITION_M} m a coordinate"),
                    format!("{x}, {y}, {z}"),
                ));
            }
            let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
            if (rotation.length() - 1.0).abs() > UNIT_TOLERANCE {
                return Err(origin.invalid(
                    format!("line {line}, columns qx to qw"),
                    "a unit quaternion (a length of 1, to 0.001)",
                    format!("length {}", rotation.length()),
                ));
            }
            track.times_s.push(time_s - start_s);
            track.poses.push((position, rotation.normalize()));
        }
        Ok(track)
    }

    /// The file of the track.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Seconds from the first pose to the last.
    pub fn duration_s(&self) -> f64 {
        self.times_s.last().copied().unwrap_or_default()
    }

    /// The pose `time_s` after the first one: positions are interpolated linearly, rotations along
    /// the shorter arc.
    pub fn pose(&self, time_s: f64) -> DAffine3 {
        let (key, t) = bracket(&self.times_s, time_s);
        let (position, rotation) = self.poses[key];
        let (next_position, next_rotation) = self.poses.get(key + 1).unwrap_or(&self.poses[key]);
        DAffine3::from_rotation_translation(
            rotation.slerp(*next_rotation, t).normalize(),
            position.lerp(*next_position, t),
        )
    }
}
