//! A musical movement in an open wooden box: pinned cylinder, comb, spring barrel, gear train and
//! air governor. 106 K triangles of brass and steel.

mod train;

use super::gears::screw;
use super::mesh_builder::{MeshBuilder, rounded, sharp, turned};
use super::noise::{Rng, smoothstep};
use super::organic::{damask, polished_wood};
use super::scene_builder::SceneBuilder;
use super::texture_synth::{Maps, Recipe, rgb, tones};
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use scene::Scene;
use std::f32::consts::{FRAC_PI_2, TAU};

/// Module of the train's gears in metres.
pub(super) const MODULE: f32 = 0.0009;
/// The cylinder: centre, half length along x, radius.
pub(super) const CYLINDER: Vec3 = vec3(0.004, 0.0275, -0.006);
pub(super) const CYLINDER_HALF: f32 = 0.042;
const CYLINDER_RADIUS: f32 = 0.0115;
/// Teeth of the comb.
const TINES: usize = 64;

fn materials(scene: &mut SceneBuilder) {
    let recipe =
        |name, size, tile_m, surface| Recipe::new(name, size, Maps::Color, tile_m, surface);
    let rosewood = polished_wood(tones(0x7a3f26, 0x3a1a10), 0.25);
    scene.polished(recipe("rosewood", 1024, 0.25, rosewood), 0.2, 0.06);
    let velvet = damask(rgb(0x5a1424), rgb(0x74202e), 4.0);
    scene.polished(recipe("velvet", 512, 0.10, velvet), 0.95, 0.0);
    let table = polished_wood(tones(0xb98a58, 0x8a6038), 0.4);
    scene.polished(recipe("table", 1024, 0.7, table), 0.4, 0.03);
    scene.metal("brass", 0xdcb45e, 0.22, 0.25);
    scene.metal("polished-brass", 0xe8bf62, 0.08, 0.6);
    scene.metal("steel", 0xcfd3d8, 0.1, 0.6);
    scene.metal("blued-steel", 0x2f4a86, 0.15, 0.45);
    scene.plain("ruby", rgb(0xd01840), 0.05, |m| {
        m.transmission = 0.6;
        m.ior = 1.76;
    });
}

/// The scene.
pub fn scene() -> Scene {
    let mut scene = SceneBuilder::new("music-box");
    materials(&mut scene);
    casket(&mut scene);
    cylinder(&mut scene);
    comb(&mut scene);
    train::train(&mut scene);
    train::fittings(&mut scene);
    train::bells(&mut scene);
    scene.cameras(
        0.01,
        10.0,
        [
            (
                "default",
                vec3(-0.002, 0.096, 0.070),
                vec3(0.004, 0.020, -0.010),
            ),
            (
                "train",
                vec3(-0.085, 0.075, 0.075),
                vec3(-0.045, 0.022, -0.004),
            ),
        ],
    );
    scene.sun(vec3(-0.4, -0.8, -0.45), vec3(1.25, 1.2, 1.1));
    scene.lamp(vec3(0.25, 0.35, 0.2), vec3(0.12, 0.11, 0.09));
    scene.finish(vec3(0.36, 0.39, 0.43), 0)
}

