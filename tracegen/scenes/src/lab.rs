//! A chemistry bench: flasks, tubes, a retort and a condenser in glass. 98 K triangles.

mod still;

use super::glassware::{
    beaker, bottle, erlenmeyer, filling, glass_tube, shell, stopper, test_tube,
};
use super::masonry::octagon_tiles;
use super::mesh_builder::{Knot, MeshBuilder, curve, lathed, profile, sharp};
use super::noise::smoothstep;
use super::organic::{paper_label, polished_wood};
use super::scene_builder::SceneBuilder;
use super::texture_synth::{Maps, Recipe, rgb, tones};
use glam::{Affine3A, Vec3, vec2, vec3};
use scene::Scene;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Liquids in the vessels.
const LIQUIDS: [&str; 5] = [
    "copper-sulphate",
    "potassium-chromate",
    "permanganate",
    "nickel-chloride",
    "cobalt-chloride",
];

fn materials(scene: &mut SceneBuilder) {
    let recipe =
        |name, size, tile_m, surface| Recipe::new(name, size, Maps::Color, tile_m, surface);
    let beech = polished_wood(tones(0xc89a62, 0x9a6c3c), 0.45);
    scene.polished(recipe("rack-beech", 512, 0.3, beech), 0.45, 0.0);
    let top = polished_wood(tones(0x7d5030, 0x4f2f1a), 0.3);
    scene.polished(recipe("bench-top", 1024, 0.9, top), 0.25, 0.03);
    let tiles = octagon_tiles(tones(0xe9e8e0, 0xdcdcd4), rgb(0x2f6a72), 8);
    scene.polished(recipe("wall-tiles", 1024, 0.9, tiles), 0.2, 0.06);
    let label = paper_label(rgb(0xeee4c8), rgb(0x33291f));
    scene.polished(recipe("label", 256, 1.0, label), 0.9, 0.0);
    scene.clear("borosilicate", 0xf6fbfa, 0.96, 1.47);
    scene.clear("amber-glass", 0xb5641a, 0.96, 1.47);
    let colors = [0x2a86e0, 0xf0c020, 0x9a2a9a, 0x35b060, 0xe04a5a];
    for (name, color) in LIQUIDS.into_iter().zip(colors) {
        scene.clear(name, color, 0.9, 1.33);
    }
    scene.metal("steel", 0xc8ccd0, 0.15, 0.55);
    scene.metal("brass", 0xd6a84a, 0.2, 0.4);
    scene.plain("rubber", rgb(0x2a2624), 0.85, |_| {});
    scene.plain("flame", rgb(0x6090ff), 0.5, |m| {
        m.emissive = vec3(0.5, 0.9, 2.6);
        m.transmission = 0.6;
        m.ior = 1.0;
        m.double_sided = true;
    });
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
    glass: &str,
    ware: &Ware<'_>,
    fill: Option<(&str, f32)>,
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
    materials(&mut scene);
    furniture(&mut scene);
    flasks(&mut scene);
    rack(&mut scene);
    still::distillation(&mut scene);
    shelf(&mut scene);
    scene.cameras(
        0.02,
        20.0,
        [
            ("default", vec3(0.02, 0.265, 0.40), vec3(0.0, 0.125, -0.02)),
            ("side", vec3(-0.46, 0.22, 0.24), vec3(0.05, 0.13, -0.02)),
        ],
    );
    scene.sun(vec3(0.35, -0.75, -0.55), vec3(1.15, 1.15, 1.1));
    scene.lamp(vec3(-0.7, 1.0, 0.7), vec3(0.6, 0.56, 0.5));
    scene.finish(vec3(0.32, 0.36, 0.40), 0)
}

fn furniture(scene: &mut SceneBuilder) {
    let mut bench = MeshBuilder::new();
    bench.block(vec3(-1.1, -0.04, -0.32), vec3(1.1, 0.0, 0.55), 0.006);
    scene.add("bench", bench, "bench-top");
    let mut wall = MeshBuilder::new();
    wall.panel(vec3(-1.4, -0.5, -0.33), Vec3::X * 2.8, Vec3::Y * 1.6, 12, 8);
    scene.add("wall", wall, "wall-tiles");
}

/// Conical flasks and beakers with their contents, a rod, a dish and a funnel.
fn flasks(scene: &mut SceneBuilder) {
    // Outline, wall, segments and lip; liquid and its level; place.
    for (outer, wall, segments, lip, liquid, level, place) in [
        (
            erlenmeyer(0.145, 3),
            0.0018,
            47,
            0.0,
            0,
            0.055,
            at(-0.10, 0.0, 0.16),
        ),
        (
            erlenmeyer(0.105, 2),
            0.0016,
            40,
            0.0,
            4,
            0.036,
            at(0.20, 0.0, 0.185),
        ),
        (
            beaker(0.043, 0.115, 3),
            0.0017,
            47,
            0.14,
            1,
            0.062,
            at(0.075, 0.0, 0.155),
        ),
        (
            beaker(0.030, 0.075, 3),
            0.0014,
            40,
            0.14,
            2,
            0.03,
            at(-0.24, 0.0, 0.19),
        ),
    ] {
        let ware = Ware::new(&outer, wall, segments, lip);
        vessel(
            scene,
            "borosilicate",
            &ware,
            Some((LIQUIDS[liquid], level)),
            &[place],
        );
    }
    graduated_cylinder(scene);
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
    scene.add("rod", rod, "borosilicate");
    let dish = beaker(0.038, 0.012, 3);
    vessel(
        scene,
        "borosilicate",
        &Ware::new(&dish, 0.0014, 40, 0.0),
        Some((LIQUIDS[3], 0.005)),
        &[at(0.0, 0.0, 0.245)],
    );
    funnel(scene);
}

