//! A frame as layers, and how the eyes' pictures come of them.

use crate::Mask;
use crate::layer::{Layer, Predicted};
use std::sync::Arc;

/// How one frame is rendered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FramePlan {
    /// The layers, in the order in which they are rendered and written as passes.
    pub layers: Vec<Layer>,
    /// The pictures that they become: one an eye, in the order of the eyes asked for.
    pub pictures: Vec<Picture>,
    /// What the techniques promise of the frame.
    pub predicted: Predicted,
}

/// Where an eye's picture comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Picture {
    /// It is a layer, by its position in the plan.
    Layer(usize),
    /// Parts of layers, each drawn over the ones before, on black.
    Composed {
        /// Width and height of the picture.
        size_px: [u32; 2],
        /// The parts.
        parts: Vec<Part>,
    },
}

/// A part of a picture that a layer fills.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Position of the layer in the plan.
    pub layer: usize,
    /// Left and top edge of the layer, in pixels of the picture.
    pub origin_px: [u32; 2],
    /// Columns and rows of the picture that a pixel of the layer covers. The layer may reach beyond
    /// the picture's right and lower edge.
    pub coarseness: [u32; 2],
    /// Tiles of the picture (16x16 pixels, a bit each) that the part fills; all where there is none.
    pub tiles: Option<Arc<Mask>>,
    /// How its pixels come of the layer's.
    pub filter: Filter,
}

/// How a picture's pixels come of a layer's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Filter {
    /// The layer has the picture's pixels: they are copied.
    Copy,
    /// Linear between the four nearest pixels of the layer, in linear light.
    Bilinear,
    /// The layer's mask leaves out 2x2 quads: their pixels are the mean of the linear interpolations
    /// along row and column between the nearest pixels that are there, in linear light. The others are copied.
    FillQuads,
}

impl FramePlan {
    /// Whether a layer is the picture of an eye as it is.
    #[must_use]
    pub fn is_picture(&self, layer: usize) -> bool {
        self.pictures.contains(&Picture::Layer(layer))
    }
}
