//! Lavender rows in front of a farm house, modelled on Provence: 600 K triangles.

mod house;
mod parts;

use super::jungle::plants::{boughs, buttressed_trunk};
use super::mesh_builder::{MeshBuilder, upright};
use super::noise::{Rng, bank, smoothstep};
use super::row::Row;
use super::scene_builder::SceneBuilder;
use super::scene_text::Code;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// Number of triangles up to which grass fills the scene.
const TRIANGLES: u64 = 600_000;
/// Position of the farm house.
pub(super) const HOUSE: Vec3 = vec3(7.5, 0.0, -27.0);
/// Distance between rows in metres.
const ROW: f32 = 1.7;

/// Materials of lavender flowers.
const LAVENDER: [&str; 2] = ["lavender-flower", "lavender-pale"];

/// Height of the ground in metres.
pub(super) fn ground(x: f32, z: f32) -> f32 {
    let noise = bank();
    let swell = noise.cloud.smooth(x / 260.0 + 0.37, z / 260.0 + 0.11) - 0.5;
    let hills = 9.0 * smoothstep(45.0, 130.0, vec2(x, z + 10.0).length());
    let yard = smoothstep(7.0, 16.0, vec2(x - HOUSE.x, z - HOUSE.z).length());
    yard * (1.6 * swell + hills * (0.6 + 1.4 * swell.abs())) + 0.012 * -z.min(0.0) * yard
}

/// What the scene's text names.
pub const CODE: Code = Code {
    shapes: &[],
    steps: &[
        ("cameras", |scene, _| cameras(scene)),
        ("farm-house", house::farm_house),
        ("garden-and-plants", |scene, row| {
            let mut rng = Rng::new(600);
            garden_wall(scene, &mut rng);
            trees(scene, row, &mut rng);
            lavender(scene, &mut rng);
            grass_and_poppies(scene, &mut rng);
        }),
        ("land", |scene, _| land(scene)),
    ],
};

fn upright_at(x: f32, z: f32, turn: f32, scale: f32) -> Affine3A {
    upright(vec3(x, ground(x, z), z), turn, scale)
}

fn cameras(scene: &mut SceneBuilder) {
    for (name, near, [x, height, z], target) in [
        ("default", 0.1, [0.85, 1.55, 6.6], vec3(2.6, 0.75, -14.0)),
        ("yard", 0.1, [1.5, 1.55, -17.5], HOUSE + vec3(0.5, 2.2, 0.0)),
        ("rows", 0.05, [-4.2, 0.9, 3.0], vec3(-3.0, 0.4, -8.0)),
    ] {
        scene.camera(name, near, 400.0, vec3(x, ground(x, z) + height, z), target);
    }
}

fn land(scene: &mut SceneBuilder) {
    let mut far = MeshBuilder::new();
    far.surface(96, 96, |s, t| {
        // Cell size grows with distance.
        let spread = |a: f32| (2.0 * a - 1.0).abs().powf(1.7) * (2.0 * a - 1.0).signum();
        let (x, z) = (125.0 * spread(s), -10.0 - 125.0 * spread(t));
        (vec3(x, ground(x, z) - 0.05, z), vec2(x, z + 10.0))
    });
    scene.add("grassland", far, "grassland");
    let mut field = MeshBuilder::new();
    field.surface(60, 120, |s, t| {
        let (x, z) = (-17.0 + 34.0 * s, 5.2 - 26.0 * t);
        let ridge = 0.10 * (TAU * x / ROW).cos();
        let rim = smoothstep(0.0, 0.03, s.min(1.0 - s).min(t).min(1.0 - t));
        (
            vec3(x, ground(x, z) - 0.12 + (0.14 + ridge) * rim, z),
            vec2(x, z + 8.0),
        )
    });
    scene.add("field", field, "lavender-field");
}

/// A dry-stone wall along the edge of the yard, with a gap for the gate.
fn garden_wall(scene: &mut SceneBuilder, rng: &mut Rng) {
    let mut m = MeshBuilder::new();
    for course in 0..4 {
        let mut x = -9.0;
        while x < 16.0 {
            let w = rng.range(0.28, 0.62);
            let middle = x + 0.5 * w;
            if !(1.2..3.6).contains(&middle) {
                let (z, y) = (
                    -20.8 + rng.jitter(0.03),
                    0.21 * course as f32 + ground(middle, -20.8) - 0.08,
                );
                let (half, height) = (0.5 * w - 0.008, 0.2 + rng.jitter(0.012));
                let (low, high) = (vec3(-half, 0.0, -0.2), vec3(half, height, 0.2));
                let turn = Quat::from_rotation_y(rng.jitter(0.06))
                    * Quat::from_rotation_z(rng.jitter(0.03));
                let place = Affine3A::from_rotation_translation(turn, vec3(middle, y, z));
                m.merge_block(low, high, 0.035, place);
            }
            x += w;
        }
    }
    scene.add("garden-wall", m, "field-stone");
}

