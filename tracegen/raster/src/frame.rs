//! What one frame draws: its light, its layers, and which draws enter each of them.

use super::backend::{View, clip_from_world};
use super::draws::{DrawList, DrawMode};
use super::lighting::Lighting;
use techniques::{FramePlan, Stage};

/// One frame, ready to be drawn.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Lights, with the shadow cascades fitted to the frame.
    pub lighting: Lighting,
    /// Draws that each shadow cascade may see.
    pub casters: Vec<Vec<u32>>,
    /// The layers, and how the pictures come of them.
    pub plan: FramePlan,
    /// Draws that each layer may see.
    visible: Vec<Vec<u32>>,
}

impl Frame {
    /// Finds the draws that each of the plan's layers and each of the lighting's cascades may see.
    #[must_use]
    pub fn new(draws: &DrawList, lighting: Lighting, plan: FramePlan) -> Self {
        let casters = (lighting.cascades.iter())
            .map(|cascade| draws.visible(cascade.clip_from_world))
            .collect();
        let visible = (plan.layers.iter())
            .map(|layer| {
                let mut visible = draws.visible(clip_from_world(&layer.view));
                visible.retain(|&draw| enters(layer.draws, draws.calls[draw as usize].mode));
                visible
            })
            .collect();
        Self {
            lighting,
            casters,
            plan,
            visible,
        }
    }

    /// The layers in their order, each with its draws.
    pub fn views(&self) -> impl Iterator<Item = View<'_>> {
        let layers = self.plan.layers.iter().zip(&self.visible).enumerate();
        layers.map(|(target, (layer, visible))| View {
            target,
            layer,
            lighting: &self.lighting,
            visible,
        })
    }
}

/// Whether draws of a mode belong to a stage.
fn enters(stage: Stage, mode: DrawMode) -> bool {
    match stage {
        Stage::All => true,
        Stage::Opaque => mode != DrawMode::Blended,
        Stage::Transparent => mode == DrawMode::Blended,
    }
}
