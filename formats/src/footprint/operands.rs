//! Level of detail and layer of a lane whose shader specifies them.

use crate::textrace::{LodRule, QuadRecord, Sample, SampleLevel};
use crate::texture::Texture;

/// Level of detail and layer that one lane specifies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneLevel {
    /// Level of detail, before the sampler's bias and bounds, or what is added to that of the derivatives.
    pub lod: f32,
    /// Array layer.
    pub layer: u16,
}

impl SampleLevel {
    /// The bias or level that applies to every fragment.
    pub fn lod(&self) -> f32 {
        f32::from(self.lod_256ths) / 256.0
    }
}

impl LaneLevel {
    /// Level or bias, and layer, from a lane's operands, if it has any.
    pub fn of(
        sample: &Sample,
        texture: &Texture,
        operands: Option<&QuadRecord>,
        lane: u32,
    ) -> Self {
        let (own, layer) = operands.map_or((0.0, 0), |record| record.lane_operands(lane));
        let lod = match sample.level.rule {
            LodRule::Derivatives => 0.0,
            LodRule::Bias | LodRule::Explicit => sample.level.lod() + own,
        };
        let last = i64::from(texture.layers) - 1;
        let layer = (i64::from(sample.layer) + i64::from(layer)).clamp(0, last.max(0));
        Self {
            lod,
            layer: layer as u16,
        }
    }
}
