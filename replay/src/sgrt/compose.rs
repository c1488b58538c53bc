//! The right image that reprojection yields.
//!
//! A traced pixel takes the traced colour, bit for bit. A reused one is put together from what the
//! hardware would have: the left eye's view-independent radiance, and view-dependent radiance that
//! it still traces for the right eye. The trace has that radiance for the right eye's true hit, so:
//!
//! - The re-test found the true triangle and only the primary hit is reused: everything after the
//!   hit is traced, so the colour is the traced one. The same holds for the sky where it is seen.
//! - The reused hit is on the same surface as the true one (same object, within a pixel): left
//!   view-independent part + right view-dependent part. With `primary` reuse this stands for
//!   shading at the left hit, whose shadows and texels are those of the left pixel.
//! - Any other hit is wrong: both parts are the left pixel's, so that the error shows.

use super::accuracy::position_error_px;
use super::detect::Decision;
use super::frame::{Frame, add};
use clap::ValueEnum;
use formats::view::Eye;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What a reused right pixel takes over from the left one.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    ValueEnum,
)]
#[serde(rename_all = "lowercase")]
pub enum Reuse {
    /// The primary hit; shadow rays are traced again.
    #[default]
    Primary,
    /// And the outcome of its shadow rays.
    Shadow,
    /// And the final colour where the material looks alike from everywhere.
    Color,
}

impl Reuse {
    /// All levels, least first.
    pub const ALL: [Self; 3] = [Self::Primary, Self::Shadow, Self::Color];
}

/// Farthest that a reused hit may lie from the true one to count as the same spot, in pixels.
pub const SAME_SPOT_PX: f32 = 1.0;

/// Colours of the right samples, linear RGB.
#[must_use]
pub fn compose(frame: &Frame, decisions: &[Decision], reuse: Reuse) -> Vec<[f32; 3]> {
    let eye = frame.tables.camera(Eye::Right);
    decisions
        .par_iter()
        .zip(&frame.right().samples)
        .map(|(decision, truth)| {
            if !decision.class.is_reused() {
                return truth.color();
            }
            let left = &frame.left().samples[decision.source as usize];
            let same_hit = decision.primitive == truth.primitive
                && (decision.exact.is_some() || truth.is_sky());
            if same_hit && (reuse == Reuse::Primary || truth.is_sky()) {
                return truth.color();
            }
            let same_spot = left.object == truth.object
                && (same_hit || position_error_px(eye, decision, left, truth) <= SAME_SPOT_PX);
            let view_dependent = if same_spot {
                truth.view_dependent
            } else {
                left.view_dependent
            };
            add(left.view_independent, view_dependent)
        })
        .collect()
}
