//! A jungle clearing with a temple ruin: a stand-in for GFXBench's T-Rex.
//!
//! A winding path leads to the ruin. Foliage with alpha masks is instanced from few meshes.

pub(crate) mod plants;
mod temple;

use super::creature;
use super::mesh_builder::{MeshBuilder, upright};
use super::noise::{Rng, bank, smoothstep};
use super::scene_builder::SceneBuilder;
use super::scene_text::Code;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// Half extent of the ground in metres.
const HALF: f32 = 34.0;
/// Centre of the temple's platform.
const TEMPLE: Vec3 = vec3(15.0, 0.0, 0.0);

/// Position of the creature.
const CREATURE: Vec3 = vec3(1.4, 0.0, -3.6);

/// The path: z as a function of x.
fn path_z(x: f32) -> f32 {
    1.6 * (0.16 * x + 2.2).sin() * smoothstep(12.0, 2.0, x)
}

/// Height of the ground in metres.
fn ground(x: f32, z: f32) -> f32 {
    let noise = bank();
    let aside = (z - path_z(x)).abs();
    let clearing = smoothstep(9.0, 14.0, vec2(x - TEMPLE.x, z - TEMPLE.z).length());
    let bank_height = 2.6 * smoothstep(2.0, 16.0, aside) * clearing;
    let hummocks = noise.cloud.smooth(x / 70.0 + 0.5, z / 70.0 + 0.5) - 0.4;
    let bumps = noise.mottle.smooth(x / 40.0, z / 40.0) - 0.5;
    let rough = smoothstep(0.8, 4.0, aside) * (0.3 + 0.7 * clearing);
    bank_height + rough * (2.2 * hummocks + 0.5 * bumps) + 0.05 * bumps
}

/// Materials of plants that have several.
const FERNS: [&str; 2] = ["fern-bright", "fern-dark"];
const BROAD: [&str; 2] = ["banana-leaf", "philodendron"];
const BUSHES: [&str; 3] = ["bush-bright", "bush-dark", "bush-red"];
const GRASSES: [&str; 2] = ["grass-green", "grass-dry"];
const CANOPIES: [&str; 2] = ["canopy-near", "canopy-far"];
const BARKS: [&str; 2] = ["bark-grey", "bark-brown"];
const ROCKS: [&str; 2] = ["rock-mossy", "rock-bare"];

/// What the scene's text names.
pub const CODE: Code = Code {
    shapes: &[
        ("limb", creature::limb_of),
        ("teeth", |m, row| creature::teeth(m, row.number())),
        ("toes", |m, row| creature::toes(m, row.number())),
    ],
    steps: &[
        ("cameras", |scene, _| cameras(scene)),
        ("place-creature", |scene, _| place_creature(scene)),
        ("plants", |scene, _| {
            let mut rng = Rng::new(2014);
            trees(scene, &mut rng);
            undergrowth(scene, &mut rng);
        }),
        ("temple", |scene, _| temple::build(scene, TEMPLE)),
        ("terrain", |scene, _| terrain(scene)),
    ],
};

/// Stands the creature beside the path.
fn place_creature(scene: &mut SceneBuilder) {
    let turn = Quat::from_rotation_y(4.3);
    let at = CREATURE.with_y(ground(CREATURE.x, CREATURE.z) - 0.03);
    for name in ["creature", "creature-teeth", "creature-eyes"] {
        let stand = Affine3A::from_rotation_translation(turn, at);
        scene.place(scene.numbers(name)[0], stand);
    }
}

fn cameras(scene: &mut SceneBuilder) {
    for (name, x, aside, target) in [
        ("default", -8.5, 0.0, vec3(6.0, 2.3, -0.9)),
        ("ruin", 3.8, 0.0, vec3(15.0, 3.4, -0.3)),
        ("thicket", -17.0, 2.4, vec3(-6.0, 1.2, -1.5)),
    ] {
        let z = path_z(x) + aside;
        scene.camera(name, 0.1, 120.0, vec3(x, ground(x, z) + 1.65, z), target);
    }
}

