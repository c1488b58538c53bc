//! Timewarp: maps a picture to an eye that has rotated or moved since it was rendered.
//!
//! A rotation moves each pixel independently of its depth, so a homography describes it. A translation
//! requires the depth of the picture. Surfaces that were hidden in the picture cannot be recovered.

use formats::view::EyeView;
use glam::{DMat3, DMat4, DVec3, DVec4};

/// Homogeneous map from pixels of an eye's current picture to pixels of its picture `before`. If the third
/// coordinate is 0 or less, the direction was behind the eye.
pub fn before_from_now_px(before: &EyeView, now: &EyeView, size_px: [u32; 2]) -> DMat3 {
    let [width, height] = size_px.map(f64::from);
    // Homogeneous clip space (x, y, w) to pixels; rows are numbered downwards.
    let px_from_clip = DMat3::from_cols(
        DVec3::new(width / 2.0, 0.0, 0.0),
        DVec3::new(0.0, -height / 2.0, 0.0),
        DVec3::new(width / 2.0, height / 2.0, 1.0),
    );
    let px_from_direction = |eye: &EyeView| {
        let clip = wide(&eye.eye_to_clip);
        // A rotation does not depend on depth, so the translation is omitted.
        let column = |axis: usize| DVec3::new(clip.col(axis).x, clip.col(axis).y, clip.col(axis).w);
        let clip_from_eye = DMat3::from_cols(column(0), column(1), column(2));
        px_from_clip * clip_from_eye * DMat3::from_mat4(wide(&eye.world_to_eye))
    };
    px_from_direction(before) * px_from_direction(now).inverse()
}

/// Maps pixels by the depth of the earlier picture.
pub struct ByDepth<'a> {
    turned: DMat3,
    /// Map from the earlier clip space to the current one.
    now_from_before: DMat4,
    /// Row by row; 0 in pixels without a draw.
    depth: &'a [f32],
    size_px: [u32; 2],
}

/// Number of steps of the fixed-point iteration. Each corrects the error of the step before.
const STEPS: u32 = 6;

impl<'a> ByDepth<'a> {
    /// Maps between two poses of an eye; `depth` is that of the earlier picture.
    pub fn new(before: &EyeView, now: &EyeView, depth: &'a [f32], size_px: [u32; 2]) -> Self {
        Self {
            turned: before_from_now_px(before, now, size_px),
            now_from_before: now.clip_from_world_f64() * before.clip_from_world_f64().inverse(),
            depth,
            size_px,
        }
    }

    /// Position in the earlier picture, in pixels, of the surface at a position in the current picture. The
    /// iteration starts at the position for infinite distance. Each step projects the surface found there
    /// into the current picture and corrects the position by the difference. If there is no surface, the
    /// result is the start position.
    pub fn before_px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let turned = self.turned * DVec3::new(x, y, 1.0);
        let turned = [turned.x / turned.z, turned.y / turned.z];
        let mut at = turned;
        for _ in 0..STEPS {
            let Some([found_x, found_y]) = self.now_px(at) else {
                return turned;
            };
            at = [at[0] + x - found_x, at[1] + y - found_y];
        }
        at
    }

    /// Current position of the surface at a pixel of the earlier picture; `None` if there is no surface or if
    /// it is behind the eye.
    fn now_px(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let [width, height] = self.size_px.map(f64::from);
        let column = x.clamp(0.0, width - 1.0) as usize;
        let row = y.clamp(0.0, height - 1.0) as usize;
        let depth = *self.depth.get(row * self.size_px[0] as usize + column)?;
        let ndc = [2.0 * x / width - 1.0, 1.0 - 2.0 * y / height];
        let clip = self.now_from_before * DVec4::new(ndc[0], ndc[1], depth.into(), 1.0);
        (depth > 0.0 && clip.w > 0.0).then(|| {
            [
                (clip.x / clip.w + 1.0) / 2.0 * width,
                (1.0 - clip.y / clip.w) / 2.0 * height,
            ]
        })
    }
}

