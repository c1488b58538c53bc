//! Compares reused hits with traced hits.

use super::detect::{Decision, PixelClass};
use super::frame::{Frame, Sample};
use formats::raytrace::EyeCamera;
use formats::view::Eye;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Pixels of a class, and their errors. Percentages elsewhere are of all right pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct ClassCounts {
    /// Samples of the class.
    pub pixels: u64,
    /// The reused hit is on another object than the true one. The sky counts as an object.
    pub wrong_object: u64,
    /// Right object, another triangle, and a position error above the first of [`POSITION_LIMITS_PX`]: the part
    /// of `position_over_1px` that is on another triangle. Another triangle within the limit is no error.
    pub wrong_primitive: u64,
    /// Right object, and a position error above the first of [`POSITION_LIMITS_PX`].
    pub position_over_1px: u64,
    /// Right object, and a position error above the second of [`POSITION_LIMITS_PX`].
    pub position_over_2px: u64,
}

/// Limits of the position error, in pixels.
const POSITION_LIMITS_PX: [f32; 2] = [1.0, 2.0];

/// Counts of all classes, and the position error of reused hits on the right object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Accuracy {
    /// Reused; a single arrival.
    pub reused: ClassCounts,
    /// Reused; the nearest of several arrivals.
    pub overlapped: ClassCounts,
    /// Traced; no arrival.
    pub missing: ClassCounts,
    /// Traced; rejected by the rule.
    pub bad: ClassCounts,
    /// Mean position error, pixels.
    pub position_mean_px: f64,
    /// 99th percentile of the position error, pixels.
    pub position_p99_px: f64,
}

impl Accuracy {
    /// Number of right samples.
    pub(super) fn total(&self) -> u64 {
        self.reused.pixels + self.overlapped.pixels + self.missing.pixels + self.bad.pixels
    }

    /// Counts of all reused samples, overlapped ones included.
    pub(super) fn all_reused(&self) -> ClassCounts {
        let (mut sum, other) = (self.reused, &self.overlapped);
        formats::add_fields!(
            sum,
            other,
            pixels,
            wrong_object,
            wrong_primitive,
            position_over_1px,
            position_over_2px
        );
        sum
    }

    /// A count as a percentage of all right samples.
    pub fn pct(&self, count: u64) -> f64 {
        if self.total() == 0 {
            return 0.0;
        }
        100.0 * count as f64 / self.total() as f64
    }
}

/// Distance between the reused and the true hit, over the pixel's width at the true hit's depth, in pixels.
/// Grazing surfaces increase it. It is zero between sky and sky, and infinite between sky and surface.
pub(super) fn position_error_px(
    eye: &EyeCamera,
    decision: &Decision,
    left: &Sample,
    truth: &Sample,
) -> f32 {
    match (decision.primitive == super::frame::SKY, truth.is_sky()) {
        (true, true) => return 0.0,
        (false, false) => {}
        _ => return f32::INFINITY,
    }
    let reused = glam::Vec3::from(decision.exact.unwrap_or(left.position));
    let actual = glam::Vec3::from(truth.position);
    let depth = (actual - glam::Vec3::from(eye.position)).dot(glam::Vec3::from(eye.forward));
    let pixel_m = depth * (eye.fov.left + eye.fov.right) / eye.size_px[0] as f32;
    reused.distance(actual) / pixel_m
}

/// Counts decisions by class, and compares reused hits with traced ones.
pub(super) fn count_errors(frame: &Frame, decisions: &[Decision]) -> Accuracy {
    let eye = frame.tables.camera(Eye::Right);
    let mut accuracy = Accuracy::default();
    // NaN marks samples without a position error.
    let errors: Vec<f32> = decisions
        .par_iter()
        .zip(&frame.right().samples)
        .map(|(decision, truth)| {
            if !decision.class.is_reused() {
                return f32::NAN;
            }
            let left = &frame.left().samples[decision.source as usize];
            position_error_px(eye, decision, left, truth)
        })
        .collect();
    for ((decision, truth), error) in decisions.iter().zip(&frame.right().samples).zip(&errors) {
        let counts = match decision.class {
            PixelClass::Reused => &mut accuracy.reused,
            PixelClass::Overlapped => &mut accuracy.overlapped,
            PixelClass::Missing => &mut accuracy.missing,
            PixelClass::Bad => &mut accuracy.bad,
        };
        counts.pixels += 1;
        if !decision.class.is_reused() {
            continue;
        }
        let left = &frame.left().samples[decision.source as usize];
        if left.object != truth.object {
            counts.wrong_object += 1;
            continue;
        }
        counts.position_over_1px += u64::from(*error > POSITION_LIMITS_PX[0]);
        counts.position_over_2px += u64::from(*error > POSITION_LIMITS_PX[1]);
        let elsewhere = *error > POSITION_LIMITS_PX[0];
        counts.wrong_primitive += u64::from(decision.primitive != truth.primitive && elsewhere);
    }
    let finite: Vec<f32> = errors.into_iter().filter(|e| e.is_finite()).collect();
    accuracy.position_mean_px = image_error::mean(&finite);
    accuracy.position_p99_px = f64::from(image_error::quantile(&finite, 0.99));
    accuracy
}
