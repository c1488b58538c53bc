//! A chemistry bench: flasks, tubes, a retort and a condenser in glass. 98 K triangles.

mod still;

use super::glassware::{
    beaker, bottle, erlenmeyer, filling, glass_tube, shell, stopper, test_tube,
};
use super::masonry::octagon_tiles;
use super::mesh_builder::{Knot, MeshBuilder, curve, lathed, sharp, smooth};
use super::noise::smoothstep;
use super::organic::{paper_label, polished_wood};
use super::scene_builder::{MaterialId, SceneBuilder};
use super::texture_synth::{Maps, Recipe, rgb};
use glam::{Affine3A, Vec3, vec2, vec3};
use scene::Scene;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

pub(super) struct LabMaterials {
    pub(super) glass: MaterialId,
    pub(super) amber: MaterialId,
    pub(super) liquids: [MaterialId; 5],
    pub(super) steel: MaterialId,
    pub(super) brass: MaterialId,
    pub(super) rubber: MaterialId,
    pub(super) wood: MaterialId,
    pub(super) bench: MaterialId,
    pub(super) tiles: MaterialId,
    pub(super) label: MaterialId,
    pub(super) flame: MaterialId,
}

fn kit(scene: &mut SceneBuilder) -> LabMaterials {
    let recipe =
        |name, size, tile_m, surface| Recipe::new(name, size, Maps::Color, tile_m, surface);
    let mut sets = [
        recipe(
            "rack-beech",
            512,
            0.3,
            polished_wood([rgb(0xc89a62), rgb(0x9a6c3c)], 0.45),
        ),
        recipe(
            "bench-top",
            1024,
            0.9,
            polished_wood([rgb(0x7d5030), rgb(0x4f2f1a)], 0.3),
        ),
        recipe(
            "wall-tiles",
            1024,
            0.9,
            octagon_tiles([rgb(0xe9e8e0), rgb(0xdcdcd4)], rgb(0x2f6a72), 8),
        ),
        recipe("label", 256, 1.0, paper_label(rgb(0xeee4c8), rgb(0x33291f))),
    ]
    .into_iter();
    let mut textured = |scene: &mut SceneBuilder, roughness: f32, mirror: f32| match sets.next() {
        Some(set) => scene.textured(set, |m| {
            m.roughness = roughness;
            m.mirror = mirror;
        }),
        None => scene.plain("missing", rgb(0xff_00ff), roughness, |_| {}),
    };
    let wood = textured(scene, 0.45, 0.0);
    let bench = textured(scene, 0.25, 0.03);
    let tiles = textured(scene, 0.2, 0.06);
    let label = textured(scene, 0.9, 0.0);
    let liquid = |scene: &mut SceneBuilder, name: &str, color: u32| {
        scene.plain(name, rgb(color), 0.0, |m| {
            m.transmission = 0.9;
            m.ior = 1.33;
            m.double_sided = true;
        })
    };
    let glass = |scene: &mut SceneBuilder, name: &str, color: u32| {
        scene.plain(name, rgb(color), 0.0, |m| {
            m.transmission = 0.96;
            m.ior = 1.47;
            m.double_sided = true;
        })
    };
    let metal = |scene: &mut SceneBuilder, name: &str, color: u32, rough: f32, mirror: f32| {
        scene.plain(name, rgb(color), rough, |m| {
            m.metallic = 1.0;
            m.mirror = mirror;
        })
    };
    LabMaterials {
        glass: glass(scene, "borosilicate", 0xf6fbfa),
        amber: glass(scene, "amber-glass", 0xb5641a),
        liquids: [
            liquid(scene, "copper-sulphate", 0x2a86e0),
            liquid(scene, "potassium-chromate", 0xf0c020),
            liquid(scene, "permanganate", 0x9a2a9a),
            liquid(scene, "nickel-chloride", 0x35b060),
            liquid(scene, "cobalt-chloride", 0xe04a5a),
        ],
        steel: metal(scene, "steel", 0xc8ccd0, 0.15, 0.55),
        brass: metal(scene, "brass", 0xd6a84a, 0.2, 0.4),
        rubber: scene.plain("rubber", rgb(0x2a2624), 0.85, |_| {}),
        wood,
        bench,
        tiles,
        label,
        flame: scene.plain("flame", rgb(0x6090ff), 0.5, |m| {
            m.emissive = vec3(0.5, 0.9, 2.6);
            m.transmission = 0.6;
            m.ior = 1.0;
            m.double_sided = true;
        }),
    }
}