/// A box with an open, velvet-lined lid, on a table.
fn casket(scene: &mut SceneBuilder) {
    let (w, d, h, t) = (0.092, 0.062, 0.052, 0.007);
    let mut wood = MeshBuilder::new();
    wood.block(vec3(-w, 0.0, -d), vec3(w, 0.006, d), 0.0015);
    for s in [-1.0f32, 1.0] {
        let (z0, z1) = (s * d, s * (d - t));
        wood.block(vec3(-w, 0.006, z0.min(z1)), vec3(w, h, z0.max(z1)), 0.0015);
        let (x0, x1) = (s * w, s * (w - t));
        wood.block(
            vec3(x0.min(x1), 0.006, -d + t),
            vec3(x0.max(x1), h, d - t),
            0.0012,
        );
        for z in [-d + 0.012, d - 0.012] {
            let foot = rounded("0,-0.009! 0.006,-0.008 0.008,-0.004 0.006,0!", 3, 24);
            wood.merge(
                &foot,
                Affine3A::from_translation(vec3(s * (w - 0.012), 0.0, z)),
            );
        }
    }
    scene.add("casket", wood, "rosewood");
    // The lid leans back at its hinges.
    let hinge = Affine3A::from_rotation_translation(Quat::from_rotation_x(-1.95), vec3(0.0, h, -d));
    let mut lid = MeshBuilder::new();
    lid.block(vec3(-w, 0.0, 0.0), vec3(w, 0.006, 2.0 * d), 0.002);
    for s in [-1.0f32, 1.0] {
        let (x0, x1) = (s * w, s * (w - t));
        lid.block(
            vec3(x0.min(x1), -0.014, 0.0),
            vec3(x0.max(x1), 0.0, 2.0 * d),
            0.0012,
        );
    }
    lid.block(vec3(-w + t, -0.014, 0.0), vec3(w - t, 0.0, t), 0.0012);
    lid.block(
        vec3(-w + t, -0.014, 2.0 * d - t),
        vec3(w - t, 0.0, 2.0 * d),
        0.0012,
    );
    scene.put("lid", lid, "rosewood", hinge);
    let mut lining = MeshBuilder::new();
    lining.quad(
        vec3(-w + t, -0.0006, t),
        Vec3::X * 2.0 * (w - t),
        Vec3::Z * 2.0 * (d - t),
        vec2(0.0, 0.0),
    );
    scene.put("lining", lining, "velvet", hinge);
    let mut bed = MeshBuilder::new();
    bed.panel(
        vec3(-w + t, 0.0066, d - t),
        Vec3::X * 2.0 * (w - t),
        Vec3::NEG_Z * 2.0 * (d - t),
        8,
        6,
    );
    scene.add("velvet", bed, "velvet");
    let mut barrel = MeshBuilder::new();
    for x in [-0.06, 0.06] {
        barrel.rod(
            vec3(x - 0.01, h, -d - 0.001),
            vec3(x + 0.01, h, -d - 0.001),
            0.002,
            14,
        );
    }
    scene.add("hinges", barrel, "polished-brass");
    let mut table = MeshBuilder::new();
    table.panel(
        vec3(-0.7, -0.009, 0.6),
        Vec3::X * 1.4,
        Vec3::NEG_Z * 1.2,
        10,
        10,
    );
    scene.add("table", table, "table");
}

fn cylinder(scene: &mut SceneBuilder) {
    let along_x = Quat::from_rotation_z(-FRAC_PI_2);
    let mut drum = MeshBuilder::new();
    let (r, half) = (CYLINDER_RADIUS, CYLINDER_HALF);
    let outline = [
        sharp(0.0, -half - 0.004),
        sharp(0.0022, -half - 0.004),
        sharp(0.0022, -half),
        sharp(0.92 * r, -half),
        sharp(r, -half + 0.0008),
        sharp(r, half - 0.0008),
        sharp(0.92 * r, half),
        sharp(0.0022, half),
        sharp(0.0022, half + 0.004),
        sharp(0.0, half + 0.004),
    ];
    drum.lathe(&outline, 96);
    scene.put(
        "cylinder",
        drum,
        "polished-brass",
        Affine3A::from_rotation_translation(along_x, CYLINDER),
    );
    // Pins: a melody of chords and runs on the tracks of the comb's tines.
    let pin = turned(
        "0.00022,-0.0004! 0.0002,0.001! 0.00013,0.00125 0,0.00132",
        6,
    );
    let mut rng = Rng::new(1796);
    let mut pins = MeshBuilder::new();
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
    scene.add("pins", pins, "steel");
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
