//! A headset's hidden-area mesh: triangles that cover the part of each eye's picture that the lens does not
//! show.

use crate::Mask;
use crate::error::SettingsError;
use serde::{Deserialize, Serialize};

/// Maximum number of triangles per eye. Meshes of headsets have fewer than 200.
pub const MAX_TRIANGLES: usize = 100_000;

/// Largest coordinate. A mesh may extend beyond the picture.
const MAX_COORDINATE: f32 = 16.0;

/// Corners as fractions of the picture's width and height, from its left and lower edge.
pub type Triangle = [[f32; 2]; 3];

/// The hidden areas of both eyes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct HiddenMesh {
    /// Hidden triangles of the left eye's picture.
    pub left: Vec<Triangle>,
    /// Hidden triangles of the right eye's picture.
    pub right: Vec<Triangle>,
}

impl HiddenMesh {
    /// Triangles of eye 0 (left) or 1 (right).
    pub fn eye(&self, eye: usize) -> &[Triangle] {
        [&self.left, &self.right][eye]
    }

    /// Visible pixels of an eye's picture. A pixel is hidden if its centre is inside a triangle or on its
    /// edge, as on a GPU that draws the mesh before the scene.
    pub fn shown(&self, eye: usize, size_px: [u32; 2]) -> Mask {
        let [width, height] = size_px.map(|size| size as usize);
        let mut shown = vec![true; width * height];
        for triangle in self.eye(eye) {
            let corners = triangle.map(|[x, y]| {
                [
                    f64::from(x) * width as f64,
                    (1.0 - f64::from(y)) * height as f64,
                ]
            });
            // Pixels whose centre is within the triangle's bounds.
            let span = |axis: usize, size: usize| {
                let along = corners.map(|corner| corner[axis]);
                let (low, high) = along
                    .iter()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
                        (low.min(*at), high.max(*at))
                    });
                let first = (low - 0.5).ceil().clamp(0.0, size as f64) as usize;
                let end = ((high - 0.5).floor() + 1.0).clamp(first as f64, size as f64) as usize;
                first..end
            };
            for y in span(1, height) {
                for x in span(0, width) {
                    if contains(&corners, [x as f64 + 0.5, y as f64 + 0.5]) {
                        shown[y * width + x] = false;
                    }
                }
            }
        }
        Mask::new(size_px, |x, y| shown[y as usize * width + x as usize])
    }

    /// Checks every corner, and that some pixels of each eye remain visible.
    ///
    /// # Errors
    /// The first invalid value.
    pub(crate) fn check(&self, size_px: [u32; 2]) -> Result<(), SettingsError> {
        let refuse = |expected: String, found: String| SettingsError {
            what: "hidden-area mesh",
            expected,
            found,
        };
        for (eye, name) in ["left", "right"].iter().enumerate() {
            let triangles = self.eye(eye);
            if triangles.len() > MAX_TRIANGLES {
                let expected = format!("at most {MAX_TRIANGLES} triangles an eye");
                return Err(refuse(
                    expected,
                    format!("{} for the {name} eye", triangles.len()),
                ));
            }
            for (number, triangle) in triangles.iter().enumerate() {
                let fits = |at: &f32| (-MAX_COORDINATE..=MAX_COORDINATE).contains(at);
                if !triangle.as_flattened().iter().all(fits) {
                    return Err(refuse(
                        format!(
                            "coordinates from -{MAX_COORDINATE} to {MAX_COORDINATE}, in parts of the picture"
                        ),
                        format!("{triangle:?}, triangle {number} of the {name} eye"),
                    ));
                }
            }
            if self.shown(eye, size_px).first().is_none() {
                return Err(refuse(
                    "a mesh that leaves something to see".into(),
                    format!("one that hides all of the {name} eye's picture"),
                ));
            }
        }
        Ok(())
    }
}

