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

/// Writes the test file and loads it.
pub type Load = fn(&Path) -> Result<Loaded, SceneError>;

/// Checks the scene of a feature.
pub type Check = fn(&Loaded, &str);

/// One feature.
#[derive(Clone, Copy)]
pub struct Row {
    pub feature: &'static str,
    pub status: Status,
    /// Description of the support. For a refused feature, part of the error.
    pub how: &'static str,
    /// Writes the test file and loads it.
    pub load: Load,
    /// Checks the scene.
    pub check: Check,
    /// File of the test, if it is another one than that of the row.
    pub test: &'static str,
}

impl Row {
    /// A feature with its name and support, tested in the file of its rows.
    pub const fn new(
        feature: &'static str,
        (status, how): (Status, &'static str),
        (load, check): (Load, Check),
    ) -> Self {
        Self {
            feature,
            status,
            how,
            load,
            check,
            test: "",
        }
    }
}

/// A feature that is supported as specified, tested in the file of its rows.
pub const fn drawn(feature: &'static str, how: &'static str, load: Load, check: Check) -> Row {
    Row::new(feature, (Status::Drawn, how), (load, check))
}
