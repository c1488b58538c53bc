//! The still: hose, retort, condenser, receiver and tripod.

use super::{Ware, place, vessel};
use crate::glassware::{glass_tube, helix, round_flask};
use crate::mesh_builder::{Knot, MeshBuilder, curve, lathed, profile, rounded};
use crate::noise::smoothstep;
use crate::scene_builder::SceneBuilder;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// Axis of the burner and of the retort above it, metres.
const AXIS_X: f32 = -0.02;
const AXIS_Z: f32 = 0.0;
/// Height of the retort's bottom, metres.
const LIFT: f32 = 0.131;

/// The retort's neck, the condenser below it and the receiver below that.
pub(super) fn still(scene: &mut SceneBuilder) {
    let neck_end = neck(scene);
    let outlet = condenser(scene, neck_end);
    receiver(scene, outlet);
}

/// The burner's hose.
pub(super) fn hose(m: &mut MeshBuilder) {
    let hose: Vec<(Vec3, f32)> = (0..=24)
        .map(|i| {
            let t = i as f32 / 24.0;
            (
                vec3(
                    AXIS_X - 0.03 - 0.33 * t,
                    0.008 + 0.012 * (1.0 - t),
                    AXIS_Z - 0.02 - 0.14 * t * t + 0.03 * (9.0 * t).sin(),
                ),
                0.0055,
            )
        })
        .collect();
    m.tube(&hose, 12);
}

/// The retort's neck, which bends over into the condenser. Returns its end.
fn neck(scene: &mut SceneBuilder) -> Vec3 {
    let neck: Vec<(Vec3, f32)> = (0..=40)
        .map(|i| {
            let t = i as f32 / 40.0;
            let bend = smoothstep(0.0, 0.45, t);
            let y = LIFT + 0.088 + 0.055 * (t * 3.2).sin().max(-1.0) * (1.0 - 0.3 * t)
                - 0.03 * bend * t;
            (
                vec3(AXIS_X + 0.02 + 0.165 * t.powf(0.9), y, AXIS_Z - 0.003 * t),
                0.0125 - 0.0055 * t,
            )
        })
        .collect();
    scene.add("retort-neck", glass_tube(&neck, 0.82, 16), "borosilicate");
    neck.last().map_or(Vec3::ZERO, |n| n.0)
}

/// Jacket, coil and nozzles, at a slant below the neck's end. Returns the point below the outlet.
fn condenser(scene: &mut SceneBuilder, neck_end: Vec3) -> Vec3 {
    let slant = Affine3A::from_rotation_translation(
        Quat::from_rotation_z(0.42),
        neck_end + vec3(0.022, -0.175, 0.0),
    );
    let jacket = curve(
        &profile(
            "0.0062,0! 0.0066,0.012 0.021,0.022 0.023,0.032 0.023,0.09 0.023,0.148 0.021,0.158 \
            0.0085,0.168 0.0082,0.182!",
        ),
        4,
    );
    let mut walls = jacket.clone();
    walls.extend(jacket.iter().rev().map(|k| Knot {
        at: vec2(k.at.x - 0.0014, k.at.y),
        sharp: k.sharp,
    }));
    walls.push(jacket[0]);
    let m = lathed(&walls, 32);
    scene.put("condenser", m, "borosilicate", slant);
    let mut coil = helix(0.0125, 0.0125, 9.0, 0.0032, 20);
    for (p, _) in &mut coil {
        p.y += 0.033;
    }
    scene.put("coil", glass_tube(&coil, 0.65, 8), "borosilicate", slant);
    for (y, side) in [(0.036, 1.0f32), (0.144, -1.0)] {
        let nozzle = [
            (vec3(side * 0.021, y, 0.0), 0.0045),
            (vec3(side * 0.032, y, 0.0), 0.004),
            (vec3(side * 0.045, y + 0.002, 0.0), 0.0038),
        ];
        scene.put(
            "nozzle",
            glass_tube(&nozzle, 0.6, 16),
            "borosilicate",
            slant,
        );
    }
    slant.transform_point3(vec3(0.0, -0.002, 0.0))
}

/// The flask below the condenser, on a ring of cork.
fn receiver(scene: &mut SceneBuilder, outlet: Vec3) {
    let flask = round_flask(0.031, 0.022, 1);
    let low = (outlet.y - 0.088).max(0.012);
    vessel(
        scene,
        "borosilicate",
        &Ware {
            outer: &flask,
            wall: 0.0014,
            segments: 40,
            lip: 0.0,
        },
        ("copper-sulphate", 0.018),
        &[place([outlet.x, low, outlet.z])],
    );
    let cork = rounded(
        "0.019,0! 0.023,0.005 0.021,0.012 0.017,0.014! 0.015,0.01! 0.015,0! 0.019,0!",
        3,
        36,
    );
    scene.put(
        "cork-ring",
        cork,
        "rack-beech",
        place([outlet.x, low - 0.012, outlet.z]),
    );
}

/// A tripod with gauze over the flame.
pub(super) fn tripod(stand: &mut MeshBuilder) {
    let top = 0.1285;
    stand.ring([40, 12], 0.0028, |sin, cos| {
        vec3(AXIS_X + 0.047 * cos, top - 0.004, AXIS_Z + 0.047 * sin)
    });
    for i in 0..3 {
        let (sin, cos) = (0.5 + TAU * i as f32 / 3.0).sin_cos();
        stand.rod(
            vec3(AXIS_X + 0.047 * cos, top - 0.004, AXIS_Z + 0.047 * sin),
            vec3(AXIS_X + 0.072 * cos, 0.0, AXIS_Z + 0.072 * sin),
            0.0028,
            12,
        );
    }
    for i in -13..=13 {
        let o = 0.0035 * i as f32;
        let reach = (0.0475f32.powi(2) - o * o).max(0.0).sqrt();
        for k in 0..2 {
            let (a, b) = if k == 0 {
                (vec3(o, 0.0, -reach), vec3(o, 0.0, reach))
            } else {
                (vec3(-reach, 0.0007, o), vec3(reach, 0.0007, o))
            };
            let c = vec3(AXIS_X, top, AXIS_Z);
            stand.rod(c + a, c + b, 0.0005, 5);
        }
    }
}