fn terrain(scene: &mut SceneBuilder) {
    let mut floor = MeshBuilder::new();
    floor.surface(72, 72, |s, t| {
        let (x, z) = (HALF * (2.0 * s - 1.0), HALF * (1.0 - 2.0 * t));
        (vec3(x, ground(x, z), z), vec2(x, z))
    });
    scene.add("forest-floor", floor, "forest-floor");
    let mut path = MeshBuilder::new();
    path.surface(8, 120, |s, t| {
        let x = -HALF + t * (HALF + 8.5);
        let ragged = 1.15 + 0.35 * (bank().mottle.smooth(x / 16.0, 0.5 + s.round() * 0.2) - 0.5);
        let z = path_z(x) + ragged * (2.0 * s - 1.0);
        // Just above the ground in the middle, below it at the edges.
        let lift = 0.045 - 0.12 * (2.0 * s - 1.0).powi(4);
        (vec3(x, ground(x, z) + lift, z), vec2(x, z))
    });
    path.orient(|_| Vec3::Y);
    scene.add("path", path, "trodden-earth");
}

/// Whether a plant that keeps `clear` metres from the path would be inside or in front of the
/// creature.
fn hides_creature(x: f32, z: f32, clear: f32) -> bool {
    let eye = vec2(-8.5, path_z(-8.5));
    let (to, at) = (vec2(CREATURE.x, CREATURE.z) - eye, vec2(x, z) - eye);
    let along = (at.dot(to) / to.length_squared()).clamp(0.0, 1.0);
    let aside = at.distance(to * along);
    let room = if along > 0.7 {
        2.0 + 0.4 * clear
    } else {
        0.35 * clear + 0.9 * along
    };
    clear > 1.2 && aside < room || at.distance(to) < 2.6
}

/// A spot at least `clear` metres off the path and off the temple, within `reach` of the path.
fn spot(rng: &mut Rng, clear: f32, reach: f32, temple: f32) -> Vec3 {
    loop {
        let x = rng.range(-28.0, 28.0);
        let side = if rng.bits() & 1 == 0 { 1.0 } else { -1.0 };
        // Denser along the path, where it is visible.
        let z = path_z(x) + side * (clear + (reach - clear) * rng.unit().powf(1.6));
        if z.abs() < HALF - 2.0
            && !hides_creature(x, z, clear)
            && vec2(x - TEMPLE.x, z - TEMPLE.z).length() > temple
        {
            return vec3(x, ground(x, z), z);
        }
    }
}

