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
    /// The sampler after the override; wrap modes, anisotropy and bounds of the level of detail are unchanged.
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
    /// Footprints of a long and narrow pixel at most, 2 to 16, or 1, which filters all pixels alike. Without it,
    /// as each sample's own sampler; those of scenes have 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_anisotropy: Option<u32>,
    /// How long and narrow pixels are filtered where the largest anisotropy is above 1; `"probes"` by default.
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
            max_anisotropy: None,
            anisotropy: AnisotropyModel::default(),
        }
    }
}

impl SamplingOptions {
    /// Largest anisotropy of a sampler: the recorded one, or the replay's. A replay's does not change samplers that
    /// were recorded isotropic and do not blend texels or have no levels, such as those of shadow maps.
    pub fn max_anisotropy(&self, sampler: &Sampler) -> f32 {
        match self.max_anisotropy {
            Some(most) if sampler.blends_levels() || sampler.is_anisotropic() => most as f32,
            Some(_) => 1.0,
            None => sampler.max_anisotropy(),
        }
    }

    /// Whether quads of a sampler may have more than one footprint per lane and level.
    pub fn is_anisotropic(&self, sampler: &Sampler) -> bool {
        self.max_anisotropy(sampler) > 1.0
    }
}

// Defaults are not written, so results from before anisotropy existed are unchanged.

fn is_default(model: &AnisotropyModel) -> bool {
    *model == AnisotropyModel::default()
}
