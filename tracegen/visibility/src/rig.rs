//! The eyes of a frame for culling.

use crate::volume::{Affine, Cone, HalfSpace, frustum, meeting_point};
use formats::view::{EyeView, Lens};
use glam::{DMat4, DVec3, Mat4};

/// One eye.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// Matrices.
    pub view: EyeView,
    /// Visible part of its picture.
    pub lens: Lens,
    /// Width and height of its picture.
    pub size_px: [u32; 2],
}

/// The eyes of a frame: one, or left and right.
#[derive(Clone, Debug)]
pub struct Rig {
    eyes: Vec<Eye>,
}

/// Error for eyes whose directions diverge too much for one volume around both.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "one volume around both eyes: expected a combined field of view below {limit} degrees, found {found}",
    limit = MAX_COMBINED_DEG,
    found = found_deg.map_or("eyes that look to opposite sides".to_owned(), |deg| format!("{deg:.1} degrees"))
)]
pub struct TooWide {
    /// The combined field of view; `None` if it is not defined.
    pub found_deg: Option<f64>,
}

/// Largest combined field of view of one volume in degrees. At 180 degrees no such volume exists, and close
/// to it, the volume contains almost everything.
pub const MAX_COMBINED_DEG: f64 = 179.0;

impl Rig {
    /// # Panics
    /// There are no eyes.
    pub fn new(eyes: Vec<Eye>) -> Self {
        assert!(!eyes.is_empty(), "somebody has to look");
        Self { eyes }
    }

    /// The eyes, left before right.
    pub fn eyes(&self) -> &[Eye] {
        &self.eyes
    }

    /// The eye that a frame uses for culling: left in even frames, right in odd ones.
    pub(crate) fn frame_eye(&self, frame: u32) -> &Eye {
        &self.eyes[frame as usize % self.eyes.len()]
    }
}

impl Eye {
    /// World to clip space, as passed to the driver.
    pub(crate) fn clip_from_world(&self) -> Mat4 {
        self.view.clip_from_world()
    }

    /// Planes of the drawn volume, for geometry whose coordinates are at most `extent`.
    pub(crate) fn frustum(&self, extent: DVec3) -> [HalfSpace; 6] {
        frustum(self.clip_from_world(), extent)
    }

    /// Right, up and forward coordinates relative to the eye as functions of world space, in metres.
    pub(crate) fn axes(&self) -> [Affine; 3] {
        let matrix: DMat4 = Mat4::from_cols_array_2d(&self.view.world_to_eye).as_dmat4();
        let axis = |row: usize, sign: f64| Affine {
            gradient: matrix.row(row).truncate() * sign,
            constant: matrix.row(row).w * sign,
        };
        [axis(0, 1.0), axis(1, 1.0), axis(2, -1.0)]
    }

    /// Position in world space.
    pub(crate) fn position(&self) -> DVec3 {
        let matrix: DMat4 = Mat4::from_cols_array_2d(&self.view.world_to_eye).as_dmat4();
        matrix.inverse().w_axis.truncate()
    }

    /// Radius of the lens plus one pixel, because vertices are rounded to the rasteriser's grid.
    pub(crate) fn lens_radius(&self) -> f64 {
        let scale = &self.view.eye_to_clip;
        let pixel = |axis: usize| 2.0 / f64::from(scale[axis][axis] * self.size_px[axis] as f32);
        f64::from(self.lens.radius) + pixel(0).abs().max(pixel(1).abs())
    }

    /// Cone from the eye through the visible circle of the lens.
    pub(crate) fn lens_cone(&self) -> Cone {
        let [right, up, forward] = self.axes();
        let [x, y] = self.lens.center.map(f64::from);
        Cone {
            x: right.plus(-x, forward),
            y: up.plus(-y, forward),
            radius: forward.times(self.lens_radius()),
        }
    }

    /// Near and far ends of the four edges of the frustum. The far end is at the far plane, or at the end of
    /// geometry whose coordinates are at most `extent`, if that is nearer.
    pub(crate) fn edges(&self, extent: DVec3) -> [[DVec3; 2]; 4] {
        let [left, right, bottom, top, near, far] = self.frustum(extent);
        let forward = near.normal;
        let near_m = -near.offset;
        let far_m = if far.normal.dot(forward) < -0.5 {
            far.offset
        } else {
            f64::INFINITY
        };
        let last_m = forward.abs().dot(extent);
        let step = 1e-6 * near_m.abs();
        let far = HalfSpace {
            normal: -forward,
            offset: far_m.min(last_m).max(near_m + step),
        };
        [[left, bottom], [left, top], [right, bottom], [right, top]]
            .map(|[a, b]| [near, far].map(|end| meeting_point([a, b, end])))
    }
}
