//! Initial contents of a layer.

use crate::shading_reuse::Reuse;
use glam::{Mat3, Mat4};

/// Initial contents of a layer.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Start {
    /// The sky at the far plane.
    #[default]
    Sky,
    /// Nothing is drawn at and beyond a depth.
    Nearer {
        /// The depth, in the layer's clip space.
        end: f32,
    },
    /// The sky in pixels that the nearer layers leave open; nothing is drawn in the others.
    Behind([Opening; 2]),
    /// A nearer layer of the same view over a farther layer of another view.
    Composed(Composition),
    /// The sky, and over it surfaces that another eye's layer has shaded.
    Reused(Reuse),
}

/// Pixels of a farther layer that a nearer layer leaves open: those without a draw, and the pixels around
/// them that are used for interpolation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// Index of the nearer layer in the plan.
    pub nearer: usize,
    /// Depth of the nearer layer's pixels without a draw.
    pub end: f32,
    /// Homogeneous map from pixels of this layer to pixels of the nearer one.
    pub nearer_from_px: Mat3,
    /// Radius of the pixels of the nearer layer that are examined.
    pub reach_px: u32,
}

/// Composition of a nearer and a farther layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Composition {
    /// Index of the nearer layer in the plan.
    pub nearer: usize,
    /// Depth of the nearer layer's pixels without a draw.
    pub end: f32,
    /// Index of the farther layer in the plan.
    pub farther: usize,
    /// Homogeneous map from pixels of this layer to pixels of the farther one.
    pub farther_from_px: Mat3,
    /// Clip space of the farther layer to that of this one.
    pub from_farther_clip: Mat4,
}
