//! Stereo shading reuse: the right eye takes the colour of surfaces that the left eye has shaded.
//!
//! The left eye is drawn in full. Each pixel of the right eye then follows its ray through the left eye's depth buffer.
//! Where it meets one continuous surface of little contrast, it takes that surface's colour, and the surface's depth,
//! slightly nearer, as its initial depth. So the right eye's draws shade only what is in front of it, and what the left
//! eye does not show.

use crate::Mask;
use crate::error::SettingsError;
use crate::layer::{Layer, Stage};
use crate::plan::{FramePlan, PictureSource};
use crate::start::{Composition, Start};
use formats::view::{Eye, EyeView, FrameViews};
use glam::{DMat4, Mat3, Mat4};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Settings of shading reuse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct ShadingReuse {
    /// Largest difference between the left pixels that a right pixel is interpolated from: of the square roots of linear
    /// light (0 to 1), in any channel.
    pub contrast: f32,
}

impl Default for ShadingReuse {
    fn default() -> Self {
        Self { contrast: 0.02 }
    }
}

impl ShadingReuse {
    pub(crate) fn check(self) -> Result<(), SettingsError> {
        if (0.0..=1.0).contains(&self.contrast) {
            return Ok(());
        }
        Err(SettingsError {
            what: "contrast of shading reuse",
            expected: "0 to 1".into(),
            found: self.contrast.to_string(),
        })
    }
}

/// What a layer takes from the layer of another eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reuse {
    /// Index of the other eye's layer in the plan.
    pub from: usize,
    /// Clip space of this layer to that of the other one.
    pub other_from_clip: Mat4,
    /// Depth of the nearest surfaces that are looked for. Nearer ones are drawn.
    pub nearest: f32,
    /// Depth is `b / w - a` at distance w: (a, b) of this layer and of the other one.
    pub depth_of: [[f32; 2]; 2],
    /// [`ShadingReuse::contrast`].
    pub contrast: f32,
}

/// Distance of the nearest surfaces that are looked for, metres.
const NEAREST_M: f32 = 0.25;

impl Reuse {
    /// Reuse of the layer `from` of the eye `other` in the eye `view`.
    pub fn new(from: usize, other: &EyeView, view: &EyeView, settings: ShadingReuse) -> Self {
        let clip_from_world = |view: &EyeView| {
            let [world_to_eye, eye_to_clip] = [&view.world_to_eye, &view.eye_to_clip]
                .map(|m| Mat4::from_cols_array_2d(m).as_dmat4());
            eye_to_clip * world_to_eye
        };
        let other_from_clip: DMat4 = clip_from_world(other) * clip_from_world(view).inverse();
        let depth_of = [view, other].map(|view| [view.eye_to_clip[2][2], view.eye_to_clip[3][2]]);
        let [a, b] = depth_of[0];
        Self {
            from,
            other_from_clip: other_from_clip.as_mat4(),
            nearest: (b / NEAREST_M - a).clamp(0.0, 1.0),
            depth_of,
            contrast: settings.contrast,
        }
    }
}

/// Plans the left eye, the right eye that reuses it, and, if any draw is blended, these draws over the left eye's picture.
/// Blended draws are not reused, because what is behind them lies elsewhere in the other eye.
pub(crate) fn plan(
    settings: ShadingReuse,
    views: &FrameViews,
    size_px: [u32; 2],
    masks: [Option<Arc<Mask>>; 2],
    blends: bool,
) -> FramePlan {
    let of_eye = |eye: Eye| Layer {
        mask: masks[eye as usize].clone(),
        ..Layer::whole(eye, views.eyes[eye as usize], size_px)
    };
    let [left, right] = &views.eyes;
    let right = Layer {
        start: Start::Reused(Reuse::new(0, left, right, settings)),
        ..of_eye(Eye::Right)
    };
    let left = of_eye(Eye::Left);
    let (layers, pictures) = if blends {
        let opaque = Layer {
            draws: Stage::Opaque,
            ..left.clone()
        };
        let over = Layer {
            number: 1,
            draws: Stage::Transparent,
            start: Start::Composed(Composition {
                nearer: 0,
                end: 0.0,
                farther: 0,
                farther_from_px: Mat3::IDENTITY,
                from_farther_clip: Mat4::IDENTITY,
            }),
            ..left
        };
        (vec![opaque, right, over], [2, 1])
    } else {
        (vec![left, right], [0, 1])
    };
    FramePlan {
        layers,
        pictures: pictures.map(PictureSource::Layer).to_vec(),
        ..FramePlan::default()
    }
}
