//! A model of the head of a standing person who looks around.
//!
//! Each angle and each axis of the neck's sway is a sum of sinusoids whose frequencies have no
//! common period, so the motion does not repeat. The same time always gives the same pose. The head
//! turns about a pivot in the neck, below and behind the eyes, so that turning also translates the
//! eyes.
//!
//! This is a model, not a recording. Its figures over a minute, which the tests check: yaw stays
//! within 38 degrees of the camera's direction, pitch within 18, roll within 7. The head turns at
//! up to 120 degrees per second, half of the time faster than 40. The eyes move at up to 0.5 m/s
//! and stay within 15 cm.

use crate::Camera;
use crate::cameras::head_pose;
use glam::{Affine3A, Quat, Vec3};
use std::f32::consts::TAU;

/// A sinusoid: amplitude, frequency in Hz, phase in turns.
pub(super) type Wave = [f32; 3];

/// Rotation to the left about the vertical, degrees.
pub(super) const YAW: [Wave; 3] = [[24.0, 0.31, 0.0], [9.0, 0.71, 0.02], [2.0, 1.87, 0.35]];
/// Looking up, degrees.
pub(super) const PITCH: [Wave; 3] = [[7.0, 0.43, 0.08], [3.5, 1.13, 0.31], [0.8, 2.3, 0.6]];
/// Tilt to the left, degrees.
pub(super) const ROLL: [Wave; 2] = [[3.0, 0.37, 0.2], [1.2, 0.89, 0.55]];
/// Sway of the neck to the right, metres.
const RIGHT: [Wave; 2] = [[0.035, 0.47, 0.0], [0.01, 1.21, 0.4]];
/// Sway of the neck upwards, metres.
const UP: [Wave; 2] = [[0.012, 0.83, 0.1], [0.005, 1.9, 0.7]];
/// Sway of the neck backwards, metres.
const BACK: [Wave; 2] = [[0.04, 0.29, 0.5], [0.01, 1.03, 0.15]];

/// From the pivot in the neck to the point between the eyes, head space, metres.
const EYES_FROM_NECK_M: Vec3 = Vec3::new(0.0, 0.12, -0.10);

/// The sum of waves minus its value at time 0, so that frame 0 is the camera itself.
pub(super) fn sum(waves: &[Wave], t: f32) -> f32 {
    let wave = |[amplitude, hz, phase]: &Wave| {
        amplitude * ((TAU * (hz * t + phase)).sin() - (TAU * phase).sin())
    };
    waves.iter().map(wave).sum()
}

/// The head's pose `t` seconds after the camera's pose.
pub(super) fn pose_at(camera: &Camera, t: f32) -> Affine3A {
    let start = head_pose(camera);
    let angle = |waves: &[Wave]| sum(waves, t).to_radians();
    // The neck turns about the vertical of the scene, then nods, then tilts.
    let yaw = Quat::from_axis_angle(camera.up.normalize(), angle(&YAW));
    let nod = Quat::from_rotation_x(angle(&PITCH)) * Quat::from_rotation_z(angle(&ROLL));
    let before = Quat::from_mat3a(&start.matrix3);
    let rotation = (yaw * before * nod).normalize();
    let neck = start.translation - before * glam::Vec3A::from(EYES_FROM_NECK_M);
    let sway = Vec3::new(sum(&RIGHT, t), sum(&UP, t), sum(&BACK, t));
    let eyes = Vec3::from(neck) + before * sway + rotation * EYES_FROM_NECK_M;
    Affine3A::from_rotation_translation(rotation, eyes)
}
