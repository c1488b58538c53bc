//! Distance culling: draws that are too far away or too small are not drawn.

use crate::error::SettingsError;
use formats::view::{FrameViews, Hmd};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Condition for draws that are not drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DistanceCull {
    /// Draws whose nearest point is farther away than this.
    Metres(f32),
    /// Draws whose bounding sphere would span fewer pixels in the middle of the picture.
    Pixels(f32),
}

/// The head of one frame. Both eyes leave out the same draws, because differences between the eyes are more
/// irritating.
#[derive(Clone, Copy, Debug)]
pub struct Head {
    /// Point between the eyes.
    position: Vec3,
    /// Pixels per unit of tangent, along the denser axis of the denser eye.
    px_per_tangent: f32,
}

impl Head {
    /// The head of a frame on a display.
    pub fn new(views: &FrameViews, hmd: &Hmd) -> Self {
        let [left, right] = views.eyes.map(|eye| Vec3::from_array(eye.position));
        let [width, height] = hmd.eye_size_px.map(|size| size as f32);
        let density = (hmd.fov.iter())
            .map(|fov| (width / (fov.left + fov.right)).max(height / (fov.up + fov.down)));
        Self {
            position: left.midpoint(right),
            px_per_tangent: density.fold(0.0, f32::max),
        }
    }
}

impl DistanceCull {
    /// Whether a draw with these world-space bounds is drawn.
    pub fn keeps(&self, head: &Head, [low, high]: [Vec3; 2]) -> bool {
        // Draws without finite bounds are drawn.
        match *self {
            Self::Metres(farthest) => {
                let nearest = head.position.clamp(low, high);
                let distance = nearest.distance(head.position);
                distance <= farthest || distance.is_nan()
            }
            Self::Pixels(least) => {
                let distance = low.midpoint(high).distance(head.position);
                let radius = low.distance(high) / 2.0;
                // The sine of half the angle under which it is seen is radius / distance.
                let tangent = radius / (distance * distance - radius * radius).sqrt();
                let px = 2.0 * tangent * head.px_per_tangent;
                distance <= radius || px >= least || px.is_nan()
            }
        }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        let (what, unit, limit) = match *self {
            Self::Metres(metres) => ("cull distance", "metres", metres),
            Self::Pixels(px) => ("cull size", "pixels", px),
        };
        if limit.is_finite() && limit > 0.0 {
            return Ok(());
        }
        Err(SettingsError {
            what,
            expected: format!("more than 0 {unit}"),
            found: format!("{limit} {unit}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::units;
    use formats::view::{EyeView, FovTangents};

    fn head() -> Head {
        let eye = |x| EyeView {
            position: [x, 0.0, 0.0],
            ..EyeView::default()
        };
        let fov = FovTangents::new(1.0, 1.0, 0.5, 0.5);
        let hmd = Hmd {
            eye_size_px: [400, 100],
            fov: [fov; 2],
            ..Hmd::default()
        };
        let views = FrameViews {
            frame: 0,
            eyes: [eye(-0.03), eye(0.03)],
        };
        Head::new(&views, &hmd)
    }

    #[test]
    fn the_distance_of_a_box_is_that_of_its_nearest_point() {
        let cull = DistanceCull::Metres(5.0);
        let at = |z: f32| [Vec3::new(-1.0, -1.0, -z - 3.0), Vec3::new(1.0, 1.0, -z)];
        assert!(cull.keeps(&head(), at(4.99)) && !cull.keeps(&head(), at(5.01)));
        // Off the axis, the nearest edge counts: 3-4-5.
        let corner = |x: f32| [Vec3::new(x, 0.0, -5.0), Vec3::new(9.0, 1.0, -4.0)];
        assert!(cull.keeps(&head(), corner(2.99)) && !cull.keeps(&head(), corner(3.01)));
        assert!(cull.keeps(&head(), [Vec3::NAN, Vec3::NAN]));
    }

    #[test]
    fn the_size_of_a_sphere_is_that_of_its_silhouette() {
        // 200 pixels per unit of tangent, and a cube whose corners lie on a sphere of radius 1 at 10 m.
        let half = 1.0 / 3_f32.sqrt();
        let center = Vec3::new(0.0, 6.0, -8.0);
        let bounds = [center - half, center + half];
        let px = 2.0 * 200.0 / 99_f32.sqrt();
        assert!(DistanceCull::Pixels(px - 0.01).keeps(&head(), bounds));
        assert!(!DistanceCull::Pixels(px + 0.01).keeps(&head(), bounds));
        // A box around the head.
        assert!(DistanceCull::Pixels(1e6).keeps(&head(), [Vec3::NEG_ONE, Vec3::ONE]));
        assert!(DistanceCull::Pixels(1.0).keeps(&head(), [Vec3::NAN, Vec3::NAN]));
    }

    #[test]
    fn culled_boxes_are_smaller_than_the_limit_in_the_picture() {
        let mut random = units(5);
        let (mut out, mut kept) = (0, 0);
        for _ in 0..4000 {
            let center = Vec3::new(random() - 0.5, random() - 0.5, -1.0) * (1.0 + 60.0 * random());
            let half = Vec3::new(random(), random(), random());
            let bounds = [center - half, center + half];
            if DistanceCull::Pixels(8.0).keeps(&head(), bounds) {
                kept += 1;
                continue;
            }
            out += 1;
            // Size of the box in the picture of an eye that looks at it.
            let ahead = center.normalize();
            let side = ahead.any_orthonormal_vector();
            let up = ahead.cross(side);
            let corners: Vec<_> = (0..8)
                .map(|corner| {
                    let sign = |axis: u32| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
                    let at = center + half * Vec3::new(sign(0), sign(1), sign(2));
                    200.0 / at.dot(ahead) * glam::Vec2::new(at.dot(side), at.dot(up))
                })
                .collect();
            for a in &corners {
                for b in &corners {
                    assert!(a.distance(*b) < 8.0, "{bounds:?}");
                }
            }
        }
        assert!(out > 500 && kept > 500, "{out} {kept}");
    }

    #[test]
    fn limits_must_be_positive() {
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(DistanceCull::Metres(bad).check().is_err());
            let error = DistanceCull::Pixels(bad).check().unwrap_err().to_string();
            assert!(error.contains("more than 0 pixels"), "{error}");
        }
    }
}
