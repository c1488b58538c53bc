//! Plan of a frame: its layers, and how the eyes' pictures are made from them.

use crate::Mask;
use crate::layer::{Layer, Predicted};
use crate::start::Start;
use formats::textrace::{Pass, PassKind};
use formats::view::TILE_SIZE_PX;
use glam::DMat3;
use std::sync::Arc;

/// Plan of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FramePlan {
    /// The layers, in the order in which they are rendered and written as passes.
    pub layers: Vec<Layer>,
    /// The resulting pictures, in the order of the requested eyes.
    pub pictures: Vec<PictureSource>,
    /// Predictions of the techniques for the frame.
    pub predicted: Predicted,
}

/// Source of an eye's picture.
#[derive(Clone, Debug, PartialEq)]
pub enum PictureSource {
    /// A layer, by its index in the plan.
    Layer(usize),
    /// Parts of layers, drawn one over the other on black.
    Composed {
        /// Width and height of the picture.
        size_px: [u32; 2],
        /// The parts.
        parts: Vec<PicturePart>,
    },
}

/// A part of a picture that is filled from a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct PicturePart {
    /// Index of the layer in the plan.
    pub layer: usize,
    /// Left and top edge of the layer, in pixels of the picture.
    pub origin_px: [u32; 2],
    /// Columns and rows of the picture per pixel of the layer. The layer may extend beyond the picture's
    /// right and lower edge.
    pub coarseness: [u32; 2],
    /// Tiles of the picture (16x16 pixels, one bit each) that the part fills; all if there is no mask.
    pub tiles: Option<Arc<Mask>>,
    /// Filter from the layer's pixels to the picture's.
    pub filter: Filter,
    /// Homogeneous map from pixels of the picture to pixels of the layer; replaces origin and coarseness.
    pub layer_from_px: Option<DMat3>,
}

/// Filter from a layer's pixels to a picture's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Filter {
    /// Copies pixels; the layer has the picture's resolution.
    Copy,
    /// Interpolates linearly between the four nearest pixels of the layer, in linear light.
    Bilinear,
    /// Copies pixels, and fills the quads that the layer's mask leaves out. A missing pixel is the mean of
    /// the linear interpolations along its row and its column between the nearest existing pixels, in linear
    /// light.
    FillQuads,
    /// Interpolates linearly between the four nearest pixels of the layer, in linear light, at the position
    /// given by [`PicturePart::layer_from_px`].
    Projective,
}

/// Size of the targets of a frame in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetBytes {
    /// Colour of the layers and of the pictures composed from them.
    pub color: u64,
    /// Depth buffers that exist at the same time.
    pub depth: u64,
}

/// Size of a pixel's colour (sRGB RGBA8), and of its depth (32 bits), in bytes.
const PIXEL_BYTES: u64 = 4;

impl FramePlan {
    /// Size of the targets. Consecutive passes share a depth buffer of the largest size, except layers whose
    /// depth a later layer reads. Views that are drawn `at_once` have one depth buffer each.
    pub fn target_bytes(&self, at_once: bool) -> TargetBytes {
        let bytes = |[width, height]: [u32; 2]| PIXEL_BYTES * u64::from(width) * u64::from(height);
        let is_read_later = |number: usize| {
            self.layers.iter().any(|layer| match &layer.start {
                Start::Behind(openings) => openings.iter().any(|opening| opening.nearer == number),
                Start::Composed(made) => made.nearer == number || made.farther == number,
                Start::Reused(reuse) => reuse.from == number,
                Start::Sky | Start::Nearer { .. } => false,
            })
        };
        let composed = self.pictures.iter().map(|picture| match picture {
            PictureSource::Composed { size_px, .. } => bytes(*size_px),
            PictureSource::Layer(_) => 0,
        });
        let layers = || self.layers.iter().enumerate();
        let (kept, shared): (Vec<_>, Vec<_>) =
            layers().partition(|(number, _)| at_once || is_read_later(*number));
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

    /// Render passes of frame `number`, one per layer.
    pub fn passes(&self, number: u32) -> Vec<Pass> {
        let pass = |(index, layer): (usize, &Layer)| {
            let is_main = match layer.start {
                Start::Sky => self.is_picture(index) || self.is_reused(index),
                Start::Reused(_) => true,
                _ => false,
            };
            Pass {
                frame: number,
                kind: if is_main {
                    PassKind::Main
                } else {
                    PassKind::Layer
                },
                eye: layer.eye,
                layer: if is_main { 0 } else { layer.number },
                size_px: layer.size_px,
                tiles: layer.size_px.map(|size| size.div_ceil(TILE_SIZE_PX)),
            }
        };
        self.layers.iter().enumerate().map(pass).collect()
    }

    /// Whether another eye's layer takes colours of this layer.
    pub fn is_reused(&self, layer: usize) -> bool {
        let mut starts = self.layers.iter().map(|layer| &layer.start);
        starts.any(|start| matches!(start, Start::Reused(reuse) if reuse.from == layer))
    }

    /// Whether a layer is the unmodified picture of an eye.
    pub fn is_picture(&self, layer: usize) -> bool {
        self.pictures.contains(&PictureSource::Layer(layer))
    }
}