/// The cylinder, its foot and its marks.
fn graduated_cylinder(scene: &mut SceneBuilder) {
    let cylinder = beaker(0.0155, 0.19, 3);
    vessel(
        scene,
        "borosilicate",
        &Ware::new(&cylinder, 0.0013, 34, 0.18),
        Some((LIQUIDS[3], 0.11)),
        &[at(-0.185, 0.006, 0.065)],
    );
    let mut foot = MeshBuilder::new();
    foot.lathe_shaped(
        &profile("0,0! 0.033,0! 0.033,0.004! 0.017,0.0058 0,0.0058"),
        36,
        |a, _| 1.0 + 0.05 * (6.0 * a).cos(),
    );
    scene.put(
        "cylinder-foot",
        foot,
        "borosilicate",
        at(-0.185, 0.0, 0.065),
    );
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
    scene.put("graduation", marks, "rubber", at(-0.185, 0.006, 0.065));
}

fn funnel(scene: &mut SceneBuilder) {
    let mut funnel = MeshBuilder::new();
    let cone = curve(
        &profile("0.0026,0! 0.0034,0.03 0.005,0.048 0.03,0.082 0.031,0.085!"),
        4,
    );
    let mut walls = cone.clone();
    walls.extend(cone.iter().rev().map(|k| Knot {
        at: k.at - vec2(0.0013, -0.0006 * f32::from(k.at.y < 0.08)),
        sharp: k.sharp,
    }));
    walls.push(cone[0]);
    funnel.lathe(&walls, 32);
    scene.put("funnel", funnel, "borosilicate", at(-0.10, 0.105, 0.16));
}

fn rack(scene: &mut SceneBuilder) {
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
    scene.add("rack", rack, "rack-beech");
    let tube = test_tube(0.0085, 0.135, 2);
    for i in 0..6 {
        let place = at(x0 + 0.0165 + 0.0335 * i as f32, 0.0135, z);
        let level = 0.035 + 0.012 * ((i * 5 % 6) as f32);
        vessel(
            scene,
            "borosilicate",
            &Ware::new(&tube, 0.0010, 17, 0.0),
            Some((LIQUIDS[(i * 2 + 1) % 5], level)),
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

fn shelf(scene: &mut SceneBuilder) {
    let mut board = MeshBuilder::new();
    board.block(vec3(-0.62, 0.262, -0.32), vec3(0.62, 0.282, -0.16), 0.003);
    for x in [-0.5, 0.0, 0.5] {
        board.block(
            vec3(x - 0.01, 0.0, -0.32),
            vec3(x + 0.01, 0.262, -0.30),
            0.003,
        );
    }
    scene.add("shelf", board, "rack-beech");
    let outer = bottle(0.036, 0.12, 2);
    let places =
        |xs: &[f32], y: f32, z: f32| -> Vec<Affine3A> { xs.iter().map(|x| at(*x, y, z)).collect() };
    let amber = places(&[-0.46, -0.27, 0.10, 0.37], 0.282, -0.235);
    let clear = places(&[-0.365, -0.17, 0.01, 0.19, 0.28], 0.282, -0.24);
    let low = places(&[-0.40, -0.30, 0.30, 0.42], 0.0, -0.22);
    for (glass, liquid, level, places) in [
        ("amber-glass", 1, 0.05, &amber),
        ("borosilicate", 0, 0.062, &clear),
        ("borosilicate", 4, 0.045, &low),
    ] {
        let ware = Ware::new(&outer, 0.002, 22, 0.0);
        vessel(scene, glass, &ware, Some((LIQUIDS[liquid], level)), places);
    }
    let plug = lathed(&stopper(0.0145), 12);
    let plug = scene.mesh("glass-stopper", plug, "borosilicate");
    let mut label = MeshBuilder::new();
    label.surface(12, 1, |s, t| {
        let a = -FRAC_PI_2 + 1.3 * (s - 0.5);
        let (sin, cos) = a.sin_cos();
        (
            vec3(0.0363 * cos, 0.022 + 0.042 * t, -0.0363 * sin),
            vec2(s, 1.0 - t),
        )
    });
    let label = scene.mesh("label", label, "label");
    for place in amber.iter().chain(&clear).chain(&low) {
        scene.place(plug, *place * at(0.0, 0.121, 0.0));
        scene.place(label, *place);
    }
}
