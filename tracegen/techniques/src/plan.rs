//! A frame as layers, and how the eyes' pictures come of them.

use crate::Mask;
use crate::layer::{Layer, Predicted};
use crate::start::Start;
use glam::DMat3;
use std::sync::Arc;

/// Plan of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FramePlan {
    /// The layers, in the order in which they are rendered and written as passes.
    pub layers: Vec<Layer>,
    /// The resulting pictures: one per eye, in the order of the requested eyes.
    pub pictures: Vec<PictureSource>,
    /// Predictions of the techniques for the frame.
    pub predicted: Predicted,
}

/// Source of an eye's picture.
#[derive(Clone, Debug, PartialEq)]
pub enum PictureSource {
    /// A layer, by its position in the plan.
    Layer(usize),
    /// Parts of layers, each drawn over the ones before, on black.
    Composed {
        /// Width and height of the picture.
        size_px: [u32; 2],
        /// The parts.
        parts: Vec<PicturePart>,
    },
}

/// A part of a picture that a layer fills.
#[derive(Clone, Debug, PartialEq)]
pub struct PicturePart {
    /// Position of the layer in the plan.
    pub layer: usize,
    /// Left and top edge of the layer, in pixels of the picture.
    pub origin_px: [u32; 2],
    /// Columns and rows of the picture that a pixel of the layer covers. The layer may reach beyond
    /// the picture's right and lower edge.
    pub coarseness: [u32; 2],
    /// Tiles of the picture (16x16 pixels, one bit each) that the part fills; all if there is no mask.
    pub tiles: Option<Arc<Mask>>,
    /// Filter from the layer's pixels to the picture's.
    pub filter: Filter,
    /// Homogeneous map from pixels of the picture to pixels of the layer, in place of origin and coarseness.
    pub layer_from_px: Option<DMat3>,
}

/// Filter from a layer's pixels to a picture's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Filter {
    /// The layer has the picture's pixels: they are copied.
    Copy,
    /// Linear between the four nearest pixels of the layer, in linear light.
    Bilinear,
    /// The layer's mask leaves out 2x2 quads: their pixels are the mean of the linear interpolations
    /// along row and column between the nearest pixels that are there, in linear light. The others are copied.
    FillQuads,
    /// Linear between the four nearest pixels of a layer that the picture is mapped to by [`PicturePart::layer_from_px`], in
    /// linear light.
    Projective,
}

/// Bytes of the targets of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetBytes {
    /// Colour of the layers, and of the pictures composed of them.
    pub color: u64,
    /// Depth buffers that have to be there at a time.
    pub depth: u64,
}

/// Bytes of a pixel's colour (sRGB RGBA8), and of its depth (32 bits).
const PIXEL_BYTES: u64 = 4;

impl FramePlan {
    /// Bytes that the frame is rendered into. Passes one after the other share a depth buffer as large as the
    /// largest, but for layers whose depth a later one looks at; views that are drawn `at_once` have one each.
    #[must_use]
    pub fn target_bytes(&self, at_once: bool) -> TargetBytes {
        let bytes = |[width, height]: [u32; 2]| PIXEL_BYTES * u64::from(width) * u64::from(height);
        let looked_at = |number: usize| {
            self.layers.iter().any(|layer| match &layer.start {
                Start::Behind(openings) => openings.iter().any(|opening| opening.nearer == number),
                Start::Composed(made) => made.nearer == number || made.farther == number,
                Start::Sky | Start::Nearer { .. } => false,
            })
        };
        let composed = self.pictures.iter().map(|picture| match picture {
            PictureSource::Composed { size_px, .. } => bytes(*size_px),
            PictureSource::Layer(_) => 0,
        });
        let layers = || self.layers.iter().enumerate();
        let (kept, shared): (Vec<_>, Vec<_>) =
            layers().partition(|(number, _)| at_once || looked_at(*number));
        let sum = |list: &[(usize, &Layer)]| -> u64 {
            list.iter().map(|(_, layer)| bytes(layer.size_px)).sum()
        };
        let largest = shared.iter().map(|(_, layer)| bytes(layer.size_px)).max();
        TargetBytes {
            color: layers().map(|(_, layer)| bytes(layer.size_px)).sum::<u64>()
                + composed.sum::<u64>(),
            depth: sum(&kept) + largest.unwrap_or(0),
        }
    }

    /// Whether a layer is the unmodified picture of an eye.
    #[must_use]
    pub fn is_picture(&self, layer: usize) -> bool {
        self.pictures.contains(&PictureSource::Layer(layer))
    }
}
