//! A jungle clearing with a temple ruin: a stand-in for GFXBench's T-Rex.
//!
//! A winding path leads to the ruin. Foliage with alpha masks is instanced from few meshes.

pub(crate) mod plants;
mod temple;

use super::creature::{self, Creature};
use super::masonry::{carved_band, carved_stone, dressed_stone};
use super::mesh_builder::MeshBuilder;
use super::noise::{Rng, bank, smoothstep};
use super::organic::{LeafShape, bark, leaf, rock, skin, soil};
use super::scene_builder::SceneBuilder;
use super::texture_synth::{Maps, Recipe, Surface, rgb, tones};
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use scene::{AlphaMode, Scene};
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

fn color(name: &'static str, size: u32, surface: Surface) -> Recipe {
    Recipe::new(name, size, Maps::Color, 1.0, surface)
}

fn normal(name: &'static str, tile_m: f32, surface: Surface) -> Recipe {
    Recipe::new(name, 1024, Maps::ColorNormal, tile_m, surface)
}

fn full(name: &'static str, tile_m: f32, surface: Surface) -> Recipe {
    Recipe {
        maps: Maps::Full,
        ..normal(name, tile_m, surface)
    }
}

/// Texture sets of leaves.
fn leaf_textures() -> Vec<Recipe> {
    use LeafShape::{Blade, Frond, Grass, Ivy, Palm, Spray};
    vec![
        color("fern-bright", 1024, leaf(Frond, tones(0x3c6a1c, 0x86ac3c))),
        color("fern-dark", 1024, leaf(Frond, tones(0x24491a, 0x4f7d30))),
        color("palm-feather", 1024, leaf(Frond, tones(0x35601f, 0x7d9c40))),
        color("palm-fan", 1024, leaf(Palm, tones(0x335c22, 0x6f9440))),
        normal("banana-leaf", 1.0, leaf(Blade, tones(0x3f7a24, 0x90b848))),
        normal("philodendron", 1.0, leaf(Blade, tones(0x1f4a24, 0x467c3c))),
        color("bush-bright", 1024, leaf(Spray, tones(0x41701f, 0x8aa83a))),
        color("bush-dark", 1024, leaf(Spray, tones(0x21451c, 0x4a7530))),
        color("bush-red", 512, leaf(Spray, tones(0x6d2a2c, 0x9c5a3c))),
        color("grass-green", 512, leaf(Grass, tones(0x466e22, 0x94ac48))),
        color("grass-dry", 512, leaf(Grass, tones(0x7a6f34, 0xb4a458))),
        color("canopy-near", 1024, leaf(Spray, tones(0x35601d, 0x7ba03a))),
        color("canopy-far", 1024, leaf(Spray, tones(0x2a5220, 0x5c8a36))),
        color("ivy", 512, leaf(Ivy, tones(0x2a5223, 0x5f8f3f))),
    ]
}

/// Texture sets of everything else.
fn solid_textures() -> Vec<Recipe> {
    let moss_stone = tones(0x8d8a72, 0x6b6d55);
    vec![
        full(
            "forest-floor",
            3.0,
            soil(tones(0x3c2f1e, 0x5d4a2e), Some(rgb(0x8a6a36)), 0.5),
        ),
        full(
            "trodden-earth",
            2.5,
            soil(tones(0x6e5638, 0x8a7048), None, 1.0),
        ),
        normal("bark-grey", 2.0, bark(tones(0x3a3026, 0x84745c), 0.7)),
        normal("bark-brown", 2.0, bark(tones(0x3b2818, 0x7c5a3a), 0.4)),
        normal("palm-bark", 1.2, bark(tones(0x4c4030, 0x94826a), 0.1)),
        color("liana", 512, bark(tones(0x3a2e1c, 0x6a5834), 0.6)),
        normal("rock-mossy", 2.2, rock(tones(0x6a665c, 0x8f897c), 1.0)),
        normal("rock-bare", 2.2, rock(tones(0x7a6c5a, 0x9c8f7c), 0.3)),
        full("temple-blocks", 2.6, dressed_stone(moss_stone, 3, 6, 1.0)),
        full("temple-frieze", 1.6, carved_band(tones(0x948f74, 0x73745a))),
        normal(
            "temple-steps",
            2.0,
            dressed_stone(tones(0x98917a, 0x77745e), 4, 5, 0.9),
        ),
        normal(
            "idol",
            1.0,
            carved_stone(tones(0x7f8468, 0x5b634a), 0.2, 0.8, 0.7),
        ),
        full("hide", 1.4, skin(tones(0x857650, 0x474c36))),
    ]
}

