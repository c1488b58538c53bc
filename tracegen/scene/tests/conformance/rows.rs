//! A row of the table of features.

use scene::{Loaded, SceneError};
use std::path::Path;

/// What becomes of a feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// As its specification says.
    Drawn,
    /// Simplified, as the row says how.
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
    /// How it is read; of a refused one, what the error says.
    pub how: &'static str,
    /// Writes the test file and loads it.
    pub load: fn(&Path) -> Result<Loaded, SceneError>,
    /// Checks the scene.
    pub check: fn(&Loaded, &str),
    /// File of the test, and of the check of values where that is another.
    pub test: &'static str,
}
