//! A frame as layers, and how the eyes' pictures come of them.

use crate::layer::{Layer, Predicted};
use crate::{Mask, Settings};
use formats::view::{Eye, FrameViews, Hmd};
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
    /// Parts of layers, each drawn over the ones before.
    Composed(Vec<Part>),
}

/// A part of a picture that a layer fills.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Position of the layer in the plan.
    pub layer: usize,
    /// Left and top edge, in pixels of the picture, of the rectangle that the whole layer covers.
    pub origin_px: [u32; 2],
    /// Width and height of that rectangle; it may reach beyond the picture's right and lower edge.
    pub covers_px: [u32; 2],
    /// Tiles of the picture (16x16 pixels, a bit each) that the part fills; all where there is none.
    pub tiles: Option<Arc<Mask>>,
    /// How its pixels come of the layer's.
    pub filter: Filter,
}

/// How a picture's pixels come of a layer's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The layer has the picture's pixels: they are copied.
    Copy,
    /// Linear between the four nearest pixels of the layer, in linear light.
    Bilinear,
}

impl FramePlan {
    /// Plans a frame of the eyes asked for; `settings` have been checked.
    #[must_use]
    pub fn new(_settings: &Settings, hmd: &Hmd, eyes: &[Eye], views: &FrameViews) -> Self {
        let whole = |eye: &Eye| Layer::whole(*eye, views.eyes[*eye as usize], hmd.eye_size_px);
        Self {
            layers: eyes.iter().map(whole).collect(),
            pictures: (0..eyes.len()).map(Picture::Layer).collect(),
            predicted: Predicted::default(),
        }
    }

    /// Every layer is the picture of an eye: nothing has to be composed.
    #[must_use]
    pub fn is_direct(&self) -> bool {
        (self.pictures.iter()).all(|picture| matches!(picture, Picture::Layer(_)))
    }
}
