//! Objects in the plant: tanks, pumps, machines, conveyors, racks and their loads, and the crane.
//! Each is modelled about its own origin on the floor.

use super::materials::{PIPES, SIGNALS};
use super::parts::{NAVE_M, bar};
use crate::mesh_builder::{MeshBuilder, profile, turned};
use crate::scene_builder::SceneBuilder;
use glam::{Affine3A, Vec3, vec3};
use std::f32::consts::{FRAC_PI_2, TAU};

fn block(low: [f32; 3], high: [f32; 3], bevel: f32) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    m.block(Vec3::from(low), Vec3::from(high), bevel);
    m
}

fn boxes(list: &[([f32; 3], [f32; 3])], bevel: f32) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for (low, high) in list {
        m.block(Vec3::from(*low), Vec3::from(*high), bevel);
    }
    m
}

/// An upright tank of radius 1.1 m from 0.7 m to 4.4 m above the floor.
fn tank() -> MeshBuilder {
    turned(
        "0,0.62 0.7,0.7 1.05,0.92 1.1,1.1! 1.1,2.2! 1.13,2.2! 1.13,2.26! 1.1,2.26! 1.1,3.9! \
            1.02,4.1 0.6,4.3 0.3,4.36! 0.3,4.5! 0,4.5!",
        18,
    )
}

/// A vessel of radius 0.6 m along z from 0 to 4.2 m, its axis at the origin's height.
fn vessel() -> MeshBuilder {
    let upright = turned(
        "0,0 0.42,0.08 0.6,0.3! 0.6,0.9! 0.68,0.9! 0.68,1! 0.6,1! 0.6,3.9! 0.42,4.12 0,4.2",
        16,
    );
    let mut m = MeshBuilder::new();
    m.merge(&upright, Affine3A::from_rotation_x(FRAC_PI_2));
    m
}

fn ladder() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for x in [-0.22, 0.22] {
        m.block(vec3(x - 0.02, 0.0, -0.03), vec3(x + 0.02, 4.6, 0.03), 0.0);
    }
    for i in 1..15 {
        let y = 0.3 * i as f32;
        m.block(
            vec3(-0.2, y - 0.012, -0.012),
            vec3(0.2, y + 0.012, 0.012),
            0.0,
        );
    }
    m
}

/// A centrifugal pump: shaft towards +z at 0.35 m, suction along -z, discharge up to 0.95 m.
fn pump() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let volute = turned(
        "0.09,-0.42! 0.16,-0.42! 0.16,-0.38! 0.09,-0.38! 0.1,-0.16 0.24,-0.12 0.27,0 0.2,0.12 \
            0.1,0.16 0.08,0.34! 0,0.34!",
        14,
    );
    let place = Affine3A::from_translation(Vec3::Y * 0.35) * Affine3A::from_rotation_x(FRAC_PI_2);
    m.merge(&volute, place);
    let neck = turned("0.09,0.4! 0.09,0.9! 0.15,0.9! 0.15,0.95! 0,0.95!", 10);
    m.merge(&neck, Affine3A::from_translation(Vec3::X * 0.12));
    m.block(vec3(-0.16, 0.0, -0.1), vec3(0.16, 0.14, 0.1), 0.0);
    m
}

/// An electric motor along z, its shaft end at the origin, 0.35 m above the floor.
fn motor() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let mut body = MeshBuilder::new();
    let outline =
        profile("0,-0.02! 0.06,-0.02! 0.06,0.06! 0.2,0.08! 0.22,0.12! 0.22,0.62! 0.2,0.68 0,0.7!");
    // Cooling fins.
    body.lathe_shaped(&outline, 32, |angle, y| {
        let finned = f32::from(u8::from((0.12..0.63).contains(&y)));
        1.0 - 0.09 * finned * f32::from(u8::from((angle / TAU * 32.0).round() as i32 % 2 == 0))
    });
    let place = Affine3A::from_translation(Vec3::Y * 0.35) * Affine3A::from_rotation_x(FRAC_PI_2);
    m.merge(&body, place);
    m.block(vec3(-0.1, 0.5, 0.25), vec3(0.1, 0.68, 0.45), 0.0);
    for x in [-0.17, 0.11] {
        m.block(vec3(x, 0.0, 0.2), vec3(x + 0.06, 0.2, 0.55), 0.0);
    }
    m
}

