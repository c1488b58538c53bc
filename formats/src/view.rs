//! Head-mounted displays, eyes and tiles: the views of a stereo pair.

use crate::error::{Broken, ensure};
use glam::{DMat4, Mat4};
use serde::{Deserialize, Serialize};

/// Edge length of a tile in pixels, as in Z2 paper section 4.1.
pub const TILE_SIZE_PX: u32 = 16;

/// Largest width and height of an eye's image.
pub const MAX_EYE_SIZE_PX: u32 = 16384;
/// Largest absolute tangent of a half-angle.
pub const MAX_TANGENT: f32 = 100.0;
/// Smallest sum of the tangents of two opposite half-angles.
pub const MIN_TANGENT_SUM: f32 = 1e-4;
/// Largest distance between the eyes in metres; scenes may be in millimetres or in kilometres.
pub const MAX_IPD_M: f32 = 1e6;
/// Largest absolute yaw of an eye in degrees.
pub const MAX_CANT_DEG: f32 = 45.0;

/// Which eye a view belongs to. Monoscopic passes (a shadow map) have no eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Eye {
    /// View 0.
    Left,
    /// View 1.
    Right,
}

impl std::fmt::Display for Eye {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Right => "right",
        })
    }
}

/// Tangents of the four half-angles of an eye's frustum, all positive for an on-axis eye.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FovTangents {
    /// Towards the left edge of the eye's image.
    pub left: f32,
    /// Towards the right edge of the eye's image.
    pub right: f32,
    /// Towards the top edge.
    pub up: f32,
    /// Towards the bottom edge.
    pub down: f32,
}

impl FovTangents {
    /// The tangents towards the left, right, top and bottom edge.
    pub const fn new(left: f32, right: f32, up: f32, down: f32) -> Self {
        Self {
            left,
            right,
            up,
            down,
        }
    }

    /// Checks that the frustum is not empty and that computations with it do not overflow.
    ///
    /// # Errors
    /// The tangent or sum that is out of range.
    pub fn check(&self) -> Result<(), Broken> {
        let all = [self.left, self.right, self.up, self.down];
        let (what, found) = ("field-of-view tangents", format_args!("{all:?}"));
        ensure(
            all.iter().all(|tangent| tangent.abs() <= MAX_TANGENT),
            what,
            format_args!("left, right, up and down each from -{MAX_TANGENT} to {MAX_TANGENT}"),
            found,
        )?;
        ensure(
            self.left + self.right > MIN_TANGENT_SUM && self.up + self.down > MIN_TANGENT_SUM,
            what,
            format_args!("left + right and up + down above {MIN_TANGENT_SUM}"),
            found,
        )
    }
}

/// The visible area of an eye's picture behind the round lens: a circle in the eye's tangent space (x
/// right, y up, at distance 1 along the viewing direction).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lens {
    /// Tangents of the centre, to the right and up from straight ahead.
    pub center: [f32; 2],
    /// Radius, as a tangent.
    pub radius: f32,
}

impl Lens {
    /// The default for an unknown lens: a circle around the viewing direction that touches the edges of the
    /// picture's longer axis (their mean if the two differ). It hides the corners of any picture; for a
    /// square and symmetric one, 1 - pi/4 of all pixels.
    pub fn of(fov: &FovTangents) -> Self {
        let longer = (fov.left + fov.right).max(fov.up + fov.down);
        Self {
            center: [0.0; 2],
            radius: longer / 2.0,
        }
    }

    /// Whether the direction with these tangents (right, up) is visible; the circle itself is.
    pub fn contains(&self, [x, y]: [f32; 2]) -> bool {
        let [dx, dy] = [x - self.center[0], y - self.center[1]].map(f64::from);
        dx * dx + dy * dy <= f64::from(self.radius) * f64::from(self.radius)
    }

    /// Whether a pixel's centre is visible; columns count from the left, rows from the top.
    pub fn pixel_visible(&self, fov: &FovTangents, size_px: [u32; 2], pixel: [u32; 2]) -> bool {
        let along = |axis: usize, from: f32, to: f32| {
            let part = (pixel[axis] as f32 + 0.5) / size_px[axis] as f32;
            from + part * (to - from)
        };
        self.contains([along(0, -fov.left, fov.right), along(1, fov.up, -fov.down)])
    }

    /// Checks that the visible area is not empty.
    ///
    /// # Errors
    /// The value that is out of range.
    pub fn check(&self) -> Result<(), Broken> {
        let figures = [self.center[0], self.center[1], self.radius];
        let fits = figures.iter().all(|t| t.abs() <= MAX_TANGENT) && self.radius > 0.0;
        ensure(
            fits,
            "lens",
            format_args!(
                "centre x and y from -{MAX_TANGENT} to {MAX_TANGENT}, radius above 0 to {MAX_TANGENT}"
            ),
            format_args!("{figures:?}"),
        )
    }
}