pub(super) fn at(x: f32, y: f32, z: f32) -> Affine3A {
    Affine3A::from_translation(vec3(x, y, z))
}

/// Parameters of a vessel.
pub(super) struct Ware<'a> {
    /// Outline of the outer skin from the axis to the rim.
    pub(super) outer: &'a [Knot],
    /// Thickness of the glass, metres.
    pub(super) wall: f32,
    /// Segments around.
    pub(super) segments: usize,
    /// Distance by which the rim is pulled out into a spout, as a fraction of its radius.
    pub(super) lip: f32,
}

impl<'a> Ware<'a> {
    pub(super) fn new(outer: &'a [Knot], wall: f32, segments: usize, lip: f32) -> Self {
        Self {
            outer,
            wall,
            segments,
            lip,
        }
    }
}

/// A turned vessel and its contents (liquid and its level), placed together.
pub(super) fn vessel(
    scene: &mut SceneBuilder,
    glass: MaterialId,
    ware: &Ware<'_>,
    fill: Option<(MaterialId, f32)>,
    places: &[Affine3A],
) {
    let &Ware {
        outer,
        wall,
        segments,
        lip,
    } = ware;
    let mut m = MeshBuilder::new();
    let top = outer.last().map_or(0.0, |k| k.at.y);
    // A spout: the rim is pulled out on one side.
    m.lathe_shaped(&shell(outer, wall), segments, |angle, y| {
        let near = smoothstep(0.5, 0.0, ((angle + PI).rem_euclid(TAU) - PI).abs());
        1.0 + lip * near * smoothstep(top * 0.90, top, y)
    });
    let mesh = scene.mesh("glass", m, glass);
    for place in places {
        scene.place(mesh, *place);
    }
    if let Some((liquid, level)) = fill {
        let inside = lathed(&filling(outer, wall, 0.0004, level), segments);
        let mesh = scene.mesh("liquid", inside, liquid);
        for place in places {
            scene.place(mesh, *place);
        }
    }
}

/// The scene.
pub fn scene() -> Scene {
    let mut scene = SceneBuilder::new("lab");
    let kit = kit(&mut scene);
    furniture(&mut scene, &kit);
    flasks(&mut scene, &kit);
    rack(&mut scene, &kit);
    still::distillation(&mut scene, &kit);
    shelf(&mut scene, &kit);
    scene.camera(
        "default",
        vec3(0.02, 0.265, 0.40),
        vec3(0.0, 0.125, -0.02),
        0.02,
        20.0,
    );
    scene.camera(
        "side",
        vec3(-0.46, 0.22, 0.24),
        vec3(0.05, 0.13, -0.02),
        0.02,
        20.0,
    );
    scene.sun(vec3(0.35, -0.75, -0.55), vec3(1.15, 1.15, 1.1));
    scene.lamp(vec3(-0.7, 1.0, 0.7), vec3(0.6, 0.56, 0.5));
    scene.finish(vec3(0.32, 0.36, 0.40), 0)
}

fn furniture(scene: &mut SceneBuilder, kit: &LabMaterials) {
    let mut bench = MeshBuilder::new();
    bench.block(vec3(-1.1, -0.04, -0.32), vec3(1.1, 0.0, 0.55), 0.006);
    scene.add("bench", bench, kit.bench);
    let mut wall = MeshBuilder::new();
    wall.panel(vec3(-1.4, -0.5, -0.33), Vec3::X * 2.8, Vec3::Y * 1.6, 12, 8);
    scene.add("wall", wall, kit.tiles);
}

