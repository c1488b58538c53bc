//! Properties of sampling that a replay can change.

use super::aniso::AnisotropyModel;
use crate::texture::{Filter, MipFilter, Sampler};
use serde::{Deserialize, Serialize};

/// Filter used in place of a sampler's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FilterOverride {
    /// Each sample's own sampler.
    #[default]
    AsRecorded,
    /// Linear within a level, linear between levels.
    Trilinear,
    /// Linear within the nearest level.
    Bilinear,
    /// One texel of the nearest level.
    Nearest,
}

impl FilterOverride {
    /// The sampler after the override; wrap modes and bounds of the level of detail are unchanged.
    #[must_use]
    pub fn apply(self, sampler: &Sampler) -> Sampler {
        let (filter, mip) = match self {
            Self::AsRecorded => return *sampler,
            Self::Trilinear => (Filter::Linear, MipFilter::Linear),
            Self::Bilinear => (Filter::Linear, MipFilter::Nearest),
            Self::Nearest => (Filter::Nearest, MipFilter::Nearest),
        };
        Sampler {
            mag: filter,
            min: filter,
            mip,
            ..*sampler
        }
    }
}

/// How the level of detail follows from the derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LodFormula {
    /// `fastlog2(max(|dx|^2, |dy|^2)) / 2`, as llvmpipe.
    #[default]
    Llvmpipe,
    /// `log2` of the largest absolute component, as softpipe.
    Softpipe,
    /// As llvmpipe with the exact logarithm.
    Exact,
    /// The exact logarithm of each lane's own derivatives: no level is shared by a quad.
    PerLane,
}

/// Everything about sampling that is not in the trace.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SamplingOptions {
    /// Filter.
    pub filter: FilterOverride,
    /// Added to the level of detail.
    pub lod_bias: f32,
    /// Level-of-detail formula.
    pub lod: LodFormula,
    /// Helper lanes of partly covered quads read, too.
    pub helper_lanes: bool,
    /// Footprints of a long and narrow pixel at most, 2 to 16; 1, the default, filters all pixels alike.
    #[serde(skip_serializing_if = "is_one")]
    pub max_anisotropy: u32,
    /// How long and narrow pixels are filtered where `max_anisotropy` is above 1; `"probes"` by default.
    #[serde(skip_serializing_if = "is_default")]
    pub anisotropy: AnisotropyModel,
}

impl Default for SamplingOptions {
    fn default() -> Self {
        Self {
            filter: FilterOverride::default(),
            lod_bias: 0.0,
            lod: LodFormula::default(),
            helper_lanes: false,
            max_anisotropy: 1,
            anisotropy: AnisotropyModel::default(),
        }
    }
}

// Defaults are not written, so results from before anisotropy existed are unchanged.
fn is_one(value: &u32) -> bool {
    *value == 1
}

fn is_default(model: &AnisotropyModel) -> bool {
    *model == AnisotropyModel::default()
}