/// A machining centre, 2.6 m wide along x, 1.8 m deep; its door faces -z.
fn mill() -> MeshBuilder {
    let mut m = boxes(
        &[
            ([-1.3, 0.0, -0.8], [1.3, 0.75, 0.9]),
            ([-1.3, 0.75, -0.1], [-0.95, 2.1, 0.9]),
            ([0.75, 0.75, -0.8], [1.3, 2.1, 0.9]),
            ([-0.95, 0.75, 0.5], [0.75, 2.1, 0.9]),
            ([-1.3, 2.1, -0.8], [1.3, 2.35, 0.9]),
        ],
        0.03,
    );
    // Spindle head above a table with a vice.
    m.block(vec3(-0.3, 1.5, 0.0), vec3(0.1, 2.1, 0.45), 0.0);
    let spindle = turned("0,1.1! 0.03,1.1! 0.05,1.3! 0.12,1.3! 0.12,1.5!", 10);
    m.merge(&spindle, Affine3A::from_translation(vec3(-0.1, 0.0, 0.2)));
    m.block(vec3(-0.7, 0.75, -0.4), vec3(0.5, 0.9, 0.3), 0.0);
    m.block(vec3(-0.25, 0.9, -0.15), vec3(0.05, 1.0, 0.1), 0.0);
    m
}

/// A hydraulic press, 1.7 m wide and 3.4 m high.
fn press() -> MeshBuilder {
    let mut m = boxes(
        &[
            ([-0.85, 0.0, -0.6], [0.85, 0.7, 0.6]),
            ([-0.85, 0.7, -0.35], [-0.5, 2.6, 0.35]),
            ([0.5, 0.7, -0.35], [0.85, 2.6, 0.35]),
            ([-0.95, 2.6, -0.6], [0.95, 3.4, 0.6]),
            ([-0.45, 1.6, -0.3], [0.45, 1.85, 0.3]),
        ],
        0.02,
    );
    let ram = turned("0.18,1.85! 0.18,2.6!", 12);
    m.merge(&ram, Affine3A::IDENTITY);
    m
}

/// A pallet of 1.2 m along x by 0.8 m.
fn pallet() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..5 {
        let z = -0.4 + 0.175 * i as f32;
        m.block(vec3(-0.6, 0.12, z), vec3(0.6, 0.144, z + 0.1), 0.0);
    }
    for z in [-0.4, -0.05, 0.3] {
        m.block(vec3(-0.6, 0.0, z), vec3(0.6, 0.12, z + 0.1), 0.0);
    }
    m
}

fn drum() -> MeshBuilder {
    turned(
        "0.29,0! 0.29,0.28! 0.305,0.3 0.29,0.32! 0.29,0.58! 0.305,0.6 0.29,0.62! 0.29,0.88! \
            0.27,0.88! 0.27,0.86! 0,0.86!",
        12,
    )
}

/// Uprights of a pallet rack with their bracing, 1.1 m deep along x and 4.6 m high.
fn upright() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for x in [-0.55, 0.47] {
        m.block(vec3(x, 0.0, -0.05), vec3(x + 0.08, 4.6, 0.05), 0.0);
    }
    for i in 0..4 {
        let (y, flip) = (0.3 + 1.05 * i as f32, if i % 2 == 0 { 1.0 } else { -1.0 });
        bar(
            &mut m,
            vec3(-0.5 * flip, y, 0.0),
            vec3(0.5 * flip, y + 1.0, 0.0),
            0.035,
        );
    }
    m
}