/// Checks the size of an eye's image.
pub(crate) fn check_eye_size(size_px: [u32; 2]) -> Result<(), Broken> {
    ensure(
        (size_px.iter()).all(|size| (1..=MAX_EYE_SIZE_PX).contains(size)),
        "size of an eye's image",
        format_args!("1 to {MAX_EYE_SIZE_PX} pixels each way"),
        format_args!("{size_px:?}"),
    )
}

/// A head-mounted display: pixels, frusta and eye poses relative to the head.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Hmd {
    /// Preset name, or `custom`.
    pub name: String,
    /// Source of the figures, or `unverified`.
    pub source: String,
    /// Width and height of the image of each eye in pixels.
    pub eye_size_px: [u32; 2],
    /// Frustum of the left and of the right eye.
    pub fov: [FovTangents; 2],
    /// Distance between the eye centres in metres.
    pub ipd_m: f32,
    /// Outward yaw of each eye in degrees (0 for parallel eyes).
    pub cant_deg: f32,
}

impl Hmd {
    /// Checks that every figure is in its range.
    ///
    /// # Errors
    /// The first figure that is out of range, and its range.
    pub fn check(&self) -> Result<(), Broken> {
        check_eye_size(self.eye_size_px)?;
        for fov in &self.fov {
            fov.check()?;
        }
        ensure(
            (0.0..=MAX_IPD_M).contains(&self.ipd_m),
            "distance between the eyes",
            format_args!("0 to {MAX_IPD_M} m"),
            format_args!("{} m", self.ipd_m),
        )?;
        ensure(
            self.cant_deg.abs() <= MAX_CANT_DEG,
            "cant",
            format_args!("-{MAX_CANT_DEG} to {MAX_CANT_DEG} degrees"),
            format_args!("{} degrees", self.cant_deg),
        )
    }
}

/// One eye's matrices for one frame, column-major as glam stores them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EyeView {
    /// World to eye space; right-handed, looking down -z.
    pub world_to_eye: [[f32; 4]; 4],
    /// Eye space to clip space; depth 0 to 1, y up.
    pub eye_to_clip: [[f32; 4]; 4],
    /// Eye position in world space, metres; in a trace, relative to its `origin_m`.
    pub position: [f32; 3],
}

impl Default for EyeView {
    /// A view at the origin with clip space as view, for generated traces.
    fn default() -> Self {
        let identity = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        Self {
            world_to_eye: identity,
            eye_to_clip: identity,
            position: [0.0; 3],
        }
    }
}

impl EyeView {
    /// World to clip space, as passed to the driver.
    pub fn clip_from_world(&self) -> Mat4 {
        Mat4::from_cols_array_2d(&self.eye_to_clip) * Mat4::from_cols_array_2d(&self.world_to_eye)
    }

    /// The same, multiplied in double precision.
    pub fn clip_from_world_f64(&self) -> DMat4 {
        let wide = |m: &[[f32; 4]; 4]| Mat4::from_cols_array_2d(m).as_dmat4();
        wide(&self.eye_to_clip) * wide(&self.world_to_eye)
    }
}

/// The cameras of one frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameViews {
    /// Frame number, from 0.
    pub frame: u32,
    /// Left and right eye.
    pub eyes: [EyeView; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lens_of_a_square_picture_shows_a_circle_of_its_pixels() {
        let fov = FovTangents::new(1.2, 1.2, 1.2, 1.2);
        let lens = Lens::of(&fov);
        let size_px = [200, 200];
        let seen = |x, y| lens.pixel_visible(&fov, size_px, [x, y]);
        let pixels = (0..200).flat_map(|y| (0..200).map(move |x| (x, y)));
        let share = pixels.filter(|(x, y)| seen(*x, *y)).count() as f64 / 40_000.0;
        let circle = std::f64::consts::FRAC_PI_4;
        assert!((share - circle).abs() < 1e-3, "{share}");
        assert!(seen(0, 100) && seen(100, 199) && !seen(20, 20));
    }

    #[test]
    fn an_off_centre_lens_shows_the_pixels_on_its_side() {
        let fov = FovTangents::new(1.0, 1.0, 1.0, 1.0);
        let lens = Lens {
            center: [0.5, 0.5],
            radius: 0.3,
        };
        // To the right of and above the centre; rows count downwards.
        assert!(lens.pixel_visible(&fov, [100, 100], [75, 25]));
        assert!(!lens.pixel_visible(&fov, [100, 100], [75, 75]));
        assert!(!lens.pixel_visible(&fov, [100, 100], [25, 25]));
        assert_eq!(lens.check(), Ok(()));
        for radius in [0.0, -1.0, f32::NAN, 1e9] {
            assert!(Lens { radius, ..lens }.check().is_err(), "{radius}");
        }
    }
}
