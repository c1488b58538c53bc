//! Eyes and random numbers for the tests.

use crate::rig::{Eye, Rig};
use formats::random::Random;
use formats::view::{FovTangents, Hmd, Lens};
use glam::Vec3;
use scene::{Camera, cameras};

/// Size of an eye's picture in pixels.
pub const SIZE_PX: [u32; 2] = [1000, 1000];

/// Eyes at the origin that look along -z, with the matrices of a camera and default lenses.
pub fn rig(fov: [FovTangents; 2], ipd_m: f32, cant_deg: f32, near: f32, far: f32) -> Rig {
    let hmd = Hmd {
        eye_size_px: SIZE_PX,
        fov,
        ipd_m,
        cant_deg,
        ..Hmd::default()
    };
    let camera = camera(Vec3::ZERO, Vec3::NEG_Z, near, far);
    rig_of(&camera, &hmd, fov.map(|fov| Lens::of(&fov)))
}

/// A head at `eye` that looks along `direction`.
pub fn camera(eye: Vec3, direction: Vec3, near: f32, far: f32) -> Camera {
    Camera {
        name: String::new(),
        eye,
        target: eye + direction,
        up: Vec3::Y,
        vfov_deg: 60.0,
        near,
        far,
    }
}

/// The eyes of a head.
pub fn rig_of(camera: &Camera, hmd: &Hmd, lenses: [Lens; 2]) -> Rig {
    let views = cameras::eye_views(camera, hmd);
    let eyes = views.into_iter().zip(lenses).map(|(view, lens)| Eye {
        view,
        lens,
        size_px: SIZE_PX,
    });
    Rig::new(eyes.collect())
}

/// A random number from `low` to `high`.
pub fn between(random: &mut Random, low: f32, high: f32) -> f32 {
    low + (high - low) * random.unit_f32()
}

/// A random point in a box.
pub fn within(random: &mut Random, [low, high]: [Vec3; 2]) -> Vec3 {
    let t = Vec3::new(random.unit_f32(), random.unit_f32(), random.unit_f32());
    // Clamp, because rounding may move it out of the box.
    (low + (high - low) * t).clamp(low, high)
}