/// Conical flasks and beakers with their contents, a rod, a dish and a funnel.
fn flasks(scene: &mut SceneBuilder, kit: &LabMaterials) {
    let flask = erlenmeyer(0.145, 3);
    vessel(
        scene,
        kit.glass,
        &Ware::new(&flask, 0.0018, 47, 0.0),
        Some((kit.liquids[0], 0.055)),
        &[at(-0.10, 0.0, 0.16)],
    );
    let small = erlenmeyer(0.105, 2);
    vessel(
        scene,
        kit.glass,
        &Ware::new(&small, 0.0016, 40, 0.0),
        Some((kit.liquids[4], 0.036)),
        &[at(0.20, 0.0, 0.185)],
    );
    let large = beaker(0.043, 0.115, 3);
    vessel(
        scene,
        kit.glass,
        &Ware::new(&large, 0.0017, 47, 0.14),
        Some((kit.liquids[1], 0.062)),
        &[at(0.075, 0.0, 0.155)],
    );
    let cup = beaker(0.030, 0.075, 3);
    vessel(
        scene,
        kit.glass,
        &Ware::new(&cup, 0.0014, 40, 0.14),
        Some((kit.liquids[2], 0.03)),
        &[at(-0.24, 0.0, 0.19)],
    );
    graduated_cylinder(scene, kit);
    // A stirring rod in the beaker and a petri dish in front of it.
    let rod = glass_tube(
        &[
            (vec3(0.052, 0.006, 0.15), 0.003),
            (vec3(0.085, 0.08, 0.155), 0.003),
            (vec3(0.118, 0.155, 0.16), 0.003),
        ],
        0.4,
        16,
    );
    scene.add("rod", rod, kit.glass);
    let dish = beaker(0.038, 0.012, 3);
    vessel(
        scene,
        kit.glass,
        &Ware::new(&dish, 0.0014, 40, 0.0),
        Some((kit.liquids[3], 0.005)),
        &[at(0.0, 0.0, 0.245)],
    );
    funnel(scene, kit);
}

/// The cylinder, its foot and its marks.
fn graduated_cylinder(scene: &mut SceneBuilder, kit: &LabMaterials) {
    let cylinder = beaker(0.0155, 0.19, 3);
    vessel(
        scene,
        kit.glass,
        &Ware::new(&cylinder, 0.0013, 34, 0.18),
        Some((kit.liquids[3], 0.11)),
        &[at(-0.185, 0.006, 0.065)],
    );
    let mut foot = MeshBuilder::new();
    foot.lathe_shaped(
        &[
            sharp(0.0, 0.0),
            sharp(0.033, 0.0),
            sharp(0.033, 0.004),
            smooth(0.017, 0.0058),
            smooth(0.0, 0.0058),
        ],
        36,
        |a, _| 1.0 + 0.05 * (6.0 * a).cos(),
    );
    let foot = scene.mesh("cylinder-foot", foot, kit.glass);
    scene.place(foot, at(-0.185, 0.0, 0.065));
    let mut marks = MeshBuilder::new();
    for i in 0..18 {
        let (y, half) = (
            0.03 + 0.0085 * i as f32,
            if i % 5 == 0 { 0.5 } else { 0.28 },
        );
        marks.surface(5, 1, |s, t| {
            let a = FRAC_PI_2 + half * (2.0 * s - 1.0);
            let (sin, cos) = (-a).sin_cos();
            (
                vec3(-0.0157 * cos, y + 0.0007 * t, -0.0157 * sin),
                vec2(s, t) * 0.01,
            )
        });
    }
    marks.orient(|p| vec3(p.x, 0.0, p.z));
    let marks = scene.mesh("graduation", marks, kit.rubber);
    scene.place(marks, at(-0.185, 0.006, 0.065));
}

fn funnel(scene: &mut SceneBuilder, kit: &LabMaterials) {
    let mut funnel = MeshBuilder::new();
    let cone = curve(
        &[
            sharp(0.0026, 0.0),
            smooth(0.0034, 0.03),
            smooth(0.005, 0.048),
            smooth(0.030, 0.082),
            sharp(0.031, 0.085),
        ],
        4,
    );
    let mut walls = cone.clone();
    walls.extend(cone.iter().rev().map(|k| Knot {
        at: k.at - vec2(0.0013, -0.0006 * f32::from(k.at.y < 0.08)),
        sharp: k.sharp,
    }));
    walls.push(cone[0]);
    funnel.lathe(&walls, 32);
    let funnel = scene.mesh("funnel", funnel, kit.glass);
    scene.place(funnel, at(-0.10, 0.105, 0.16));
}

fn rack(scene: &mut SceneBuilder, kit: &LabMaterials) {
    let (x0, z) = (0.235, 0.045);
    let mut rack = MeshBuilder::new();
    rack.block(
        vec3(x0 - 0.012, 0.0, z - 0.035),
        vec3(x0 + 0.212, 0.012, z + 0.035),
        0.002,
    );
    for x in [x0 - 0.012, x0 + 0.2] {
        rack.block(
            vec3(x, 0.012, z - 0.028),
            vec3(x + 0.012, 0.115, z + 0.028),
            0.002,
        );
    }
    // The shelf has drilled holes: a plate around each.
    for i in 0..6 {
        let c = x0 + 0.0165 + 0.0335 * i as f32;
        for y in [0.062, 0.104] {
            plate_with_hole(
                &mut rack,
                vec3(c, y, z),
                vec2(0.01675, 0.028),
                0.0098,
                0.009,
            );
        }
    }
    scene.add("rack", rack, kit.wood);
    let tube = test_tube(0.0085, 0.135, 2);
    for i in 0..6 {
        let place = at(x0 + 0.0165 + 0.0335 * i as f32, 0.0135, z);
        let level = 0.035 + 0.012 * ((i * 5 % 6) as f32);
        vessel(
            scene,
            kit.glass,
            &Ware::new(&tube, 0.0010, 17, 0.0),
            Some((kit.liquids[(i * 2 + 1) % 5], level)),
            &[place],
        );
    }
}