/// Whether a point is inside a triangle of any winding, including its edges; a triangle without area contains
/// no point.
fn contains([a, b, c]: &[[f64; 2]; 3], at: [f64; 2]) -> bool {
    let side = |from: &[f64; 2], to: &[f64; 2]| {
        (to[0] - from[0]) * (at[1] - from[1]) - (to[1] - from[1]) * (at[0] - from[0])
    };
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let sides = [side(a, b), side(b, c), side(c, a)];
    area != 0.0 && sides.iter().all(|side| side * area.signum() >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of triangles from a circle to far outside.
    fn all_but_circle(center: [f64; 2], radius: [f64; 2], segments: u32) -> Vec<Triangle> {
        let at = |segment: u32, scale: f64| {
            let angle = std::f64::consts::TAU * f64::from(segment) / f64::from(segments);
            [
                (center[0] + scale * radius[0] * angle.cos()) as f32,
                (center[1] + scale * radius[1] * angle.sin()) as f32,
            ]
        };
        (0..segments)
            .flat_map(|s| {
                let [a, b] = [at(s, 1.0), at(s + 1, 1.0)];
                let [c, d] = [at(s, 4.0), at(s + 1, 4.0)];
                [[a, b, c], [b, d, c]]
            })
            .collect()
    }

    #[test]
    fn a_mesh_around_a_circle_hides_the_pixels_outside() {
        let size_px = [200, 160];
        // 70 pixels around a point on the right of the middle and below it; v counts upwards.
        let (center_px, radius_px) = ([110.0, 90.0], 70.0);
        let part = [radius_px / 200.0, radius_px / 160.0];
        let hidden = all_but_circle([110.0 / 200.0, 1.0 - 90.0 / 160.0], part, 720);
        let mesh = HiddenMesh {
            left: hidden,
            right: Vec::new(),
        };
        assert_eq!(mesh.check(size_px), Ok(()));
        let shown = mesh.shown(0, size_px);
        // The polygon's edges are inside the circle by at most this distance.
        let sagitta = radius_px * (1.0 - (std::f64::consts::PI / 720.0).cos()) + 1e-3;
        let mut compared = 0;
        for y in 0..160 {
            for x in 0..200 {
                let (dx, dy) = (
                    f64::from(x) + 0.5 - center_px[0],
                    f64::from(y) + 0.5 - center_px[1],
                );
                let inside = radius_px - dx.hypot(dy);
                if inside.abs() > sagitta {
                    assert_eq!(shown.get(x, y), inside > 0.0, "{x} {y}");
                    compared += 1;
                }
            }
        }
        assert!(compared > 31_950, "{compared}");
        let area = std::f64::consts::PI * radius_px * radius_px;
        assert!((shown.count() as f64 / area - 1.0).abs() < 2e-3);
        // The other eye has no mesh.
        assert_eq!(mesh.shown(1, size_px).count(), 200 * 160);
    }

    #[test]
    fn windings_and_shared_edges_have_no_effect() {
        let (a, b, c, d) = ([0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]);
        for halves in [[[a, b, c], [a, c, d]], [[c, b, a], [d, c, a]]] {
            let mesh = HiddenMesh {
                left: halves.into(),
                right: halves.into(),
            };
            // The diagonal passes through the centres of pixels.
            assert_eq!(mesh.shown(0, [64, 64]).count(), 0);
            let error = mesh.check([64, 64]).unwrap_err().to_string();
            assert!(error.contains("hides all of the left eye's"), "{error}");
        }
        let line = HiddenMesh {
            left: vec![[a, c, c]],
            right: Vec::new(),
        };
        assert_eq!(line.shown(0, [64, 64]).count(), 64 * 64);
    }

    #[test]
    fn invalid_corners_are_refused() {
        for bad in [f32::NAN, f32::INFINITY, 17.0] {
            let mesh = HiddenMesh {
                left: Vec::new(),
                right: vec![[[0.0, 0.0], [1.0, bad], [1.0, 1.0]]],
            };
            let error = mesh.check([8, 8]).unwrap_err().to_string();
            assert!(error.contains("triangle 0 of the right eye"), "{error}");
        }
    }
}
