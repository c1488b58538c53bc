//! A planned frame: its light, its layers, and the draws in each of them.

use super::draws::{DrawList, DrawMode};
use super::lighting::Lighting;
use super::view::View;
use std::ops::AddAssign;
use std::time::{Duration, Instant};
use techniques::{FramePlan, Stage, Start};
use visibility::{Culling, Rig, Scratch, TooWide};

/// One frame, ready to be drawn.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Its number.
    pub number: u32,
    /// Lights, with the shadow cascades fitted to the frame.
    pub lighting: Lighting,
    /// Draws that may be visible in each shadow cascade.
    pub casters: Vec<Vec<u32>>,
    /// Which shadow cascades may be looked up. The others need not be rendered.
    pub cascades_seen: Vec<bool>,
    /// The layers, and the composition of the pictures from them.
    pub plan: FramePlan,
    /// Boxes tested to find the draws of the eyes' pictures.
    pub cull_tests: u64,
    /// Boxes tested for occlusion.
    pub occlusion_tests: u64,
    /// Draws of layers that are hidden by others.
    pub occluded: u64,
    /// Time for culling.
    pub cull_time: Duration,
    /// Time for the plan, the lists of draws and what is skipped.
    pub plan_time: Duration,
    /// The eyes.
    pub rig: Rig,
    /// Draws that may be visible in each layer.
    pub(crate) visible: Vec<Vec<u32>>,
    /// Invisible work that was skipped.
    pub skipped: Skipped,
}

impl Frame {
    /// Finds the draws that may be visible in each of the plan's layers and each of the lighting's
    /// cascades, for frame `number` of the eyes of `rig`.
    ///
    /// # Errors
    /// Eyes that the culling technique does not support.
    pub fn new(
        draws: &DrawList,
        lighting: Lighting,
        plan: FramePlan,
        rig: Rig,
        culling: Culling,
        number: u32,
    ) -> Result<Self, TooWide> {
        let start = Instant::now();
        let mut kept = Vec::new();
        let cull_tests =
            (draws.hierarchy).cull(&rig, culling, number, &mut Scratch::default(), &mut kept)?;
        let cull_time = start.elapsed();
        let casters = (lighting.cascades.iter())
            .map(|cascade| draws.visible(cascade.clip_from_world))
            .collect();
        let visible = (plan.layers.iter())
            .map(|layer| {
                // An eye's own picture gets the technique's list. A part of it or another view gets
                // the draws of the list that it may see.
                let whole = rig.eyes().iter().any(|eye| eye.view == layer.view)
                    && !matches!(layer.start, Start::Nearer { .. });
                let mut visible = if whole {
                    kept.clone()
                } else {
                    draws.visible_of(&kept, layer.drawn_from_world())
                };
                visible.retain(|&draw| {
                    let call = &draws.calls[draw as usize];
                    enters(layer.draws, call.mode) && layer.may_draw(call.bounds)
                });
                visible
            })
            .collect();
        let cascades_seen = vec![true; lighting.cascades.len()];
        Ok(Self {
            number,
            lighting,
            casters,
            cascades_seen,
            plan,
            cull_tests,
            occlusion_tests: 0,
            occluded: 0,
            cull_time,
            plan_time: Duration::ZERO,
            rig,
            visible,
            skipped: Skipped::default(),
        })
    }

    /// The layers in their order, each with its draws.
    pub fn views(&self) -> impl Iterator<Item = View<'_>> {
        (0..self.plan.layers.len()).map(|number| self.view(number))
    }

    /// A layer with its draws.
    pub fn view(&self, number: usize) -> View<'_> {
        View {
            target: number,
            layer: &self.plan.layers[number],
            lighting: &self.lighting,
            visible: &self.visible[number],
        }
    }
}

/// Whether draws of a mode are drawn in a stage.
fn enters(stage: Stage, mode: DrawMode) -> bool {
    match stage {
        Stage::All => true,
        Stage::Opaque => mode != DrawMode::Blended,
        Stage::Transparent => mode == DrawMode::Blended,
    }
}

/// Work of a frame that was skipped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Skipped {
    /// Shadow cascades.
    pub cascades: u64,
}

impl AddAssign for Skipped {
    fn add_assign(&mut self, other: Self) {
        self.cascades += other.cascades;
    }
}
