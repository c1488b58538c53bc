//! The quantity that `--auto` minimises under a budget.

use crate::study::counted::Counted;
use clap::ValueEnum;
use formats::text::name_of;
use serde::{Deserialize, Serialize};

/// The cost of a frame that is minimised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Objective {
    /// Frame time on this device, which varies between runs.
    Time,
    /// Shaded fragments, counted.
    Fragments,
    /// Memory traffic, counted: textures, vertices, pictures, uploads.
    Bytes,
    /// Energy of the counted traffic, fragments and vertices.
    #[default]
    Energy,
}

impl Objective {
    /// Name as on the command line.
    pub fn name(self) -> String {
        name_of(&self)
    }

    /// Unit of its cost.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::Fragments => "fragments",
            Self::Bytes => "bytes",
            Self::Energy => "mJ",
        }
    }

    /// Cost from counts; none for time.
    pub fn counted(self, counts: &Counted) -> Option<f64> {
        match self {
            Self::Time => None,
            Self::Fragments => Some(counts.fragments as f64),
            Self::Bytes => Some(counts.bytes() as f64),
            Self::Energy => Some(counts.energy_mj()),
        }
    }
}
