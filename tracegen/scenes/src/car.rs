//! A sports car in a studio: paint, glass, chrome, rubber. 55 K triangles.

mod body;
mod details;

use super::masonry::carved_stone;
use super::mesh_builder::{MeshBuilder, curve, profile};
use super::organic::damask;
use super::scene_builder::SceneBuilder;
use super::texture_synth::{Maps, Recipe, rgb, tones};
use body::{AXLES, TYRE};
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use scene::Scene;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

fn materials(scene: &mut SceneBuilder) {
    let floor = carved_stone(tones(0x75787d, 0x6c6f74), 0.0, 0.0, 0.2);
    let floor = Recipe::new("studio-floor", 1024, Maps::ColorNormal, 4.0, floor);
    scene.polished(floor, 0.2, 0.10);
    let leather = damask(rgb(0x7a4a2c), rgb(0x6a3f25), 8.0);
    let leather = Recipe::new("leather", 512, Maps::Color, 0.4, leather);
    scene.polished(leather, 0.6, 0.0);
    scene.plain("paint", rgb(0xb3141c), 0.08, |m| {
        m.mirror = 0.12;
        m.double_sided = true;
    });
    scene.plain("glass", rgb(0xdce8e4), 0.0, |m| {
        m.transmission = 0.88;
        m.ior = 1.05;
        m.mirror = 0.06;
        m.double_sided = true;
    });
    scene.plain("trim", rgb(0x16171a), 0.4, |m| m.double_sided = true);
    scene.metal("chrome", 0xd8dce0, 0.03, 0.8);
    scene.metal("alloy", 0xb8bcc2, 0.2, 0.4);
    scene.plain("tyre", rgb(0x1d1d1f), 0.85, |_| {});
    scene.plain("headlamp", rgb(0xf0f4f8), 0.0, |m| {
        m.transmission = 0.8;
        m.ior = 1.3;
        m.mirror = 0.1;
    });
    scene.plain("tail-lamp", rgb(0xc01018), 0.1, |m| {
        m.emissive = vec3(0.5, 0.02, 0.02);
        m.mirror = 0.1;
    });
    scene.metal("brake", 0x90949a, 0.3, 0.2);
}

/// The scene.
pub fn scene() -> Scene {
    let mut scene = SceneBuilder::new("car");
    materials(&mut scene);
    skin(&mut scene);
    details::wheels(&mut scene);
    details::details(&mut scene);
    interior(&mut scene);
    studio(&mut scene);
    scene.cameras(
        0.05,
        60.0,
        [
            ("default", vec3(2.2, 1.02, 1.5), vec3(0.35, 0.55, 0.0)),
            ("rear", vec3(-3.0, 1.25, 1.75), vec3(-0.4, 0.6, 0.0)),
            ("side", vec3(0.15, 1.0, 2.6), vec3(0.0, 0.6, 0.0)),
        ],
    );
    scene.sun(vec3(-0.45, -0.80, -0.40), vec3(1.35, 1.3, 1.2));
    scene.lamp(vec3(2.5, 3.2, 2.2), vec3(3.2, 3.3, 3.6));
    scene.finish(vec3(0.30, 0.34, 0.40), 0)
}

fn skin(scene: &mut SceneBuilder) {
    scene.add("body", body::body_mesh(92, 40), "paint");
    scene.add("intake", body::end_cap(32, true), "trim");
    scene.add("rear-panel", body::end_cap(32, false), "paint");
    let [paint, glass, trim] = body::cabin_meshes(60, 52);
    scene.add("roof", paint, "paint");
    scene.add("windows", glass, "glass");
    scene.add("window-trim", trim, "trim");
    // Floor pan and wheel houses.
    let mut pan = MeshBuilder::new();
    pan.block(vec3(-1.9, 0.19, -0.55), vec3(1.75, 0.25, 0.55), 0.01);
    pan.block(vec3(-0.85, 0.17, -0.84), vec3(0.85, 0.22, 0.84), 0.01);
    let mut house = MeshBuilder::new();
    // Only the upper part of the drum, above the floor pan.
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
    scene.add("floor-pan", pan, "trim");
}

fn interior(scene: &mut SceneBuilder) {
    let mut seats = MeshBuilder::new();
    for side in [-1.0f32, 1.0] {
        let at = vec3(-0.38, 0.34, side * 0.34);
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
            &mut seats,
            at,
            vec3(0.26, 0.075, 0.23),
            Quat::from_rotation_z(0.12),
        );
        cushion(
            &mut seats,
            at + vec3(-0.32, 0.30, 0.0),
            vec3(0.075, 0.32, 0.22),
            Quat::from_rotation_z(0.28),
        );
        cushion(
            &mut seats,
            at + vec3(-0.45, 0.63, 0.0),
            vec3(0.05, 0.085, 0.12),
            Quat::from_rotation_z(0.28),
        );
        for k in [-1.0f32, 1.0] {
            cushion(
                &mut seats,
                at + vec3(-0.27, 0.24, k * 0.20),
                vec3(0.07, 0.22, 0.045),
                Quat::from_rotation_z(0.28),
            );
        }
    }
    scene.add("seats", seats, "leather");
    let mut dash = MeshBuilder::new();
    dash.block(vec3(0.36, 0.52, -0.66), vec3(0.80, 0.80, 0.66), 0.06);
    dash.block(vec3(-0.5, 0.24, -0.10), vec3(0.45, 0.50, 0.10), 0.03);
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
    scene.add("dashboard", dash, "trim");
}

fn studio(scene: &mut SceneBuilder) {
    // A round floor that runs up into the backdrop in one curve; uv unrolls from the middle.
    let mut floor = MeshBuilder::new();
    let profile = profile("9,4.2! 9,2.6 8.4,0.9 7.4,0.15 6.4,0 3.2,0 0,0");
    floor.lathe(&curve(&profile, 2), 40);
    for (p, uv) in floor.positions.iter().zip(&mut floor.uvs) {
        let out = vec2(p.x, p.z);
        *uv = out + out.normalize_or_zero() * p.y;
    }
    scene.add("studio", floor, "studio-floor");
}