/// Oaks and olives at the points (x, z, kind) of a row, then cypresses at points (x, z).
fn trees(scene: &mut SceneBuilder, row: &mut Row, rng: &mut Rng) {
    let oaks: Vec<[usize; 3]> = (0..3)
        .map(|i| {
            let (height, radius) = ([5.2, 4.2, 3.4][i], [3.4, 2.7, 2.3][i]);
            let foliage = if i == 2 { "olive-leaf" } else { "oak-leaf" };
            [
                scene.mesh(
                    "trunk",
                    buttressed_trunk(0.26, height, 5.0, [18, 10], 40 + i as u64),
                    "bark",
                ),
                scene.mesh(
                    "boughs",
                    boughs(height * 0.85, radius, 8, 0.10, rng),
                    "bark",
                ),
                scene.mesh(
                    "crown",
                    parts::crown(4200, height + 0.2, radius, rng),
                    foliage,
                ),
            ]
        })
        .collect();
    for [x, z, kind] in row.points() {
        let place = upright_at(x, z, rng.range(0.0, TAU), rng.range(0.9, 1.15));
        for mesh in oaks[kind as usize] {
            scene.place(mesh, place);
        }
    }
    let spire = scene.mesh("cypress", parts::cypress(2600, 7.5, 0.85, rng), "cypress");
    row.expect("cypresses");
    for [x, z] in row.points() {
        scene.place(
            spire,
            upright_at(x, z, rng.range(0.0, TAU), rng.range(0.85, 1.2)),
        );
    }
}

fn lavender(scene: &mut SceneBuilder, rng: &mut Rng) {
    let bushes =
        |scene: &mut SceneBuilder, stalks: usize, spike: f32, rng: &mut Rng| -> Vec<[usize; 2]> {
            (0..4)
                .map(|i| {
                    let [green, purple] = parts::lavender(stalks, 0.52, spike, rng);
                    [
                        scene.mesh("lavender-stems", green, "lavender-stem"),
                        scene.mesh("lavender-flowers", purple, LAVENDER[i % 2]),
                    ]
                })
                .collect()
        };
    let near = bushes(scene, 112, 0.0095, rng);
    let far = bushes(scene, 36, 0.014, rng);
    for row in -9i32..=9 {
        let x = row as f32 * ROW;
        let mut z = 4.6;
        while z > -19.6 {
            let close = vec2(x - 0.85, z - 6.6).length() < 12.0;
            let kinds = if close { &near } else { &far };
            let kind = kinds[rng.below(kinds.len())];
            let place = upright_at(
                x + rng.jitter(0.06),
                z,
                rng.range(0.0, TAU),
                rng.range(0.9, 1.2),
            );
            for mesh in kind {
                scene.place(mesh, place);
            }
            z -= 0.58 + rng.jitter(0.06);
        }
    }
}

fn grass_and_poppies(scene: &mut SceneBuilder, rng: &mut Rng) {
    let poppies: Vec<[usize; 2]> = (0..3)
        .map(|_| {
            let [green, red] = parts::poppy(0.42, rng);
            [
                scene.mesh("poppy-stem", green, "grass"),
                scene.mesh("poppy-petals", red, "poppy"),
            ]
        })
        .collect();
    for _ in 0..320 {
        let (x, z) = (rng.jitter(8.0), rng.range(4.9, 8.6));
        if vec2(x - 0.85, z - 6.6).length() < 0.9 {
            continue;
        }
        let place = upright_at(x, z, rng.range(0.0, TAU), rng.range(0.8, 1.2));
        for mesh in poppies[rng.below(3)] {
            scene.place(mesh, place);
        }
    }
    let blades = 11;
    let tufts: Vec<usize> = (0..6)
        .map(|i| {
            let material = if i % 3 == 2 { "straw" } else { "grass" };
            scene.mesh("tuft", parts::tuft(blades, 0.30, rng), material)
        })
        .collect();
    // Grass uses the remaining triangles.
    let left = TRIANGLES.saturating_sub(scene.triangles()) / (3 * blades as u64);
    for i in 0..left {
        let (x, z) = match i % 5 {
            // In front of the field, along its sides, in the yard, and between the rows.
            0 | 4 => (rng.jitter(8.0), rng.range(4.6, 8.2)),
            1 => (
                (17.2 + rng.range(0.0, 9.0)) * rng.jitter(1.0).signum(),
                rng.range(-24.0, 8.0),
            ),
            2 => (rng.range(-16.0, 22.0), rng.range(-31.0, -20.2)),
            _ => (
                (rng.below(18) as f32 - 8.5) * ROW + rng.jitter(0.25),
                rng.range(-19.5, 4.8),
            ),
        };
        let size = if i % 5 == 3 { 0.45 } else { 1.0 };
        scene.place(
            tufts[rng.below(tufts.len())],
            upright_at(x, z, rng.range(0.0, TAU), size * rng.range(0.7, 1.3)),
        );
    }
}