/// 2 m of a roller conveyor's frame along z, 0.7 m wide, without its rollers.
fn conveyor() -> MeshBuilder {
    boxes(
        &[
            ([-0.36, 0.62, 0.0], [-0.32, 0.78, 2.0]),
            ([0.32, 0.62, 0.0], [0.36, 0.78, 2.0]),
            ([-0.36, 0.0, 0.2], [-0.3, 0.62, 0.26]),
            ([0.3, 0.0, 0.2], [0.36, 0.62, 0.26]),
            ([-0.36, 0.0, 1.74], [-0.3, 0.62, 1.8]),
            ([0.3, 0.0, 1.74], [0.36, 0.62, 1.8]),
        ],
        0.0,
    )
}

fn hook() -> MeshBuilder {
    let mut m = block([-0.22, 0.35, -0.16], [0.22, 0.95, 0.16], 0.03);
    let curve: Vec<(Vec3, f32)> = (0..=8)
        .map(|i| {
            let a = -0.5 * std::f32::consts::PI + 1.5 * std::f32::consts::PI * i as f32 / 8.0;
            let (sin, cos) = (FRAC_PI_2 - a).sin_cos();
            (
                vec3(0.17 * sin, 0.12 + 0.17 * cos, 0.0),
                0.05 - 0.003 * i as f32,
            )
        })
        .rev()
        .collect();
    m.tube(&curve, 6);
    m.block(vec3(-0.04, 0.25, -0.04), vec3(0.04, 0.4, 0.04), 0.0);
    m
}

fn tank_leg() -> MeshBuilder {
    let mut leg = MeshBuilder::new();
    leg.block(vec3(-0.06, 0.02, -0.06), vec3(0.06, 1.2, 0.06), 0.0);
    leg.block(vec3(-0.14, 0.0, -0.14), vec3(0.14, 0.02, 0.14), 0.0);
    leg
}

fn signal() -> MeshBuilder {
    turned("0.05,0! 0.05,0.14! 0,0.17", 10)
}

fn roller() -> MeshBuilder {
    let mut roller = MeshBuilder::new();
    let turned = turned("0,0! 0.035,0! 0.035,0.64! 0,0.64!", 8);
    roller.merge(
        &turned,
        Affine3A::from_translation(Vec3::X * 0.32) * Affine3A::from_rotation_z(FRAC_PI_2),
    );
    roller
}

fn panel() -> MeshBuilder {
    let mut panel = MeshBuilder::new();
    panel.surface(1, 1, |s, t| {
        (
            vec3(0.9 * (0.5 - s), 0.7 + 1.2 * t, -0.256),
            glam::vec2(s, 1.0 - t),
        )
    });
    panel
}

fn rope() -> MeshBuilder {
    let mut rope = MeshBuilder::new();
    for (x, z) in [(-0.12, -0.05), (-0.12, 0.05), (0.12, -0.05), (0.12, 0.05)] {
        let at = vec3(x, 0.0, z);
        rope.rod(at, at + Vec3::Y * 3.5, 0.014, 5);
    }
    rope
}

fn wheel() -> MeshBuilder {
    let mut wheel = MeshBuilder::new();
    let tyre = turned("0,-0.05! 0.14,-0.05! 0.14,0.05! 0,0.05!", 12);
    wheel.merge(&tyre, Affine3A::from_rotation_z(FRAC_PI_2));
    wheel
}

/// A girder of the crane. The trolley's rails and wheels are on its top at 0.9 m.
fn girder() -> MeshBuilder {
    let span = NAVE_M - 1.5;
    boxes(
        &[
            ([-span / 2.0, 0.0, -0.22], [span / 2.0, 0.9, 0.22]),
            ([-span / 2.0, 0.9, -0.04], [span / 2.0, 0.96, 0.04]),
        ],
        0.0,
    )
}

