//! The monoscopic far field: one picture of distant geometry for both eyes.
//!
//! A camera between the eyes (or, alternating, in one of them) renders geometry beyond the split. An eye's
//! picture takes a pixel from this picture in the same direction. With depth shift, it takes the pixel in the
//! direction of the same point of a plane at twice the split. The error of a point at depth z of an eye is
//! then
//!
//! ```text
//! same direction:  K / (z - c_z)                            at most K / (D - c_z), at the split D
//! depth shift:     K / (P - c_z) * |z - P| / z, P = 2 D     at most K / (2 D - c_z), at the split and at infinity
//! ```
//!
//! where c is the camera's position in the eye's coordinates (x right, y up, z ahead). K, in pixels times
//! metres, is the largest |c_xy - t c_z| over the tangents t of the eye's view. K is convex in t, so only the
//! corners must be evaluated. No other plane has a smaller largest error. Beyond 4 D, the same direction has
//! a smaller error than the shift. For parallel eyes of W pixels and h degrees and a camera in the middle,
//! K = W IPD / (4 tan(h/2)) and c_z = 0.

use crate::least_work::{Costs, Object, Pixels, least_work};
use crate::settings::{FarField, Split, Variant};
use formats::view::EyeView;
use glam::dcamera::rh::proj::directx::frustum;
use glam::{DMat3, DMat4, DVec2, DVec3, Mat3, Mat4};

/// Part of the split by which the far field starts before it. A slanted surface crosses the split at
/// different depths for the two cameras, and at least one of both layers must contain it.
pub const OVERLAP: f64 = 1.0 / 16.0;

/// Margin in pixels around the visible part of the far field, for filtering.
const BORDER_PX: f64 = 2.0;
/// Error of 32-bit matrices, which the border must allow for.
const ROUNDING_PX: f64 = 0.01;

/// Eyes for which a single far field is impossible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "far field: expected eyes whose views one picture can hold (less than 180 degrees, at most {limit} pixels an edge), found {found}"
)]
pub struct FarFieldError {
    /// The required size of the picture.
    found: String,
    /// Largest edge.
    limit: u32,
}

/// Both eyes of a frame and the camera of their far field.
#[derive(Clone, Debug)]
pub struct Stereo {
    eyes: [Eye; 2],
    size_px: [f64; 2],
    world_from_camera: DMat4,
    shifted: bool,
}

/// An eye: its pose and the terms of its projection.
#[derive(Clone, Copy, Debug)]
struct Eye {
    clip_from_eye: DMat4,
    world_from_eye: DMat4,
    near_m: f64,
    /// The far plane, or a distance from which the eyes' pictures hardly differ.
    far_m: f64,
    /// Whether the far plane is at infinity.
    endless: bool,
}

impl Eye {
    fn new(view: &EyeView) -> Self {
        let matrix = |m: &[[f32; 4]; 4]| Mat4::from_cols_array_2d(m).as_dmat4();
        let clip_from_eye = matrix(&view.eye_to_clip);
        let (scale, offset) = (clip_from_eye.z_axis.z, clip_from_eye.w_axis.z);
        Self {
            clip_from_eye,
            world_from_eye: matrix(&view.world_to_eye).inverse(),
            near_m: offset / (1.0 + scale),
            far_m: if scale > 0.0 {
                offset / scale
            } else {
                1e7 * offset
            },
            endless: scale <= 0.0,
        }
    }

    /// Tangents to the right and up at a position in clip space.
    fn tangents(&self, ndc: DVec2) -> DVec2 {
        let p = &self.clip_from_eye;
        (ndc + DVec2::new(p.z_axis.x, p.z_axis.y)) / DVec2::new(p.x_axis.x, p.y_axis.y)
    }

