//! Shapes and steps of the sports car: what its text cannot say.

mod body;
mod details;

use super::mesh_builder::{MeshBuilder, curve, profile};
use super::scene_builder::SceneBuilder;
use super::scene_text::Code;
use body::{AXLES, TYRE};
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// What the scene's text names.
pub const CODE: Code = Code {
    shapes: &[
        ("backdrop", |m, _| backdrop(m)),
        ("caliper", |m, _| details::caliper(m)),
        ("seam", details::seam),
        ("seat", |m, row| seat(m, row.number())),
        ("spokes", |m, _| details::spokes(m)),
        ("steering-wheel", |m, _| steering_wheel(m)),
        ("wheel-houses", |m, _| wheel_houses(m)),
    ],
    steps: &[
        ("details", |scene, _| details::details(scene)),
        ("skin", |scene, _| skin(scene)),
        ("wheels", |scene, _| details::wheels(scene)),
    ],
};

fn skin(scene: &mut SceneBuilder) {
    scene.add("body", body::body_mesh(92, 40), "paint");
    scene.add("intake", body::end_cap(32, true), "trim");
    scene.add("rear-panel", body::end_cap(32, false), "paint");
    let [paint, glass, trim] = body::cabin_meshes(60, 52);
    scene.add("roof", paint, "paint");
    scene.add("windows", glass, "glass");
    scene.add("window-trim", trim, "trim");
}

/// Wheel houses: only the upper part of a drum, above the floor pan.
fn wheel_houses(pan: &mut MeshBuilder) {
    let mut house = MeshBuilder::new();
    let r = TYRE + 0.05;
    let arc = |s: f32| {
        let (sin, cos) = (PI * (1.12 * s - 0.06)).sin_cos();
        vec2(r * cos, r * sin)
    };
    house.surface(28, 1, |s, t| {
        (vec3(arc(s).x, arc(s).y, -0.35 * t), vec2(s, t))
    });
    house.orient(|p| -vec3(p.x, p.y, 0.0));
    let mut back = MeshBuilder::new();
    back.surface(28, 1, |s, t| {
        (
            vec3(arc(s).x, arc(s).y * t - 0.07 * (1.0 - t), -0.35),
            vec2(s, t),
        )
    });
    back.orient(|_| Vec3::Z);
    house.merge(&back, Affine3A::IDENTITY);
    for x in AXLES {
        for side in [-1.0f32, 1.0] {
            let turn = Quat::from_rotation_y(if side > 0.0 { 0.0 } else { PI });
            pan.merge(
                &house,
                Affine3A::from_rotation_translation(turn, vec3(x, TYRE, side * 0.885)),
            );
        }
    }
}

/// A seat whose middle is at `z`.
fn seat(seats: &mut MeshBuilder, z: f32) {
    let at = vec3(-0.38, 0.34, z);
    let cushion = |m: &mut MeshBuilder, center: Vec3, size: Vec3, turn: Quat| {
        let mut pad = MeshBuilder::new();
        pad.surface(16, 8, |s, t| {
            let (sin, cos) = (TAU * (s - s.floor())).sin_cos();
            let (up, out) = (PI * (t - 0.5)).sin_cos();
            let soft = |c: f32| c.signum() * c.abs().powf(0.45);
            let p = vec3(soft(cos) * soft(out), soft(up), -soft(sin) * soft(out)) * size;
            (p, vec2(p.x + p.y, p.z))
        });
        pad.orient(|p| p);
        m.merge(&pad, Affine3A::from_rotation_translation(turn, center));
    };
    cushion(
        seats,
        at,
        vec3(0.26, 0.075, 0.23),
        Quat::from_rotation_z(0.12),
    );
    cushion(
        seats,
        at + vec3(-0.32, 0.30, 0.0),
        vec3(0.075, 0.32, 0.22),
        Quat::from_rotation_z(0.28),
    );
    cushion(
        seats,
        at + vec3(-0.45, 0.63, 0.0),
        vec3(0.05, 0.085, 0.12),
        Quat::from_rotation_z(0.28),
    );
    for k in [-1.0f32, 1.0] {
        cushion(
            seats,
            at + vec3(-0.27, 0.24, k * 0.20),
            vec3(0.07, 0.22, 0.045),
            Quat::from_rotation_z(0.28),
        );
    }
}

fn steering_wheel(dash: &mut MeshBuilder) {
    let hub = vec3(0.20, 0.72, -0.34);
    let lean = Quat::from_rotation_z(0.4);
    dash.ring([36, 10], 0.014, |sin, cos| {
        hub + lean * vec3(0.0, 0.175 * sin, 0.175 * cos)
    });
    for a in [0.1f32, PI - 0.1, -FRAC_PI_2] {
        let (sin, cos) = a.sin_cos();
        dash.tube(
            &[
                (hub + lean * vec3(0.03, 0.0, 0.0), 0.02),
                (hub + lean * vec3(0.0, 0.17 * sin, 0.17 * cos), 0.011),
            ],
            8,
        );
    }
}

/// A round floor that runs up into the backdrop in one curve; uv unrolls from the middle.
fn backdrop(floor: &mut MeshBuilder) {
    let profile = profile("9,4.2! 9,2.6 8.4,0.9 7.4,0.15 6.4,0 3.2,0 0,0");
    floor.lathe(&curve(&profile, 2), 40);
    for (p, uv) in floor.positions.iter().zip(&mut floor.uvs) {
        let out = vec2(p.x, p.z);
        *uv = out + out.normalize_or_zero() * p.y;
    }
}
