//! Composes the right image of reprojection.
//!
//! A traced pixel has the traced colour, bit for bit. A reused pixel combines what the hardware would have:
//! the left eye's view-independent radiance, and view-dependent radiance that is still traced for the right
//! eye. The trace has the latter for the right eye's true hit. There are three cases:
//!
//! - The re-test found the true triangle, and the shadows are those of the right eye's own hit: their rays are
//!   traced, or the reused outcomes are the same. Shading then gives the traced colour. This also applies to
//!   visible sky.
//! - The reused hit is on the same surface as the true one (same object, within a pixel). The colour is the
//!   left view-independent part plus the right view-dependent part. With `primary` reuse this approximates
//!   shading at the left hit, with the shadows and texels of the left pixel.
//! - The hit is wrong. Both parts are those of the left pixel, so that the error is visible.

use super::accuracy::position_error_px;
use super::detect::Decision;
use super::frame::{Frame, add};
use formats::view::Eye;
use rayon::prelude::*;

sim::choices! { Reuse = "What a right pixel reuses from a left one.", default Primary:
    Primary = "primary", "The primary hit; shadow rays are traced again.";
    Shadow = "shadow", "Also the results of its shadow rays.";
    Color = "color", "Also the final colour, if the material looks the same from everywhere.";
    Pixel = "pixel", "The final colour, reflections and refractions included.";
}

/// Maximum distance between the reused and the true hit to count as the same spot, in pixels.
const SAME_SPOT_PX: f32 = 1.0;

/// Colours of the right samples, linear RGB.
pub fn compose(frame: &Frame, decisions: &[Decision], reuse: Reuse) -> Vec<[f32; 3]> {
    let eye = frame.tables.camera(Eye::Right);
    decisions
        .par_iter()
        .zip(&frame.right().samples)
        .enumerate()
        .map(|(index, (decision, truth))| {
            if !decision.class.is_reused() {
                return truth.color();
            }
            let left = &frame.left().samples[decision.source as usize];
            let same_hit = decision.primitive == truth.primitive
                && (decision.exact.is_some() || truth.is_sky());
            if reuse == Reuse::Pixel && !truth.is_sky() {
                return left.color();
            }
            let outcomes = |eye: usize, at: usize| {
                let work = &frame.eyes[eye].work[at];
                (work.shadow_outcomes(), work.occlusion_blocked)
            };
            let true_shadows = reuse == Reuse::Primary
                || decision.retraces_shadows
                || (reuse == Reuse::Shadow
                    && outcomes(0, decision.source as usize) == outcomes(1, index));
            if same_hit && (true_shadows || truth.is_sky()) {
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