    /// Directions of the corners of the picture.
    fn corners(&self) -> [DVec3; 4] {
        [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
            .map(|ndc| self.tangents(DVec2::from_array(ndc)).extend(-1.0))
    }

    /// Pixels per unit of tangent.
    fn px_per_tangent(&self, size_px: [f64; 2]) -> DVec2 {
        let p = &self.clip_from_eye;
        DVec2::new(p.x_axis.x * size_px[0], p.y_axis.y * size_px[1]) / 2.0
    }

    /// Matrix from pixels (y down) to directions.
    fn direction_from_px(&self, size_px: [f64; 2]) -> DMat3 {
        let scale = 1.0 / self.px_per_tangent(size_px);
        let corner = self.tangents(DVec2::new(-1.0, 1.0));
        DMat3::from_cols(
            DVec3::new(scale.x, 0.0, 0.0),
            DVec3::new(0.0, -scale.y, 0.0),
            corner.extend(-1.0),
        )
    }
}

/// The far field of a frame, with the matrices to render and sample it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FarView {
    /// Distance ahead of the eyes at which the far field starts.
    pub split_m: f32,
    /// Largest distance between a point's position in an eye's picture and its true position.
    pub worst_shift_px: f32,
    /// Camera of the far field. Its near plane is slightly before the split.
    pub camera: EyeView,
    /// Size of the picture, with at least as many pixels per angle as the eyes' pictures.
    pub size_px: [u32; 2],
    /// Homogeneous maps from pixels of the eyes' pictures to pixels of this one.
    pub far_from_eye_px: [Mat3; 2],
    /// Inverse of `far_from_eye_px`.
    pub eye_from_far_px: [Mat3; 2],
    /// Clip space of this picture to clip space of the eyes.
    pub eye_from_far_clip: [Mat4; 2],
    /// Depth of the split in the eyes' clip space.
    pub split_depth: [f32; 2],
    /// Radius in pixels of the eyes' pictures around the position of a pixel of this picture. Only these
    /// pixels may sample it.
    pub reach_px: u32,
}

impl FarField {
    /// The far field of a frame. `None` if everything is nearer than the split, or if a frame without a far
    /// field costs least. `objects` are the visible draws of the frame.
    ///
    /// # Errors
    /// See [`Stereo::view`].
    pub fn view(
        &self,
        stereo: &Stereo,
        limit_px: u32,
        objects: impl FnOnce() -> Vec<Object>,
    ) -> Result<Option<FarView>, FarFieldError> {
        let [near_m, far_m] = stereo.range_m();
        let beyond = |split_m: f32| (split_m < far_m).then(|| split_m.max(near_m));
        let split_m = match self.split {
            Split::Metres(split_m) => beyond(split_m),
            Split::Pixels(shift_px) => beyond(stereo.split_m(shift_px)),
            Split::LeastWork { within_px } => match beyond(stereo.split_m(within_px)) {
                None => None,
                Some(nearest_m) => {
                    let far = stereo.view(nearest_m, limit_px)?.size_px;
                    let pixels = Pixels {
                        eye: stereo.size_px[0] * stereo.size_px[1],
                        far: f64::from(far[0]) * f64::from(far[1]),
                    };
                    least_work(&objects(), pixels, &Costs::LAVAPIPE, nearest_m).and_then(beyond)
                }
            },
        };
        split_m
            .map(|split_m| stereo.view(split_m, limit_px))
            .transpose()
    }
}

impl Stereo {
    /// The far field's camera for two eyes with pictures of `size_px` in a frame.
    pub fn new(eyes: &[EyeView; 2], size_px: [u32; 2], variant: Variant, frame: u32) -> Self {
        let eyes = [Eye::new(&eyes[0]), Eye::new(&eyes[1])];
        let world_from_camera = match variant {
            Variant::AlternateEye => eyes[(frame % 2) as usize].world_from_eye,
            Variant::Plain | Variant::DepthShift => between(&eyes),
        };
        Self {
            eyes,
            size_px: size_px.map(f64::from),
            world_from_camera,
            shifted: variant == Variant::DepthShift,
        }
    }

    /// Largest shift in pixels of a point beyond a split at `split_m`.
    pub fn worst_shift_px(&self, split_m: f32) -> f32 {
        let shift = |eye: &Eye| {
            let room = self.plane_m(f64::from(split_m)) - self.camera_in(eye).z;
            if room > 0.0 {
                self.shift_px_m(eye) / room
            } else {
                f64::INFINITY
            }
        };
        shift(&self.eyes[0]).max(shift(&self.eyes[1])) as f32
    }

    /// Nearest split for which no point beyond it is shifted by more than `shift_px`.
    pub fn split_m(&self, shift_px: f32) -> f32 {
        let plane = |eye: &Eye| self.camera_in(eye).z + self.shift_px_m(eye) / f64::from(shift_px);
        let exact = plane(&self.eyes[0]).max(plane(&self.eyes[1])) / self.plane_m(1.0);
        // Round up, because a nearer split would exceed the limit.
        (exact as f32).next_up()
    }

