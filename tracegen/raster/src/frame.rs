//! What one frame draws: its light, its views, and which draws enter each of them.

use super::backend::{View, clip_from_world};
use super::draws::DrawList;
use super::lighting::Lighting;
use formats::view::EyeView;

/// One frame, ready to be drawn. Views are a list: one eye, two, or more.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Lights, with the shadow cascades fitted to the frame.
    pub lighting: Lighting,
    /// Draws that each shadow cascade may see.
    pub casters: Vec<Vec<u32>>,
    /// Camera of each view and the draws that it may see.
    views: Vec<(EyeView, Vec<u32>)>,
}

impl Frame {
    /// Finds the draws that each of `views` and each of the lighting's cascades may see.
    #[must_use]
    pub fn new(draws: &DrawList, lighting: Lighting, views: &[EyeView]) -> Self {
        let casters = (lighting.cascades.iter())
            .map(|cascade| draws.visible(cascade.clip_from_world))
            .collect();
        let views = (views.iter())
            .map(|eye| (*eye, draws.visible(clip_from_world(eye))))
            .collect();
        Self {
            lighting,
            casters,
            views,
        }
    }

    /// The views in their order.
    pub fn views(&self) -> impl Iterator<Item = View<'_>> {
        self.views.iter().map(|(eye, visible)| View {
            eye: *eye,
            lighting: &self.lighting,
            visible,
        })
    }
}