/// A plate of half extents `half` around a round hole.
fn plate_with_hole(m: &mut MeshBuilder, center: Vec3, half: glam::Vec2, hole: f32, thick: f32) {
    let square = |a: f32| {
        let (sin, cos) = a.sin_cos();
        let k = (half.x / cos.abs().max(1e-6)).min(half.y / sin.abs().max(1e-6));
        vec2(cos, sin) * k
    };
    for (y, up) in [(thick, true), (0.0, false)] {
        let mut face = MeshBuilder::new();
        face.surface(32, 1, |s, t| {
            let a = TAU * (s - s.floor());
            let (sin, cos) = a.sin_cos();
            let p = (vec2(cos, sin) * hole).lerp(square(a), t);
            (center + vec3(p.x, y, p.y), p)
        });
        // The face is flat, so its normals do not depend on derivatives at the corners of its outline.
        let normal = if up { Vec3::Y } else { Vec3::NEG_Y };
        face.orient(|_| normal);
        face.normals.fill(normal);
        m.merge(&face, Affine3A::IDENTITY);
    }
    let mut bore = lathed(&[sharp(hole, 0.0), sharp(hole, thick)], 32);
    bore.flip();
    m.merge(&bore, Affine3A::from_translation(center));
    for side in [-1.0f32, 1.0] {
        let corner = center + vec3(-side * half.x, 0.0, side * half.y);
        m.quad(
            corner,
            Vec3::X * (2.0 * half.x * side),
            Vec3::Y * thick,
            vec2(0.0, 0.0),
        );
    }
}

fn shelf(scene: &mut SceneBuilder, kit: &LabMaterials) {
    let mut board = MeshBuilder::new();
    board.block(vec3(-0.62, 0.262, -0.32), vec3(0.62, 0.282, -0.16), 0.003);
    for x in [-0.5, 0.0, 0.5] {
        board.block(
            vec3(x - 0.01, 0.0, -0.32),
            vec3(x + 0.01, 0.262, -0.30),
            0.003,
        );
    }
    scene.add("shelf", board, kit.wood);
    let outer = bottle(0.036, 0.12, 2);
    let places =
        |xs: &[f32], y: f32, z: f32| -> Vec<Affine3A> { xs.iter().map(|x| at(*x, y, z)).collect() };
    let amber = places(&[-0.46, -0.27, 0.10, 0.37], 0.282, -0.235);
    let clear = places(&[-0.365, -0.17, 0.01, 0.19, 0.28], 0.282, -0.24);
    let low = places(&[-0.40, -0.30, 0.30, 0.42], 0.0, -0.22);
    vessel(
        scene,
        kit.amber,
        &Ware::new(&outer, 0.002, 22, 0.0),
        Some((kit.liquids[1], 0.05)),
        &amber,
    );
    vessel(
        scene,
        kit.glass,
        &Ware::new(&outer, 0.002, 22, 0.0),
        Some((kit.liquids[0], 0.062)),
        &clear,
    );
    vessel(
        scene,
        kit.glass,
        &Ware::new(&outer, 0.002, 22, 0.0),
        Some((kit.liquids[4], 0.045)),
        &low,
    );
    let plug = lathed(&stopper(0.0145), 12);
    let plug = scene.mesh("glass-stopper", plug, kit.glass);
    let mut label = MeshBuilder::new();
    label.surface(12, 1, |s, t| {
        let a = -FRAC_PI_2 + 1.3 * (s - 0.5);
        let (sin, cos) = a.sin_cos();
        (
            vec3(0.0363 * cos, 0.022 + 0.042 * t, -0.0363 * sin),
            vec2(s, 1.0 - t),
        )
    });
    let label = scene.mesh("label", label, kit.label);
    for place in amber.iter().chain(&clear).chain(&low) {
        scene.place(plug, *place * at(0.0, 0.121, 0.0));
        scene.place(label, *place);
    }
}