    /// Depth P for which K / (P - c_z) is the largest error beyond the split: the split itself or, with depth
    /// shift, the depth of its plane.
    fn plane_m(&self, split_m: f64) -> f64 {
        if self.shifted { 2.0 * split_m } else { split_m }
    }

    /// Nearest and farthest visible distance.
    pub fn range_m(&self) -> [f32; 2] {
        let [a, b] = &self.eyes;
        [a.near_m.min(b.near_m) as f32, a.far_m.max(b.far_m) as f32]
    }

    /// The far field for a split.
    ///
    /// # Errors
    /// A picture that contains everything that both eyes see beyond the split would be larger than `limit_px`
    /// per edge.
    pub fn view(&self, split_m: f32, limit_px: u32) -> Result<FarView, FarFieldError> {
        let split = f64::from(split_m);
        let mut near = f64::INFINITY;
        let mut far = 0.0_f64;
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for eye in &self.eyes {
            let camera_from_eye = self.world_from_camera.inverse() * eye.world_from_eye;
            for corner in eye.corners() {
                // Each visible point beyond the split is between these two, and its image is on the line
                // between theirs.
                let begin = camera_from_eye.transform_point3(split * corner);
                let end = camera_from_eye.transform_point3(eye.far_m.max(split) * corner);
                let infinite = camera_from_eye.transform_vector3(corner);
                near = near.min(-begin.z);
                far = far.max(-end.z).max(-begin.z);
                for p in [begin, infinite] {
                    // Points next to or behind the camera are in no picture.
                    let ahead = if p.z < -1e-3 { -p.z } else { 1e-9 };
                    let tangents = p.truncate() / ahead;
                    (low, high) = (low.min(tangents), high.max(tangents));
                }
            }
        }
        let scale = self.px_per_tangent();
        // Align the picture with the left eye's pixel grid. The camera of parallel eyes has the same grid.
        let edge = self.eyes[0].tangents(DVec2::new(-1.0, 1.0));
        let origin = DVec2::new(low.x - edge.x, edge.y - high.y) * scale;
        let origin = (origin + ROUNDING_PX).floor() - BORDER_PX;
        let end = DVec2::new(high.x - edge.x, edge.y - low.y) * scale;
        let size = (end - ROUNDING_PX).ceil() + BORDER_PX - origin;
        if !(near > 0.0 && size.max_element() <= f64::from(limit_px)) {
            return Err(FarFieldError {
                found: format!("{:.0}x{:.0} pixels", size.x, size.y),
                limit: limit_px,
            });
        }
        let near = near * (1.0 - OVERLAP);
        let far = far.max(near * 2.0) * 1.001;
        let [left, top] = [edge.x + origin.x / scale.x, edge.y - origin.y / scale.y];
        let [right, bottom] = [left + size.x / scale.x, top - size.y / scale.y];
        let planes = |tangent: f64| tangent * near;
        let mut clip_from_camera = frustum(
            planes(left),
            planes(right),
            planes(bottom),
            planes(top),
            near,
            far,
        );
        // Depth 1 at the near plane to 0 at the far plane.
        let endless = self.eyes.iter().any(|eye| eye.endless);
        let scale_of_depth = if endless { 0.0 } else { near / (far - near) };
        clip_from_camera.z_axis.z = scale_of_depth;
        clip_from_camera.w_axis.z = near * (1.0 + scale_of_depth);
        let camera_from_world = self.world_from_camera.inverse();
        let far_px_from_direction = DMat3::from_cols(
            DVec3::new(scale.x, 0.0, 0.0),
            DVec3::new(0.0, -scale.y, 0.0),
            DVec3::new(left * scale.x, -top * scale.y, -1.0),
        );
        let far_from_eye_px = [0, 1].map(|number| {
            let eye = &self.eyes[number];
            let camera_from_eye = camera_from_world * eye.world_from_eye;
            let mut plane = DMat3::from_mat4(camera_from_eye);
            if self.shifted {
                // A point of the plane is `plane_m * direction`, and a direction's z is -1.
                plane.z_axis -= camera_from_eye.w_axis.truncate() / self.plane_m(split);
            }
            far_px_from_direction * plane * eye.direction_from_px(self.size_px)
        });
        let eye_from_far_clip = [0, 1].map(|number| {
            let eye = &self.eyes[number];
            let eye_from_camera = eye.world_from_eye.inverse() * self.world_from_camera;
            (eye.clip_from_eye * eye_from_camera * clip_from_camera.inverse()).as_mat4()
        });
        let split_depth = [0, 1].map(|number| {
            let ahead = DVec3::new(0.0, 0.0, -split);
            let depth = self.eyes[number].clip_from_eye.project_point3(ahead).z;
            depth.clamp(0.0, 1.0) as f32
        });
        Ok(FarView {
            split_m,
            worst_shift_px: self.worst_shift_px(split_m),
            camera: EyeView {
                world_to_eye: camera_from_world.as_mat4().to_cols_array_2d(),
                eye_to_clip: clip_from_camera.as_mat4().to_cols_array_2d(),
                position: self
                    .world_from_camera
                    .w_axis
                    .truncate()
                    .as_vec3()
                    .to_array(),
            },
            size_px: [size.x as u32, size.y as u32],
            far_from_eye_px: far_from_eye_px.map(|m| normalised(m).as_mat3()),
            eye_from_far_px: far_from_eye_px.map(|m| normalised(m.inverse()).as_mat3()),
            eye_from_far_clip,
            split_depth,
            // At the edge, a pixel of a rotated eye may be smaller.
            reach_px: if self.is_rotated() { 2 } else { 1 },
        })
    }