fn materials(scene: &mut SceneBuilder) {
    for recipe in leaf_textures() {
        scene.textured(recipe, |m| {
            m.alpha = AlphaMode::Mask(0.5);
            m.double_sided = true;
            m.roughness = 0.6;
        });
    }
    for recipe in solid_textures() {
        scene.textured(recipe, |_| {});
    }
    scene.plain("teeth", rgb(0xd8ceb0), 0.4, |_| {});
    scene.plain("eye", rgb(0xc89a20), 0.1, |_| {});
}

/// The scene.
pub fn scene() -> Scene {
    let mut scene = SceneBuilder::new("jungle");
    materials(&mut scene);
    terrain(&mut scene);
    temple::build(&mut scene, TEMPLE);
    let Creature { hide, teeth, eyes } = creature::tyrannosaur();
    let stand = Affine3A::from_rotation_translation(
        Quat::from_rotation_y(4.3),
        vec3(
            CREATURE.x,
            ground(CREATURE.x, CREATURE.z) - 0.03,
            CREATURE.z,
        ),
    );
    for (name, mesh, material) in [
        ("creature", hide, "hide"),
        ("creature-teeth", teeth, "teeth"),
        ("creature-eyes", eyes, "eye"),
    ] {
        scene.put(name, mesh, material, stand);
    }
    let mut rng = Rng::new(2014);
    trees(&mut scene, &mut rng);
    undergrowth(&mut scene, &mut rng);

    let eye = |x: f32, z: f32| vec3(x, ground(x, z) + 1.65, z);
    scene.cameras(
        0.1,
        120.0,
        [
            ("default", eye(-8.5, path_z(-8.5)), vec3(6.0, 2.3, -0.9)),
            ("ruin", eye(3.8, path_z(3.8)), vec3(15.0, 3.4, -0.3)),
            (
                "thicket",
                eye(-17.0, path_z(-17.0) + 2.4),
                vec3(-6.0, 1.2, -1.5),
            ),
        ],
    );
    scene.sun(vec3(0.42, -0.80, -0.43), vec3(3.4, 3.1, 2.4));
    scene.finish(vec3(0.55, 0.66, 0.60), 1)
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

fn upright(position: Vec3, turn: f32, scale: f32) -> Affine3A {
    Affine3A::from_scale_rotation_translation(
        Vec3::splat(scale),
        Quat::from_rotation_y(turn),
        position,
    )
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

fn undergrowth(scene: &mut SceneBuilder, rng: &mut Rng) {
    let mut scatter = |scene: &mut SceneBuilder,
                       meshes: &[usize],
                       count: usize,
                       clear: f32,
                       reach: f32,
                       temple: f32,
                       size: [f32; 2]| {
        for _ in 0..count {
            let place = spot(rng, clear, reach, temple);
            scene.place(
                meshes[rng.below(meshes.len())],
                upright(place, rng.range(0.0, TAU), rng.range(size[0], size[1])),
            );
        }
    };
    let mut seeds = Rng::new(99);
    let ferns: Vec<usize> = (0..4)
        .map(|i| scene.mesh("fern", plants::fern(12, 0.95, &mut seeds), FERNS[i % 2]))
        .collect();
    scatter(scene, &ferns, 250, 1.35, 12.0, 7.2, [0.7, 1.4]);
    let fans: Vec<usize> = (0..2)
        .map(|_| scene.mesh("fan-palm", plants::bush(16, 1.3, &mut seeds), "palm-fan"))
        .collect();
    scatter(scene, &fans, 50, 2.2, 14.0, 8.4, [0.8, 1.3]);
    let broad: Vec<usize> = (0..4)
        .map(|i| {
            scene.mesh(
                "broadleaf",
                plants::broadleaf(9, [1.7, 1.0][i % 2], &mut seeds),
                BROAD[i % 2],
            )
        })
        .collect();
    scatter(scene, &broad, 90, 1.9, 13.0, 8.0, [0.75, 1.3]);
    let bushes: Vec<usize> = (0..6)
        .map(|i| scene.mesh("bush", plants::bush(22, 0.95, &mut seeds), BUSHES[i % 3]))
        .collect();
    scatter(scene, &bushes, 140, 2.0, 16.0, 7.8, [0.7, 1.6]);
    let grasses: Vec<usize> = (0..4)
        .map(|i| {
            scene.mesh(
                "grass",
                plants::grass(9, 0.5, 0.42, &mut seeds),
                GRASSES[i % 2],
            )
        })
        .collect();
    scatter(scene, &grasses, 260, 1.0, 9.0, 6.6, [0.7, 1.3]);
    let rocks: Vec<usize> = (0..4)
        .map(|i| scene.mesh("boulder", plants::boulder([22, 14], i as u64), ROCKS[i % 2]))
        .collect();
    scatter(scene, &rocks, 60, 1.5, 13.0, 7.0, [0.18, 0.8]);
}