fn wide(matrix: &[[f32; 4]; 4]) -> DMat4 {
    DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::camera::rh::proj::directx::perspective;
    use glam::{Mat4, Quat, Vec3};

    const SIZE_PX: [u32; 2] = [320, 200];

    fn eye(yaw: f32, pitch: f32, position: Vec3) -> EyeView {
        let turn = Quat::from_rotation_y(yaw) * Quat::from_rotation_x(pitch);
        let view = Mat4::from_rotation_translation(turn, position).inverse();
        EyeView {
            world_to_eye: view.to_cols_array_2d(),
            eye_to_clip: perspective(1.1, 1.6, 1000.0, 0.1).to_cols_array_2d(),
            position: position.to_array(),
        }
    }

    fn project(eye: &EyeView, point: Vec3) -> [f64; 2] {
        let clip = Mat4::from_cols_array_2d(&eye.eye_to_clip)
            * Mat4::from_cols_array_2d(&eye.world_to_eye)
            * point.extend(1.0);
        [
            f64::from((clip.x / clip.w + 1.0) / 2.0 * 320.0),
            f64::from((1.0 - clip.y / clip.w) / 2.0 * 200.0),
        ]
    }

    #[test]
    fn rotation_maps_each_direction_to_its_earlier_pixel() {
        let here = Vec3::new(1.0, 2.0, 3.0);
        let (before, now) = (eye(0.3, 0.1, here), eye(0.22, 0.16, here));
        let warp = before_from_now_px(&before, &now, SIZE_PX);
        for point in [[0.5, 1.0, -4.0], [-3.0, 3.0, -9.0], [-20.0, 2.0, -80.0]] {
            let point = Vec3::from_array(point);
            let ([x, y], [expected_x, expected_y]) =
                (project(&now, point), project(&before, point));
            let at = warp * DVec3::new(x, y, 1.0);
            let off = (at.x / at.z - expected_x).hypot(at.y / at.z - expected_y);
            assert!(at.z > 0.0 && off < 1e-2, "{point}: {off}");
        }
        let still = before_from_now_px(&now, &now, SIZE_PX);
        assert!(still.abs_diff_eq(DMat3::IDENTITY, 1e-9));
    }

    #[test]
    fn sideways_motion_gives_the_parallax_of_a_point() {
        // A centimetre at 2 m: f / z * 0.01 pixels, with f = height / (2 tan(fov / 2)).
        let (before, now) = (eye(0.0, 0.0, Vec3::ZERO), eye(0.0, 0.0, 0.01 * Vec3::X));
        let warp = before_from_now_px(&before, &now, SIZE_PX);
        let point = Vec3::new(0.1, 0.2, -2.0);
        let ([x, y], [true_x, _]) = (project(&now, point), project(&before, point));
        let at = warp * DVec3::new(x, y, 1.0);
        let expected = 100.0 / 0.55_f64.tan() / 2.0 * 0.01;
        assert!((true_x - at.x / at.z - expected).abs() < 1e-3);
    }

    #[test]
    fn with_depth_a_wall_is_mapped_exactly_for_any_motion() {
        // A wall in 2 m distance in the left half of the earlier picture, and nothing in the right half.
        let (before, now) = (
            eye(0.0, 0.0, Vec3::ZERO),
            eye(0.03, 0.02, Vec3::new(0.02, 0.01, -0.05)),
        );
        let clip =
            Mat4::from_cols_array_2d(&before.eye_to_clip) * Vec3::new(0.0, 0.0, -2.0).extend(1.0);
        let depth: Vec<f32> = (0..320 * 200)
            .map(|i| if i % 320 < 160 { clip.z / clip.w } else { 0.0 })
            .collect();
        let by_depth = ByDepth::new(&before, &now, &depth, SIZE_PX);
        let turned = before_from_now_px(&before, &now, SIZE_PX);
        for point in [[-0.5, 0.3], [-0.2, -0.7], [-1.1, 0.0]] {
            let point = Vec3::new(point[0], point[1], -2.0);
            let (at, expected) = (project(&now, point), project(&before, point));
            let found = by_depth.before_px(at);
            let off = (found[0] - expected[0]).hypot(found[1] - expected[1]);
            assert!(off < 0.02, "{point}: {found:?} {expected:?}");
            let alone = turned * DVec3::new(at[0], at[1], 1.0);
            assert!((alone.x / alone.z - expected[0]).hypot(alone.y / alone.z - expected[1]) > 0.5);
        }
        let sky = turned * DVec3::new(280.0, 100.0, 1.0);
        assert_eq!(
            by_depth.before_px([280.0, 100.0]),
            [sky.x / sky.z, sky.y / sky.z]
        );
    }
}
