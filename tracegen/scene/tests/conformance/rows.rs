//! A row of the table of features.

use scene::{Loaded, SceneError};
use std::path::Path;

/// Support of a feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Supported as specified.
    Drawn,
    /// Simplified, as the row describes.
    Approximated,
    /// The file is refused with the feature's name.
    Refused,
}

impl Status {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drawn => "drawn",
            Self::Approximated => "approximated",
            Self::Refused => "refused",
        }
    }
}

/// One feature.
#[derive(Clone, Copy)]
pub struct Row {
    pub feature: &'static str,
    pub status: Status,
    /// Description of the support. For a refused feature, part of the error.
    pub how: &'static str,
    /// Writes the test file and loads it.
    pub load: fn(&Path) -> Result<Loaded, SceneError>,
    /// Checks the scene.
    pub check: fn(&Loaded, &str),
    /// File of the test, or of the check of values if that is another one.
    pub test: &'static str,
}
