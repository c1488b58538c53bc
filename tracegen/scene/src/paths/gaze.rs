//! Recorded gaze directions.

use super::table;
use crate::SceneError;
use crate::files::Origin;
use std::path::Path;

/// The header of a file of gazes: degrees to the right of and above straight ahead.
const COLUMNS: [&str; 3] = ["time_s", "x_deg", "y_deg"];

/// Largest angle from straight ahead that a gaze can have.
const MAX_DEG: f64 = 90.0;

/// The gaze direction at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GazeRow {
    /// Seconds from the first row, ascending.
    pub time_s: f64,
    /// Degrees to the right of straight ahead.
    pub x_deg: f64,
    /// Degrees above straight ahead.
    pub y_deg: f64,
}

/// Reads a CSV file with the header `time_s,x_deg,y_deg`; there is at least one row.
///
/// # Errors
/// A file that cannot be read; otherwise the first invalid line and column.
pub fn read_gazes(file: &Path) -> Result<Vec<GazeRow>, SceneError> {
    let rows = table::read(file, COLUMNS)?;
    let start_s = rows.first().map_or(0.0, |row| row.values[0]);
    let gaze = |table::Row { line, values }: table::Row<3>| {
        let [time_s, x_deg, y_deg] = values;
        for (angle, column) in [x_deg, y_deg].into_iter().zip(&COLUMNS[1..]) {
            if angle.abs() >= MAX_DEG {
                return Err(Origin::new(file).invalid(
                    format!("line {line}, column {column}"),
                    format!("an angle of less than {MAX_DEG} degrees"),
                    format!("{angle}"),
                ));
            }
        }
        Ok(GazeRow {
            time_s: time_s - start_s,
            x_deg,
            y_deg,
        })
    };
    rows.into_iter().map(gaze).collect()
}
