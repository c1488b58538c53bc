//! What a frame is rendered as.

use crate::Mask;
use formats::view::{Eye, EyeView};
use std::sync::Arc;

/// One rendering of a part of one eye's picture, or of both eyes': a pass of the trace.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// The eye, or `None` for a layer that both pictures are made from.
    pub eye: Option<Eye>,
    /// Number among the frame's layers of that eye: left and right layers of the same number show the same part.
    pub number: u16,
    /// Matrices, with a narrowed, shifted or clipped projection.
    pub view: EyeView,
    /// Its own size, smaller where it is coarser.
    pub size_px: [u32; 2],
    /// Pixels that may be drawn; all of them where there is none.
    pub mask: Option<Arc<Mask>>,
    /// Which draws enter it.
    pub draws: Stage,
}

impl Layer {
    /// The whole picture of an eye at its full size.
    #[must_use]
    pub fn whole(eye: Eye, view: EyeView, size_px: [u32; 2]) -> Self {
        Self {
            eye: Some(eye),
            number: 0,
            view,
            size_px,
            mask: None,
            draws: Stage::All,
        }
    }
}

/// A part of a frame's draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// Every draw.
    #[default]
    All,
    /// Draws that write depth: opaque and alpha-masked ones.
    Opaque,
    /// Blended draws.
    Transparent,
}

/// What a technique promises of a frame, to be held against what is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Predicted {
    /// Pixels that may be shaded, borders for reconstruction included, in pixels of the pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shaded_share: Option<f32>,
    /// Largest distance between a far point's place in the picture and its true place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disparity_px: Option<f32>,
    /// Distance from which on there is one picture for both eyes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub split_m: Option<f32>,
}
