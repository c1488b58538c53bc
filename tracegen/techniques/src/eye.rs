//! Converts pixels of an eye's picture to directions.

use crate::hidden_mesh::HiddenMesh;
use crate::{Mask, gaze};
use formats::view::{FovTangents, Hmd, Lens, TILE_SIZE_PX};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// One eye's picture: its pixels as tangents, the visible part of the lens, and the gaze.
#[derive(Clone, Debug)]
pub(crate) struct EyePicture {
    pub size_px: [u32; 2],
    fov: FovTangents,
    /// Visible part of the lens; `None` if it has no effect.
    pub lens: Option<Lens>,
    /// Pixels outside the headset's hidden-area mesh, if it replaces the lens's circle.
    left_by_mesh: Option<Arc<Mask>>,
    /// Direction of the gaze; the eye looks along -z.
    gaze: DVec3,
}

impl EyePicture {
    /// The picture of eye 0 (left) or 1 (right) of a display. The gaze is in degrees to the right and up from
    /// straight ahead.
    pub fn new(hmd: &Hmd, eye: usize, lens: Option<Lens>, gaze_deg: [f32; 2]) -> Self {
        Self {
            size_px: hmd.eye_size_px,
            fov: hmd.fov[eye],
            lens,
            left_by_mesh: None,
            gaze: gaze::direction(hmd, eye, gaze_deg).as_dvec3(),
        }
    }

    /// The same picture, masked by a mesh instead of the lens's circle.
    pub fn hidden_by(self, mesh: &HiddenMesh, eye: usize) -> Self {
        Self {
            left_by_mesh: Some(Arc::new(mesh.shown(eye, self.size_px))),
            ..self
        }
    }

    /// Tangents towards the left, right, top and bottom edge.
    fn edges(&self) -> [f32; 4] {
        [self.fov.left, self.fov.right, self.fov.up, self.fov.down]
    }

    /// Tangents to the right and up at a point in pixels from the top left.
    fn tangents(&self, px: DVec2) -> DVec2 {
        let [left, right, up, down] = self.edges();
        let part = px / DVec2::new(self.size_px[0].into(), self.size_px[1].into());
        DVec2::new(
            f64::from(left + right) * part.x - f64::from(left),
            f64::from(up) - f64::from(up + down) * part.y,
        )
    }

    /// Tangents of the left and lower edge, and of the right and upper edge, of a rectangle.
    fn rectangle(&self, low_px: [u32; 2], high_px: [u32; 2]) -> [DVec2; 2] {
        let at = |px: [u32; 2]| self.tangents(DVec2::new(px[0].into(), px[1].into()));
        let (a, b) = (at(low_px), at(high_px));
        [a.min(b), a.max(b)]
    }

    /// Whether a point of a rectangle of pixels, which ends at `high_px`, is visible through the lens.
    pub fn shows(&self, low_px: [u32; 2], high_px: [u32; 2]) -> bool {
        if let Some(left) = &self.left_by_mesh {
            let columns = || low_px[0]..high_px[0];
            return (low_px[1]..high_px[1]).any(|y| columns().any(|x| left.get(x, y)));
        }
        let Some(lens) = self.lens else { return true };
        let [low, high] = self.rectangle(low_px, high_px);
        let center = DVec2::new(lens.center[0].into(), lens.center[1].into());
        let nearest = center.clamp(low, high);
        // The rounding error of this test is much smaller than half a pixel, the distance of a pixel's centre
        // from the pixel's edge.
        nearest.distance_squared(center) <= f64::from(lens.radius) * f64::from(lens.radius)
    }

    /// Smallest angle in degrees between the gaze and a rectangle of pixels. The nearest point is the one
    /// nearest in the plane of the picture, or a corner.
    pub fn least_angle_deg(&self, low_px: [u32; 2], high_px: [u32; 2]) -> f64 {
        let [low, high] = self.rectangle(low_px, high_px);
        let corners = [
            low,
            high,
            DVec2::new(low.x, high.y),
            DVec2::new(high.x, low.y),
        ];
        let ahead = (self.gaze.z < -1e-6).then(|| {
            let at = self.gaze.truncate() / -self.gaze.z;
            at.clamp(low, high)
        });
        let angle = |at: DVec2| at.extend(-1.0).angle_between(self.gaze).to_degrees();
        (corners.into_iter().chain(ahead))
            .map(angle)
            .fold(f64::INFINITY, f64::min)
    }

    /// Position of the straight-ahead direction in the picture, in pixels from the top left.
    pub fn ahead_px(&self) -> [f64; 2] {
        let [low, high] = self.rectangle([0, 0], self.size_px);
        let part = DVec2::new(-low.x, high.y) / (high - low);
        [0, 1].map(|axis| part[axis] * f64::from(self.size_px[axis]))
    }

    /// Position of the gaze in the picture, in pixels from the top left. If the gaze does not meet the
    /// picture's plane, the position of the straight-ahead direction.
    pub fn gaze_px(&self) -> [f64; 2] {
        let at = if self.gaze.z < -1e-6 {
            self.gaze.truncate() / -self.gaze.z
        } else {
            DVec2::ZERO
        };
        let [left, right, up, down] = self.edges();
        [
            (at.x + f64::from(left)) / f64::from(left + right) * f64::from(self.size_px[0]),
            (f64::from(up) - at.y) / f64::from(up + down) * f64::from(self.size_px[1]),
        ]
    }

    /// Columns and rows of the picture's tiles.
    pub fn tiles(&self) -> [u32; 2] {
        self.size_px.map(|size| size.div_ceil(TILE_SIZE_PX))
    }

    /// Pixels of a tile, clipped at the picture's edge: first and end.
    pub fn tile_px(&self, tile: [u32; 2]) -> [[u32; 2]; 2] {
        let edge = |step: u32| {
            [0, 1].map(|axis: usize| ((tile[axis] + step) * TILE_SIZE_PX).min(self.size_px[axis]))
        };
        [edge(0), edge(1)]
    }
}
