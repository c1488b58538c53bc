//! The coarsest shading that an eye cannot distinguish from full resolution.
//!
//! The smallest cycle that the eye resolves grows linearly with the angle e from the gaze (Guenter et al.,
//! Foveated 3D graphics, 2012): `m e + 1/48` degrees, with m from 1.32 to 1.65 minutes of arc per degree.
//! Shading every n-th pixel shows cycles of 2 n pixels. If these are not larger than the smallest cycle, the
//! loss is invisible.

use super::rings::COARSENESS;
use crate::settings::Rates;
use formats::view::Hmd;

/// The lowest published slope, which is the conservative choice, in degrees per degree.
const SLOPE: f64 = 1.32 / 60.0;
/// Smallest cycle at the gaze, degrees.
const SMALLEST_CYCLE_DEG: f64 = 1.0 / 48.0;

impl Rates {
    /// The angles from which each rate has no visible loss. They are computed for the display's pixels
    /// straight ahead, which span the largest angle.
    pub fn of_acuity(hmd: &Hmd) -> Self {
        let pixel_deg = |axis: usize| {
            let spans = hmd.fov.map(|fov| match axis {
                0 => fov.left + fov.right,
                _ => fov.up + fov.down,
            });
            let span = f64::from(spans[0].max(spans[1]));
            (span / f64::from(hmd.eye_size_px[axis]))
                .atan()
                .to_degrees()
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

#[cfg(test)]
mod tests {
    use super::*;
    use formats::view::FovTangents;

    #[test]
    fn rates_start_where_their_cycles_equal_the_smallest_visible_ones() {
        let fov = FovTangents::new(1.191_753_6, 1.191_753_6, 1.191_753_6, 1.191_753_6);
        let hmd = Hmd {
            eye_size_px: [960, 960],
            fov: [fov; 2],
            ..Hmd::default()
        };
        // 7.03 pixels per degree: cycles of 4 and 8 pixels are 0.569 and 1.138 degrees.
        let edges = Rates::of_acuity(&hmd).edges_deg;
        for (edge, cycle_deg) in edges.into_iter().zip([0.569, 0.569, 1.138, 1.138]) {
            let resolved = 1.32 / 60.0 * edge + 1.0 / 48.0;
            assert!((resolved - cycle_deg).abs() < 2e-3, "{edges:?}");
        }
    }
}
