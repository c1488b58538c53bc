//! A layer to render, and which of its fragments are recorded.

use super::lighting::Lighting;
use glam::Mat4;
use techniques::layer::Layer;

/// One layer to render: its camera, its light and its draws.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Position of the layer in the frame's plan, which selects its target.
    pub target: usize,
    /// Matrices, size and mask.
    pub layer: &'a Layer,
    /// Lights and shadow matrices of the frame.
    pub lighting: &'a Lighting,
    /// Draws that may be visible, as indices into the draw list, ascending.
    pub visible: &'a [u32],
}

impl View<'_> {
    /// World to clip space.
    pub fn clip_from_world(&self) -> Mat4 {
        self.layer.clip_from_world()
    }
}

/// Which fragments of a layer are recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fragments {
    /// Fragments that pass the depth test when they are drawn.
    #[default]
    DepthTested,
    /// All covered fragments, even behind other draws. The initial contents of a layer (the far
    /// plane, its mask) still limit them.
    All,
}
