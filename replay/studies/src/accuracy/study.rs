//! Types of a study: choices, each with its time and its error against a reference.

use super::inputs::Inputs;
use super::metric::Metric;
use sim::figure::Figure;
use std::error::Error;

/// Reason why a study failed.
pub type StudyError = Box<dyn Error + Send + Sync>;

/// Source of a headline figure's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contribution {
    /// Rounding of the capture.
    Capture,
    /// Formula of the level of detail.
    Lod,
    /// Functional or timed.
    Timing,
    /// Calibrated numbers of a model, and thresholds.
    Calibration,
    /// Another cycle model.
    Model,
}

impl Contribution {
    /// All sources, in the order of the table of errors.
    pub const ALL: [Self; 5] = [
        Self::Capture,
        Self::Lod,
        Self::Timing,
        Self::Calibration,
        Self::Model,
    ];

    /// Heading in the table of errors.
    pub fn title(self) -> &'static str {
        match self {
            Self::Capture => "capture precision",
            Self::Lod => "LOD formula",
            Self::Timing => "functional instead of timed",
            Self::Calibration => "calibration",
            Self::Model => "cycle model",
        }
    }

    /// Name in the CSV file.
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

/// A study: the alternatives of one choice. A row of [`super::STUDIES`].
pub struct Study {
    /// Short name, for files.
    pub key: &'static str,
    /// Heading.
    pub title: &'static str,
    /// What is varied, and what errors are measured against.
    pub about: &'static str,
    /// What times are measured of, and relative to what.
    pub time: &'static str,
    /// The choice that the others are compared with.
    pub reference: &'static str,
    /// The recommended choice.
    pub recommended: &'static str,
    /// Reason of the recommendation.
    pub reason: &'static str,
    /// Figures of each choice; the first one is the error.
    pub figures: &'static [Metric],
    /// Measures every choice; empty if the inputs have nothing for this study.
    pub measure: fn(&Inputs<'_>) -> Result<Vec<Choice>, StudyError>,
}

/// The measurements of a choice on a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choice {
    /// Name of the choice.
    pub name: String,
    /// Scene of the measurement.
    pub scene: String,
    /// Source of headline-figure errors that it measures, if any.
    pub contribution: Option<Contribution>,
    /// Time over the reference's; excluded from machine-independent results.
    pub time_ratio: Option<f64>,
    /// Values in the order of [`Study::figures`].
    pub values: Vec<Option<f64>>,
    /// External bytes that one sample estimates, percent of those of the whole trace.
    pub estimate_pct: Option<Figure>,
}
