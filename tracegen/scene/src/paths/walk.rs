//! The slow walk: 0.4 m/s ahead with a sideways sway of 5 cm at 0.5 Hz, looking straight ahead.

use crate::Camera;
use crate::cameras::head_pose;
use glam::Vec3;

/// Forward speed of the head, metres per second.
const FORWARD_M_PER_S: f32 = 0.4;
/// Amplitude of the head's sideways sway, metres.
const SWAY_M: f32 = 0.05;
/// Sways per second.
const SWAY_HZ: f32 = 0.5;

/// The camera after `t` seconds: 0.4 t metres ahead of its start and 0.05 sin(pi t) metres to the
/// right, looking in the same direction.
pub(super) fn camera_at(camera: &Camera, t: f32) -> Camera {
    let head = head_pose(camera).matrix3;
    let sway = SWAY_M * (std::f32::consts::TAU * SWAY_HZ * t).sin();
    let offset = Vec3::from(head.x_axis * sway - head.z_axis * (FORWARD_M_PER_S * t));
    Camera {
        eye: camera.eye + offset,
        target: camera.target + offset,
        ..camera.clone()
    }
}
