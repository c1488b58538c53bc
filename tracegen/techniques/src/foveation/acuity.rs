//! The coarsest shading that the eye cannot tell from the display's own pixels.
//!
//! The smallest cycle that the eye resolves grows linearly with the angle e from the gaze (Guenter et al.,
//! Foveated 3D graphics, 2012): `m e + 1/48` degrees, m being 1.32 to 1.65 minutes of arc per degree. Shading
//! every n-th pixel shows cycles of 2 n pixels; where those are no larger, nothing is lost.

use super::rings::COARSENESS;
use crate::settings::Rates;
use formats::view::Hmd;

/// The cautious end of the published slopes, degrees per degree.
const SLOPE: f64 = 1.32 / 60.0;
/// Smallest cycle at the gaze, degrees.
const SMALLEST_CYCLE_DEG: f64 = 1.0 / 48.0;

impl Rates {
    /// The angles from which on each rate loses nothing that the eye resolves, for a display's pixels straight
    /// ahead, where they span the largest angle.
    #[must_use]
    pub fn of_acuity(hmd: &Hmd) -> Self {
        let pixel_deg = |axis: usize| {
            let spans = hmd.fov.map(|fov| match axis {
                0 => fov.left + fov.right,
                _ => fov.up + fov.down,
            });
            let span = f64::from(spans[0].max(spans[1]));
            (span / f64::from(hmd.eye_size_px[axis])).atan().to_degrees()
        };
        let pixel_deg = [pixel_deg(0), pixel_deg(1)];
        let mut edges_deg = [0.0_f32; 4];
        for (edge, coarseness) in edges_deg.iter_mut().zip(&COARSENESS[1..]) {
            let cycle = |axis: usize| 2.0 * f64::from(coarseness[axis]) * pixel_deg[axis];
            let angle = (cycle(0).max(cycle(1)) - SMALLEST_CYCLE_DEG) / SLOPE;
            *edge = angle.clamp(0.0, 180.0) as f32;
        }
        Self { edges_deg }
    }
}
