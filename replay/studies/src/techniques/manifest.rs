//! The manifest of techniques as the study reads it.

use formats::technique_study;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// The whole manifest.
pub type Manifest = technique_study::Manifest<ManifestRow, Auto>;

/// A technique, or a combination of techniques.
pub type ManifestRow = technique_study::Row;

/// One frame of a technique.
pub type Frame = technique_study::Frame;

/// A search for the cheapest techniques within a budget.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Auto {
    /// The budget.
    pub budget: Value,
    /// Chosen settings.
    pub chosen: Value,
    /// Reason of the choice.
    pub reason: String,
    /// Frames used by the search.
    #[serde(default)]
    pub search_frames: Vec<u32>,
    /// Frames used to check the result.
    #[serde(default)]
    pub held_frames: Vec<u32>,
}

/// The numeric entries of a map, in its order.
pub fn numbers(map: &Map<String, Value>) -> impl Iterator<Item = (&str, f64)> {
    map.iter()
        .filter_map(|(key, value)| Some((key.as_str(), value.as_f64()?)))
}