fn trees(scene: &mut SceneBuilder, rng: &mut Rng) {
    let kinds: Vec<[usize; 3]> = (0..3)
        .map(|i| {
            let (radius, height) = ([0.42, 0.55, 0.34][i], [9.5, 12.0, 8.0][i]);
            let crown = [4.6, 5.6, 3.8][i];
            let bark = BARKS[i % 2];
            let trunk =
                plants::buttressed_trunk(radius, height, [5.0, 6.0, 4.0][i], [30, 18], i as u64);
            [
                scene.mesh("trunk", trunk, bark),
                scene.mesh(
                    "boughs",
                    plants::boughs(height, crown, 7, radius * 0.4, rng),
                    bark,
                ),
                scene.mesh(
                    "canopy",
                    plants::canopy(height, crown, 140, rng),
                    CANOPIES[i % 2],
                ),
            ]
        })
        .collect();
    for i in 0..50 {
        let place = match i {
            0..14 => spot(rng, 3.2, 22.0, 10.0),
            14..34 => spot(rng, 5.0, 22.0, 10.0),
            _ => {
                // A wall of trees behind the ruin blocks the view.
                let (sin, cos) = (0.16 * (i as f32 - 41.5) + rng.jitter(0.05)).sin_cos();
                let (x, z) = (4.0 + 27.0 * cos, 25.0 * sin);
                vec3(x, ground(x, z), z)
            }
        };
        let place = upright(place, rng.range(0.0, TAU), rng.range(0.85, 1.25));
        for mesh in kinds[rng.below(3)] {
            scene.place(mesh, place);
        }
    }
    let palms: Vec<(usize, usize, Vec3)> = (0..3)
        .map(|i| {
            let (trunk, top) = plants::palm_trunk([4.2, 5.6, 3.1][i], [0.7, -1.2, 0.4][i]);
            let crown = plants::palm_crown(15, [2.3, 2.6, 1.9][i], rng);
            (
                scene.mesh("palm-trunk", trunk, "palm-bark"),
                scene.mesh("palm-crown", crown, "palm-feather"),
                top,
            )
        })
        .collect();
    for _ in 0..34 {
        let (trunk, crown, top) = palms[rng.below(3)];
        let place = upright(
            spot(rng, 2.4, 15.0, 8.6),
            rng.range(0.0, TAU),
            rng.range(0.8, 1.2),
        );
        scene.place(trunk, place);
        scene.place(crown, place * Affine3A::from_translation(top));
    }
    // Lianas hang across the path from tree to tree.
    for i in 0..12 {
        let x = -24.0 + 2.6 * i as f32 + rng.jitter(1.0);
        let (a, b) = (
            path_z(x) - rng.range(2.5, 5.0),
            path_z(x) + rng.range(2.5, 5.0),
        );
        let (a, b) = (
            vec3(x, 5.5 + rng.jitter(1.2), a),
            vec3(x + rng.jitter(2.0), 5.5 + rng.jitter(1.2), b),
        );
        let sag = rng.range(0.8, 2.0);
        scene.add("liana", plants::liana(a, b, sag, 0.035), "liana");
        scene.add(
            "liana-leaves",
            plants::liana_leaves(a, b, sag, 60, rng),
            "ivy",
        );
    }
}

/// Plants and rocks in several variants: their mesh, materials and number, the distances that they keep
/// ([`spot`]) and their smallest and largest size.
fn undergrowth(scene: &mut SceneBuilder, rng: &mut Rng) {
    use plants::{boulder, broadleaf, bush, fern, grass};
    type Variant = fn(usize, &mut Rng) -> MeshBuilder;
    type Kind<'a> = (&'a str, usize, Variant, &'a [&'a str], usize, [f32; 5]);
    let fans = &["palm-fan"; 2];
    let kinds: [Kind<'_>; 6] = [
        (
            "fern",
            4,
            |_, rng| fern(12, 0.95, rng),
            &FERNS,
            250,
            [1.35, 12.0, 7.2, 0.7, 1.4],
        ),
        (
            "fan-palm",
            2,
            |_, rng| bush(16, 1.3, rng),
            fans,
            50,
            [2.2, 14.0, 8.4, 0.8, 1.3],
        ),
        (
            "broadleaf",
            4,
            |i, rng| broadleaf(9, [1.7, 1.0][i % 2], rng),
            &BROAD,
            90,
            [1.9, 13.0, 8.0, 0.75, 1.3],
        ),
        (
            "bush",
            6,
            |_, rng| bush(22, 0.95, rng),
            &BUSHES,
            140,
            [2.0, 16.0, 7.8, 0.7, 1.6],
        ),
        (
            "grass",
            4,
            |_, rng| grass(9, 0.5, 0.42, rng),
            &GRASSES,
            260,
            [1.0, 9.0, 6.6, 0.7, 1.3],
        ),
        (
            "boulder",
            4,
            |i, _| boulder([22, 14], i as u64),
            &ROCKS,
            60,
            [1.5, 13.0, 7.0, 0.18, 0.8],
        ),
    ];
    let mut seeds = Rng::new(99);
    for (name, variants, mesh, materials, count, [clear, reach, temple, small, large]) in kinds {
        let meshes: Vec<usize> = (0..variants)
            .map(|i| scene.mesh(name, mesh(i, &mut seeds), materials[i % materials.len()]))
            .collect();
        for _ in 0..count {
            let place = spot(rng, clear, reach, temple);
            let mesh = meshes[rng.below(variants)];
            scene.place(
                mesh,
                upright(place, rng.range(0.0, TAU), rng.range(small, large)),
            );
        }
    }
}
