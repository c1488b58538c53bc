//! Level of detail and layer of a lane whose shader specifies them.

use super::{LevelSelection, select_levels};
use crate::textrace::{LodRule, QuadRecord, Sample, SampleLevel};
use crate::texture::{Sampler, Texture};

/// Level of detail and layer that one lane reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneLevel {
    /// Level of detail, before the sampler's bias and bounds.
    pub lod: f32,
    /// Array layer.
    pub layer: u16,
}

impl SampleLevel {
    /// The bias or level that applies to every fragment.
    #[must_use]
    pub fn lod(&self) -> f32 {
        f32::from(self.lod_256ths) / 256.0
    }
}

impl LaneLevel {
    /// Level and layer from a lane's operands, if it has any. `derived` computes the level of detail from the
    /// derivatives.
    #[must_use]
    pub fn of(
        sample: &Sample,
        texture: &Texture,
        operands: Option<&QuadRecord>,
        lane: u32,
        derived: impl FnOnce() -> f32,
    ) -> Self {
        let (own, layer) = operands.map_or((0.0, 0), |record| record.lane_operands(lane));
        let lod = match sample.level.rule {
            LodRule::Derivatives => derived(),
            LodRule::Bias => derived() + (sample.level.lod() + own),
            LodRule::Explicit => sample.level.lod() + own,
        };
        let last = i64::from(texture.layers) - 1;
        let layer = (i64::from(sample.layer) + i64::from(layer)).clamp(0, last.max(0));
        Self {
            lod,
            layer: layer as u16,
        }
    }

    /// The levels that the lane reads.
    #[must_use]
    pub fn levels(&self, sampler: &Sampler, levels: u32) -> LevelSelection {
        select_levels(self.lod, sampler, levels)
    }
}
