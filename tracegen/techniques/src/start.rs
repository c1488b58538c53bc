//! Initial contents of a layer.

use glam::{Mat3, Mat4};

/// Initial contents of a layer.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Start {
    /// The sky at the far plane.
    #[default]
    Sky,
    /// Nothing; and nothing is drawn from a depth on.
    Nearer {
        /// The depth, in the layer's clip space.
        end: f32,
    },
    /// The sky, where nearer layers leave it open; nothing is drawn elsewhere.
    Behind([Opening; 2]),
    /// A nearer layer of the same view, and what is behind it from a layer of another one.
    Composed(Composition),
}

/// What a nearer layer leaves open of a farther one: pixels without a draw, and those around them from
/// which they are interpolated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// Position of the nearer layer in the plan.
    pub nearer: usize,
    /// Depth of its pixels without a draw.
    pub end: f32,
    /// Pixels of this layer to pixels of the nearer one, homogeneous.
    pub nearer_from_px: Mat3,
    /// Margin in pixels of the nearer layer that is examined on each side.
    pub reach_px: u32,
}

/// Composition of a nearer and a farther layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Composition {
    /// Position of the nearer layer in the plan.
    pub nearer: usize,
    /// Depth of its pixels without a draw.
    pub end: f32,
    /// Position of the farther layer in the plan.
    pub farther: usize,
    /// Pixels of this layer to pixels of the farther one, homogeneous.
    pub farther_from_px: Mat3,
    /// Clip space of the farther layer to that of this one.
    pub from_farther_clip: Mat4,
}
