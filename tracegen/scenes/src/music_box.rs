//! Shapes and steps of the music box: what its text cannot say.

mod train;

use super::gears::{screw, worm};
use super::mesh_builder::{MeshBuilder, turned};
use super::noise::{Rng, smoothstep};
use super::scene_builder::SceneBuilder;
use super::scene_text::Code;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// Module of the train's gears in metres.
pub(super) const MODULE: f32 = 0.0009;
/// The cylinder: centre, half length along x, radius.
pub(super) const CYLINDER: Vec3 = vec3(0.004, 0.0275, -0.006);
pub(super) const CYLINDER_HALF: f32 = 0.042;
const CYLINDER_RADIUS: f32 = 0.0115;
/// Teeth of the comb.
const TINES: usize = 64;

/// What the scene's text names.
pub const CODE: Code = Code {
    shapes: &[
        ("fan", |m, _| train::fan(m)),
        ("mainspring", |m, _| train::mainspring(m)),
        ("pins", |m, _| pins(m)),
        ("screw", |m, row| m.append(screw(row.number()))),
        ("worm", |m, _| m.append(worm(0.0016, 0.014, 9.0, 18))),
    ],
    steps: &[
        ("bells", |scene, _| train::bells(scene)),
        ("comb", |scene, _| comb(scene)),
        ("train", |scene, _| train::train(scene)),
    ],
};

/// A melody of chords and runs on the tracks of the comb's tines.
fn pins(pins: &mut MeshBuilder) {
    let r = CYLINDER_RADIUS;
    let pin = turned(
        "0.00022,-0.0004! 0.0002,0.001! 0.00013,0.00125 0,0.00132",
        6,
    );
    let mut rng = Rng::new(1796);
    for beat in 0..96 {
        let chord = if beat % 8 == 0 {
            14
        } else if beat % 2 == 0 {
            11
        } else {
            9
        };
        let root = 8.0 + 40.0 * (0.5 + 0.5 * (beat as f32 * 0.21).sin());
        for note in 0..chord {
            let tine = (root as usize + note * 4 + rng.below(4)) % TINES;
            let x = tine_x(tine) + rng.jitter(0.00006);
            let angle = TAU * (beat as f32 + rng.jitter(0.1)) / 96.0;
            let lean = Quat::from_rotation_x(angle);
            let at = CYLINDER + vec3(x - CYLINDER.x, 0.0, 0.0) + lean * (Vec3::Y * r);
            pins.merge(&pin, Affine3A::from_rotation_translation(lean, at));
        }
    }
}

/// Position of a tine (and its track of pins) along x.
fn tine_x(tine: usize) -> f32 {
    let half = CYLINDER_HALF - 0.004;
    CYLINDER.x + half * (2.0 * (tine as f32 + 0.5) / TINES as f32 - 1.0)
}

/// The comb: tines cut to length, lead weights under the bass, held by a clamp with screws.
fn comb(scene: &mut SceneBuilder) {
    let mut steel = MeshBuilder::new();
    let tip = CYLINDER.z + CYLINDER_RADIUS + 0.0011;
    let root = tip + 0.0235;
    let y = CYLINDER.y + 0.0006;
    let pitch = tine_x(1) - tine_x(0);
    for tine in 0..TINES {
        let x = tine_x(tine);
        let length = 0.0215 - 0.011 * (tine as f32 / TINES as f32);
        let width = 0.36 * pitch;
        // Thin along its length, thick at the root, with a pointed tip.
        let mut one = MeshBuilder::new();
        let profile = |t: f32| 0.00042 + 0.0005 * smoothstep(0.7, 1.0, t);
        for (side, up) in [(1.0f32, true), (-1.0, false)] {
            let mut face = MeshBuilder::new();
            face.surface(2, 12, |s, t| {
                let half = width * (0.45 + 0.55 * smoothstep(0.0, 0.10, t));
                let z = tip + (root - tip) * 0.02 + length * t;
                let p = vec3(x + half * (2.0 * s - 1.0), y + side * profile(t), z);
                (p, vec2(p.x, p.z))
            });
            face.orient(|_| if up { Vec3::Y } else { Vec3::NEG_Y });
            one.merge(&face, Affine3A::IDENTITY);
            let mut edge = MeshBuilder::new();
            edge.surface(1, 12, |s, t| {
                let half = width * (0.45 + 0.55 * smoothstep(0.0, 0.10, t));
                let z = tip + (root - tip) * 0.02 + length * t;
                let p = vec3(x + side * half, y + profile(t) * (2.0 * s - 1.0), z);
                (p, vec2(p.z, p.y))
            });
            edge.orient(|_| Vec3::X * side);
            one.merge(&edge, Affine3A::IDENTITY);
        }
        let front = tip + (root - tip) * 0.02;
        let half = width * 0.45;
        one.quad(
            vec3(x + half, y - 0.00042, front),
            Vec3::X * (-2.0 * half),
            Vec3::Y * 0.00084,
            vec2(0.0, 0.0),
        );
        steel.merge(&one, Affine3A::IDENTITY);
        steel.block(
            vec3(x - 0.5 * pitch, y - 0.0009, front + length),
            vec3(x + 0.5 * pitch, y + 0.0009, root + 0.001),
            0.0,
        );
        if tine < TINES / 2 {
            let weight = 0.0042 * (1.0 - 1.6 * tine as f32 / TINES as f32);
            steel.block(
                vec3(x - width, y - 0.0006 - weight, front + 0.001),
                vec3(x + width, y - 0.0004, front + 0.001 + 0.006),
                0.0002,
            );
        }
    }
    let (x0, x1) = (tine_x(0) - pitch, tine_x(TINES - 1) + pitch);
    steel.block(
        vec3(x0, y - 0.0011, root),
        vec3(x1, y + 0.0011, root + 0.010),
        0.0003,
    );
    scene.add("comb", steel, "steel");
    let mut clamp = MeshBuilder::new();
    clamp.block(
        vec3(x0 - 0.001, y + 0.0011, root + 0.002),
        vec3(x1 + 0.001, y + 0.0036, root + 0.0105),
        0.0006,
    );
    clamp.block(
        vec3(x0 - 0.001, 0.009, root + 0.001),
        vec3(x1 + 0.001, y - 0.0011, root + 0.011),
        0.0008,
    );
    scene.add("comb-clamp", clamp, "brass");
    let head = scene.mesh("clamp-screw", screw(0.0023), "blued-steel");
    for i in 0..7 {
        let x = x0 + (x1 - x0) * (i as f32 + 0.5) / 7.0;
        let turn = Quat::from_rotation_y(1.3 * i as f32);
        scene.place(
            head,
            Affine3A::from_rotation_translation(turn, vec3(x, y + 0.0036, root + 0.0062)),
        );
    }
}
