//! Shapes of machines that are computed.

use crate::mesh_builder::{MeshBuilder, profile};
use glam::{Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// A motor's body with its cooling fins, along y.
pub(super) fn motor(m: &mut MeshBuilder) {
    let outline =
        profile("0,-0.02! 0.06,-0.02! 0.06,0.06! 0.2,0.08! 0.22,0.12! 0.22,0.62! 0.2,0.68 0,0.7!");
    m.lathe_shaped(&outline, 32, |angle, y| {
        let finned = f32::from(u8::from((0.12..0.63).contains(&y)));
        1.0 - 0.09 * finned * f32::from(u8::from((angle / TAU * 32.0).round() as i32 % 2 == 0))
    });
}

/// The curve of a crane's hook.
pub(super) fn hook(m: &mut MeshBuilder) {
    let curve: Vec<(Vec3, f32)> = (0..=8)
        .map(|i| {
            let a = -0.5 * PI + 1.5 * PI * i as f32 / 8.0;
            let (sin, cos) = (FRAC_PI_2 - a).sin_cos();
            let at = vec3(0.17 * sin, 0.12 + 0.17 * cos, 0.0);
            (at, 0.05 - 0.003 * i as f32)
        })
        .rev()
        .collect();
    m.tube(&curve, 6);
}

/// The door of a cabinet.
pub(super) fn panel(m: &mut MeshBuilder) {
    m.surface(1, 1, |s, t| {
        let at = vec3(0.9 * (0.5 - s), 0.7 + 1.2 * t, -0.256);
        (at, vec2(s, 1.0 - t))
    });
}
