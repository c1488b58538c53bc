//! What one frame draws: its light, its layers, and which draws enter each of them.

use super::backend::View;
use super::draws::{DrawList, DrawMode};
use super::lighting::Lighting;
use super::skips::Skipped;
use techniques::{FramePlan, Stage};

/// One frame, ready to be drawn.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Lights, with the shadow cascades fitted to the frame.
    pub lighting: Lighting,
    /// Draws that each shadow cascade may see.
    pub casters: Vec<Vec<u32>>,
    /// Which shadow cascades may be looked up; the others need not be rendered.
    pub cascades_seen: Vec<bool>,
    /// The layers, and how the pictures come of them.
    pub plan: FramePlan,
    /// Draws that each layer may see.
    pub(crate) visible: Vec<Vec<u32>>,
    /// What nobody sees of it and has been left out.
    pub skipped: Skipped,
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
                let mut visible = draws.visible(layer.drawn_from_world());
                visible.retain(|&draw| {
                    let call = &draws.calls[draw as usize];
                    enters(layer.draws, call.mode) && layer.may_draw(call.bounds)
                });
                visible
            })
            .collect();
        let cascades_seen = vec![true; lighting.cascades.len()];
        Self {
            lighting,
            casters,
            cascades_seen,
            plan,
            visible,
            skipped: Skipped::default(),
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
