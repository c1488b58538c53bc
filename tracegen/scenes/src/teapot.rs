//! The Utah teapot on a polished checker floor: 15 K triangles.

mod patches;

use super::masonry::checker;
use super::mesh_builder::MeshBuilder;
use super::organic::polished_wood;
use super::scene_builder::SceneBuilder;
use super::texture_synth::{Maps, Recipe, rgb, tones};
use glam::{Vec3, vec2, vec3};
use patches::PATCHES;
use scene::Scene;

/// Cells along a patch's edge: 32 patches of 2 x 15² triangles, minus those at the poles.
const CELLS: usize = 15;
/// Metres per unit of Newell's model.
const SCALE_M: f32 = 0.08;

/// A point of a bicubic Bezier patch.
fn bezier(patch: &[[f32; 3]; 16], u: f32, v: f32) -> Vec3 {
    let basis = |t: f32| {
        let s = 1.0 - t;
        [s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t]
    };
    let (bu, bv) = (basis(u), basis(v));
    let mut p = Vec3::ZERO;
    for (i, control) in patch.iter().enumerate() {
        p += Vec3::from(*control) * (bv[i / 4] * bu[i % 4]);
    }
    // Newell's z is up.
    vec3(p.x, p.z, -p.y) * SCALE_M
}

/// The tessellated teapot, foot at y = 0, spout along +x.
pub fn teapot() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for patch in PATCHES.iter().flat_map(|(copies, patch)| copies.of(patch)) {
        m.surface(CELLS, CELLS, |u, v| {
            (bezier(&patch, u, v), vec2(u, v) * 0.2)
        });
    }
    m
}

/// The scene.
pub fn scene() -> Scene {
    let mut scene = SceneBuilder::new("teapot");
    let recipe = |name, tile_m, surface| Recipe::new(name, 512, Maps::ColorNormal, tile_m, surface);
    scene.plain("glaze", rgb(0xc9482e), 0.12, |m| {
        m.mirror = 0.08;
        m.double_sided = true;
    });
    scene.add("teapot", teapot(), "glaze");
    let tiles = checker(tones(0xe8e2d6, 0x30343c), 8);
    scene.polished(recipe("checker-floor", 0.8, tiles), 0.15, 0.2);
    let mut top = MeshBuilder::new();
    top.panel(
        vec3(-0.8, 0.0, 0.8),
        Vec3::X * 1.6,
        Vec3::NEG_Z * 1.6,
        18,
        18,
    );
    scene.add("table-top", top, "checker-floor");
    let wood = polished_wood(tones(0x8a5a34, 0x5a3518), 0.4);
    scene.polished(recipe("table-edge", 0.6, wood), 0.35, 0.0);
    let mut edge = MeshBuilder::new();
    edge.block(vec3(-0.86, -0.09, -0.86), vec3(0.86, -0.004, 0.86), 0.015);
    scene.add("table-edge", edge, "table-edge");
    scene.cameras(
        0.02,
        20.0,
        [
            ("default", vec3(0.10, 0.24, 0.31), vec3(0.01, 0.10, 0.0)),
            ("low", vec3(-0.36, 0.09, 0.30), vec3(0.0, 0.11, 0.0)),
        ],
    );
    scene.sun(vec3(-0.45, -0.8, -0.4), vec3(1.6, 1.5, 1.35));
    scene.lamp(vec3(-0.7, 0.9, 0.6), vec3(0.5, 0.53, 0.6));
    scene.finish(vec3(0.24, 0.30, 0.38), 0)
}