    /// Whether the directions of camera and eyes differ.
    fn is_rotated(&self) -> bool {
        let turn = |eye: &Eye| {
            let between = self.world_from_camera.inverse() * eye.world_from_eye;
            1.0 - between.z_axis.z
        };
        turn(&self.eyes[0]).max(turn(&self.eyes[1])) > 1e-6
    }

    /// Position of the camera in an eye's coordinates, z ahead.
    fn camera_in(&self, eye: &Eye) -> DVec3 {
        let position = self.world_from_camera.w_axis.truncate();
        let inside = eye.world_from_eye.inverse().transform_point3(position);
        inside * DVec3::new(1.0, 1.0, -1.0)
    }

    /// K: shift in pixels times depth in metres.
    fn shift_px_m(&self, eye: &Eye) -> f64 {
        let camera = self.camera_in(eye);
        let scale = eye.px_per_tangent(self.size_px);
        let at =
            |corner: DVec3| ((camera.truncate() - corner.truncate() * camera.z) * scale).length();
        eye.corners().map(at).into_iter().fold(0.0, f64::max)
    }

    /// Pixels per unit of the camera's tangent. Straight ahead of each eye, the camera has at least as many
    /// pixels per angle as the eye.
    fn px_per_tangent(&self) -> DVec2 {
        let scale = |eye: &Eye| {
            let r = DMat3::from_mat4(self.world_from_camera.inverse() * eye.world_from_eye);
            let (ahead, x, y) = (r.z_axis, r.x_axis, r.y_axis);
            // Derivatives of the camera's tangents with respect to the eye's, straight ahead of the eye.
            let slope = DVec2::new(x.x * ahead.z - ahead.x * x.z, y.y * ahead.z - ahead.y * y.z)
                / (ahead.z * ahead.z);
            eye.px_per_tangent(self.size_px) / slope.abs()
        };
        scale(&self.eyes[0]).max(scale(&self.eyes[1]))
    }
}

/// The pose in the middle between two eyes, with the mean of their axes.
fn between(eyes: &[Eye; 2]) -> DMat4 {
    let [a, b] = eyes.map(|eye| eye.world_from_eye);
    let back = (a.z_axis + b.z_axis)
        .truncate()
        .normalize_or(a.z_axis.truncate());
    let up = (a.y_axis + b.y_axis).truncate();
    let right = up.cross(back).normalize_or(a.x_axis.truncate());
    let middle = (a.w_axis + b.w_axis).truncate() / 2.0;
    DMat4::from_cols(
        right.extend(0.0),
        back.cross(right).extend(0.0),
        back.extend(0.0),
        middle.extend(1.0),
    )
}

/// Scales a homogeneous map to lose the least precision when it is rounded to 32 bits.
fn normalised(m: DMat3) -> DMat3 {
    m * (1.0 / m.z_axis.z)
}

pub(crate) mod plan;
#[cfg(test)]
mod tests;
