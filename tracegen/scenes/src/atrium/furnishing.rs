//! Furnishing of the atrium: drapes, plants, reliefs, lamps, a fountain.

use super::parts::{arching_leaf, drape, rosette};
use crate::mesh_builder::{MeshBuilder, curve, profile, upright as at};
use crate::noise::Rng;
use crate::scene_builder::SceneBuilder;
use glam::{Affine3A, Quat, Vec3, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

const BAY: f32 = 3.5;
/// Materials of the drapes.
const DRAPES: [&str; 3] = ["drape-red", "drape-green", "drape-blue"];

pub(super) fn drapes(scene: &mut SceneBuilder) {
    let cloths: Vec<usize> = (0..3)
        .map(|c| {
            scene.mesh(
                "drape",
                drape(2.6, 2.45, 8.0, [56, 16], 40 + c as u64),
                DRAPES[c],
            )
        })
        .collect();
    let mut rod = MeshBuilder::new();
    rod.rod(vec3(-1.4, 0.02, 0.0), vec3(1.4, 0.02, 0.0), 0.02, 10);
    let rod = scene.mesh("curtain-rod", rod, "lamp-brass");
    for (i, bay) in [-3, -1, 0, 2].into_iter().enumerate() {
        for (s, side) in [-1.0f32, 1.0].into_iter().enumerate() {
            let x = (bay as f32 + 0.5 + s as f32) * BAY;
            let place = at(
                vec3(x, 3.28, side * BAY),
                if s == 0 { 0.0 } else { PI },
                1.0,
            );
            scene.place(cloths[(i + 2 * s) % 3], place);
            scene.place(rod, place);
        }
    }
    // Carpets hung over the balustrade.
    for (i, (bay, side)) in [(-2, -1.0f32), (1, -1.0), (-1, 1.0), (2, 1.0)]
        .into_iter()
        .enumerate()
    {
        let mut carpet = MeshBuilder::new();
        let wave = 0.012;
        carpet.surface(24, 20, |s, t| {
            // From the hem in front, up, over the rail and down behind it.
            let length = t * 2.3;
            let (y, z) = if length < 1.5 {
                (length - 1.5, 0.20 + 0.02 * (1.5 - length))
            } else {
                let a = ((length - 1.5) / 0.46).min(1.0) * PI;
                (
                    0.06 * a.sin() - (length - 1.96).max(0.0),
                    0.18 * a.cos() + 0.02,
                )
            };
            let ripple = wave * (s * 9.0 + i as f32).sin() * (1.5 - length).max(0.0);
            (
                vec3((s - 0.5) * 1.7, y, z + ripple),
                glam::vec2(1.7 * s, -length),
            )
        });
        carpet.orient(|q| {
            if q.y < -0.1 {
                Vec3::Z * q.z.signum()
            } else {
                Vec3::Y
            }
        });
        let mesh = scene.mesh("carpet", carpet, DRAPES[(i + 1) % 3]);
        let x = (bay as f32 + 0.5) * BAY;
        scene.place(
            mesh,
            at(
                vec3(x, 6.57, side * BAY),
                if side < 0.0 { 0.0 } else { PI },
                1.0,
            ),
        );
    }
}

pub(super) fn plants(scene: &mut SceneBuilder) {
    let mut rng = Rng::new(77);
    let [pot_mesh, earth] = ["pot", "earth"].map(|name| scene.numbers(name)[0]);
    let bushes: Vec<usize> = (0..3)
        .map(|_| {
            scene.mesh(
                "plant",
                rosette(26, 0.95, 0.17, [2, 6], &mut rng),
                "palm-leaf",
            )
        })
        .collect();
    // A trail of ivy: leaves along a few hanging stems.
    let trails: Vec<usize> = (0..3)
        .map(|_| {
            let mut trail = MeshBuilder::new();
            for _ in 0..12 {
                let (x, z, length) = (rng.jitter(0.55), rng.range(0.02, 0.12), rng.range(0.5, 1.7));
                let mut y = 0.1;
                while y > -length {
                    y -= rng.range(0.05, 0.09);
                    let size = rng.range(0.10, 0.16);
                    let leaf = arching_leaf(size, size, 0.1, 0.5, 0.15, [2, 2]);
                    let turn = Quat::from_rotation_y(-FRAC_PI_2 + rng.jitter(0.9))
                        * Quat::from_rotation_z(-0.9 + rng.jitter(0.5));
                    trail.merge(
                        &leaf,
                        Affine3A::from_rotation_translation(turn, vec3(x + rng.jitter(0.05), y, z)),
                    );
                }
            }
            scene.mesh("ivy", trail, "ivy-leaf")
        })
        .collect();
    for i in -3i32..=3 {
        for side in [-1.0f32, 1.0] {
            let x = i as f32 * BAY;
            if (i + i32::from(side > 0.0)) % 2 == 0 {
                let base = vec3(x + rng.jitter(0.08), 0.0, side * (BAY - 0.92));
                scene.place(pot_mesh, at(base, rng.range(0.0, TAU), 0.36));
                scene.place(earth, at(base, 0.0, 0.36));
                scene.place(
                    bushes[rng.below(3)],
                    at(
                        base + Vec3::Y * 0.32,
                        rng.range(0.0, TAU),
                        rng.range(0.85, 1.15),
                    ),
                );
            } else {
                let turn = if side < 0.0 { 0.0 } else { PI };
                scene.place(
                    trails[rng.below(3)],
                    at(vec3(x, 5.62, side * (BAY - 0.56)), turn, 1.0),
                );
            }
        }
    }
    for (x, z) in [(-15.8, -5.6), (-15.8, 5.6), (15.8, -5.6), (15.8, 5.6)] {
        let base = vec3(x, 0.0, z);
        scene.place(pot_mesh, at(base, 0.0, 0.5));
        scene.place(earth, at(base, 0.0, 0.5));
        scene.place(bushes[rng.below(3)], at(base + Vec3::Y * 0.45, 0.0, 1.6));
    }
}

pub(super) fn reliefs(scene: &mut SceneBuilder) {
    let lion = scene.numbers("lion-medallion")[0];
    let face = 0.375;
    for i in -3..=3 {
        for side in [-1.0f32, 1.0] {
            let place = vec3(i as f32 * BAY, 4.62, side * (BAY - face));
            scene.place(lion, at(place, if side < 0.0 { 0.0 } else { PI }, 0.34));
        }
    }
    for side in [-1.0f32, 1.0] {
        let place = vec3(side * (4.0 * BAY - face), 4.5, 0.0);
        scene.place(lion, at(place, -side * FRAC_PI_2, 0.46));
    }
}

pub(super) fn lamps(scene: &mut SceneBuilder) {
    let mesh = scene.numbers("lamp")[0];
    for i in [-4, -2, 0, 2] {
        for side in [-1.0, 1.0] {
            scene.place(
                mesh,
                at(
                    vec3((i as f32 + 0.5) * BAY, 3.3, side * 1.5 * BAY),
                    0.0,
                    1.0,
                ),
            );
        }
    }
}

/// The chain of a lamp.
pub(super) fn lamp_chain(lamp: &mut MeshBuilder) {
    for i in 0..12 {
        let y = 0.44 + i as f32 * 0.06;
        let tilt = if i % 2 == 0 { Vec3::X } else { Vec3::Z };
        lamp.ring([6, 3], 0.005, |sin, cos| {
            Vec3::Y * (y + 0.04 * sin) + tilt * (0.016 * cos)
        });
    }
}

pub(super) fn fountain(basin: &mut MeshBuilder) {
    let outer = profile(
        "1.35,0! 1.35,0.12! 1.18,0.16 1.12,0.34 1.2,0.46! 1.26,0.5 1.22,0.55! 1.04,0.55! 1,0.4 \
        0.96,0.22! 0.3,0.2! 0.2,0.3 0.13,0.6 0.16,0.84 0.36,0.98 0.58,1.08! 0.56,1.11! 0.3,1.03 \
        0.08,1! 0.07,1.14 0.1,1.22 0,1.32",
    );
    basin.lathe_shaped(&curve(&outer, 2), 48, |angle, y| {
        if y > 0.86 {
            1.0 + 0.05 * (12.0 * angle).cos()
        } else {
            1.0
        }
    });
}