fn trolley() -> MeshBuilder {
    boxes(
        &[
            ([-0.9, 0.2, -1.3], [0.9, 0.4, 1.3]),
            ([-0.5, 0.4, -0.5], [0.5, 1.15, 0.5]),
            ([0.5, 0.4, -0.3], [0.85, 0.8, 0.3]),
            ([-0.9, 0.0, -1.15], [-0.5, 0.2, -0.85]),
            ([0.5, 0.0, -1.15], [0.9, 0.2, -0.85]),
            ([-0.9, 0.0, 0.85], [-0.5, 0.2, 1.15]),
            ([0.5, 0.0, 0.85], [0.9, 0.2, 1.15]),
        ],
        0.0,
    )
}

fn bench() -> MeshBuilder {
    boxes(
        &[
            ([-1.0, 0.86, -0.4], [1.0, 0.92, 0.4]),
            ([-0.95, 0.0, -0.35], [-0.88, 0.86, 0.35]),
            ([0.88, 0.0, -0.35], [0.95, 0.86, 0.35]),
            ([0.3, 0.35, -0.35], [0.88, 0.86, 0.3]),
        ],
        0.0,
    )
}

/// Adds the machines; returns the meshes of the signal lights.
pub(super) fn machines(scene: &mut SceneBuilder) -> [usize; 2] {
    for (name, mesh, material) in [
        ("tank", tank(), "stainless"),
        ("vessel", vessel(), PIPES[4]),
        ("tank-leg", tank_leg(), "steel-frame"),
        (
            "saddle",
            block([-0.55, 0.0, -0.12], [0.55, 0.7, 0.12], 0.0),
            "steel-frame",
        ),
        ("ladder", ladder(), "crane-paint"),
        ("pump", pump(), "cast-iron"),
        ("motor", motor(), "motor"),
        (
            "plinth",
            block([-0.4, 0.0, -0.55], [0.4, 0.15, 1.15], 0.02),
            "hazard",
        ),
        ("mill", mill(), "machine"),
        (
            "mill-guard",
            block([-0.94, 0.76, -0.79], [0.74, 2.09, -0.77], 0.0),
            "acrylic-guard",
        ),
        ("press", press(), "press"),
        (
            "cabinet",
            block([-0.5, 0.0, -0.25], [0.5, 2.0, 0.25], 0.02),
            "machine",
        ),
        ("panel", panel(), "panel"),
    ] {
        scene.mesh(name, mesh, material);
    }
    let signals = SIGNALS.map(|material| scene.mesh("signal", signal(), material));
    for (name, mesh, material) in [
        ("conveyor", conveyor(), "press"),
        ("roller", roller(), "zinc"),
        ("rack-upright", upright(), "rack-upright"),
        (
            "shelf-beam",
            block([-0.03, -0.06, 0.0], [0.03, 0.06, 2.9], 0.0),
            "rack-beam",
        ),
        ("pallet", pallet(), "pallet-wood"),
        (
            "crate",
            block([-0.5, 0.0, -0.38], [0.5, 0.8, 0.38], 0.015),
            "pallet-wood",
        ),
        (
            "carton",
            block([-0.28, 0.0, -0.19], [0.28, 0.36, 0.19], 0.0),
            "cardboard",
        ),
        ("drum", drum(), "drum"),
        (
            "bin",
            block([-0.18, 0.0, -0.2], [0.18, 0.26, 0.2], 0.01),
            "bin",
        ),
        ("bench", bench(), "pallet-wood"),
        ("crane-girder", girder(), "crane-paint"),
        (
            "crane-end-truck",
            block([-0.2, -0.1, -1.9], [0.2, 0.35, 1.9], 0.0),
            "crane-paint",
        ),
        ("crane-trolley", trolley(), "hazard"),
        ("crane-rope", rope(), "rubber"),
        ("crane-hook", hook(), "crane-paint"),
        (
            "cart",
            block([-0.45, 0.12, -0.75], [0.45, 0.35, 0.75], 0.03),
            "crane-paint",
        ),
        ("cart-wheel", wheel(), "rubber"),
    ] {
        scene.mesh(name, mesh, material);
    }
    signals
}
