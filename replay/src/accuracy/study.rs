//! What a study is: choices of one thing, each with its time and its error against a reference.

use super::inputs::Inputs;
use std::error::Error;

/// Why a study cannot be made.
pub type StudyError = Box<dyn Error + Send + Sync>;

/// A figure of a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Figure {
    /// Key in JSON and CSV.
    pub key: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
}

/// A figure.
pub const fn figure(key: &'static str, name: &'static str, unit: &'static str) -> Figure {
    Figure { key, name, unit }
}

/// What an error of the headline figures comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contribution {
    /// Rounding of the capture.
    Capture,
    /// Formula of the level of detail.
    Lod,
    /// Functional or timed.
    Timing,
    /// Numbers of a model that were calibrated, and thresholds.
    Calibration,
    /// Another cycle model.
    Model,
}

impl Contribution {
    /// All of them, in the order of the table of errors.
    pub const ALL: [Self; 5] = [
        Self::Capture,
        Self::Lod,
        Self::Timing,
        Self::Calibration,
        Self::Model,
    ];

    /// Heading in that table.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Capture => "capture precision",
            Self::Lod => "LOD formula",
            Self::Timing => "functional for timed",
            Self::Calibration => "calibration",
            Self::Model => "cycle model",
        }
    }

    /// Name in its file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Capture => "capture",
            Self::Lod => "lod",
            Self::Timing => "timing",
            Self::Calibration => "calibration",
            Self::Model => "model",
        }
    }
}

/// Choices of one thing; a row of [`super::STUDIES`].
pub struct Study {
    /// Short name, for files.
    pub key: &'static str,
    /// Heading.
    pub title: &'static str,
    /// What is chosen, and what errors are against.
    pub about: &'static str,
    /// What times are of.
    pub time: &'static str,
    /// The choice that the others are held against.
    pub reference: &'static str,
    /// The choice to make where nothing speaks against it.
    pub recommended: &'static str,
    /// Why.
    pub reason: &'static str,
    /// What is measured of a choice; the first one is the error that the user asks about.
    pub figures: &'static [Figure],
    /// Measures every choice; none where the inputs have nothing for this study.
    pub measure: fn(&Inputs<'_>) -> Result<Vec<Choice>, StudyError>,
}

/// A choice on a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// What is chosen.
    pub name: String,
    /// What it was measured on.
    pub scene: String,
    /// What of the headline figures' error it is; none where it is no choice of theirs.
    pub contribution: Option<Contribution>,
    /// Time over the reference's; no part of what is the same on every machine.
    pub time_ratio: Option<f64>,
    /// As [`Study::figures`].
    pub values: Vec<Option<f64>>,
}
