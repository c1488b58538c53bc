//! The farm house: walls with recessed openings, shutters, tiled roof, barn.

use super::meadow::{HOUSE, Kit, ground};
use super::meadow_parts as parts;
use super::mesh_builder::MeshBuilder;
use super::scene_builder::SceneBuilder;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::FRAC_PI_2;

/// A wall of thickness 0.5 m in the x-y plane from (0, 0) to `size`, with rectangular openings
/// (x, y, width, height); outside is +z.
fn wall(size: glam::Vec2, openings: &[[f32; 4]]) -> MeshBuilder {
    let mut cuts_x = vec![0.0, size.x];
    let mut cuts_y = vec![0.0, size.y];
    for o in openings {
        cuts_x.extend([o[0], o[0] + o[2]]);
        cuts_y.extend([o[1], o[1] + o[3]]);
    }
    for cuts in [&mut cuts_x, &mut cuts_y] {
        cuts.sort_by(f32::total_cmp);
        cuts.dedup();
    }
    let mut m = MeshBuilder::new();
    for x in cuts_x.windows(2) {
        for y in cuts_y.windows(2) {
            let (cx, cy) = (0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
            let open = openings
                .iter()
                .any(|o| (o[0]..o[0] + o[2]).contains(&cx) && (o[1]..o[1] + o[3]).contains(&cy));
            if !open {
                let (w, h) = (x[1] - x[0], y[1] - y[0]);
                m.quad(
                    vec3(x[0], y[0], 0.0),
                    Vec3::X * w,
                    Vec3::Y * h,
                    vec2(x[0], -y[0]),
                );
            }
        }
    }
    for &[x, y, w, h] in openings {
        let deep = Vec3::Z * -0.32;
        m.quad(vec3(x, y, 0.0), deep, Vec3::Y * h, vec2(0.0, 0.0));
        m.quad(
            vec3(x + w, y, 0.0) + deep,
            -deep,
            Vec3::Y * h,
            vec2(0.0, 0.0),
        );
        m.quad(vec3(x, y, 0.0), Vec3::X * w, deep, vec2(0.0, 0.0));
        m.quad(
            vec3(x, y + h, 0.0) + deep,
            Vec3::X * w,
            -deep,
            vec2(0.0, 0.0),
        );
    }
    m
}

pub(super) fn farm_house(scene: &mut SceneBuilder, kit: &Kit) {
    let (w, d, h) = (9.0f32, 6.0f32, 4.9f32);
    // Front (+z), back, left, right; openings of the front: door and windows on two floors.
    let front: Vec<[f32; 4]> = vec![
        [4.0, 0.0, 1.15, 2.25],
        [1.2, 0.95, 1.0, 1.35],
        [6.8, 0.95, 1.0, 1.35],
        [1.2, 3.2, 0.95, 1.15],
        [4.1, 3.2, 0.95, 1.15],
        [6.8, 3.2, 0.95, 1.15],
    ];
    let side: Vec<[f32; 4]> = vec![
        [1.3, 0.95, 0.95, 1.3],
        [3.7, 0.95, 0.95, 1.3],
        [2.5, 3.2, 0.9, 1.1],
    ];
    let corner =
        |turn: f32, at: Vec3| Affine3A::from_rotation_translation(Quat::from_rotation_y(turn), at);
    let facades = [
        (
            vec2(w, h),
            &front,
            corner(0.0, vec3(-w / 2.0, 0.0, d / 2.0)),
        ),
        (
            vec2(w, h),
            &front,
            corner(std::f32::consts::PI, vec3(w / 2.0, 0.0, -d / 2.0)),
        ),
        (
            vec2(d, h),
            &side,
            corner(-FRAC_PI_2, vec3(-w / 2.0, 0.0, -d / 2.0)),
        ),
        (
            vec2(d, h),
            &side,
            corner(FRAC_PI_2, vec3(w / 2.0, 0.0, d / 2.0)),
        ),
    ];
    let (mut walls, mut frames, mut panes, mut shutters, mut door) = (
        MeshBuilder::new(),
        MeshBuilder::new(),
        MeshBuilder::new(),
        MeshBuilder::new(),
        MeshBuilder::new(),
    );
    for (size, openings, place) in &facades {
        walls.merge(&wall(*size, openings), *place);
        for &[x, y, ow, oh] in openings.iter() {
            let mut f = MeshBuilder::new();
            f.block(
                vec3(x - 0.14, y + oh, -0.02),
                vec3(x + ow + 0.14, y + oh + 0.22, 0.04),
                0.012,
            );
            if y > 0.0 {
                f.block(
                    vec3(x - 0.14, y - 0.12, -0.05),
                    vec3(x + ow + 0.14, y, 0.09),
                    0.015,
                );
                let mut bars = MeshBuilder::new();
                for (a, b) in [
                    (
                        vec3(x + ow * 0.5 - 0.025, y, -0.3),
                        vec3(x + ow * 0.5 + 0.025, y + oh, -0.24),
                    ),
                    (
                        vec3(x, y + oh * 0.5 - 0.02, -0.3),
                        vec3(x + ow, y + oh * 0.5 + 0.02, -0.25),
                    ),
                ] {
                    bars.block(a, b, 0.006);
                }
                shutters.merge(&bars, *place);
                let mut pane = MeshBuilder::new();
                pane.quad(
                    vec3(x, y, -0.29),
                    Vec3::X * ow,
                    Vec3::Y * oh,
                    vec2(0.0, 0.0),
                );
                panes.merge(&pane, *place);
                for s in [-1.0f32, 1.0] {
                    let near = if s < 0.0 {
                        x - 0.03 - ow * 0.5
                    } else {
                        x + ow + 0.03
                    };
                    let mut leaf = MeshBuilder::new();
                    leaf.block(
                        vec3(near, y, 0.015),
                        vec3(near + ow * 0.5, y + oh, 0.06),
                        0.008,
                    );
                    for k in 0..9 {
                        let ly = y + oh * (0.08 + 0.095 * k as f32);
                        leaf.block(
                            vec3(near + 0.05, ly, 0.055),
                            vec3(near + ow * 0.5 - 0.05, ly + 0.055, 0.075),
                            0.006,
                        );
                    }
                    shutters.merge(&leaf, *place);
                }
            } else {
                let mut leaf = MeshBuilder::new();
                leaf.block(vec3(x, y, -0.3), vec3(x + ow, y + oh, -0.22), 0.02);
                door.merge(&leaf, *place);
                f.block(
                    vec3(x - 0.3, -0.4, 0.0),
                    vec3(x + ow + 0.3, 0.02, 0.55),
                    0.03,
                );
            }
            frames.merge(&f, *place);
        }
    }
    // Gables and the tiled roof.
    let rise = 1.75;
    for s in [-1.0f32, 1.0] {
        let x = s * w / 2.0;
        let mut gable = MeshBuilder::new();
        let corners = [
            vec3(x, h, s * d / 2.0),
            vec3(x, h, -s * d / 2.0),
            vec3(x, h + rise, 0.0),
        ];
        let v = corners.map(|p| gable.vertex(p, Vec3::X * s, vec2(-s * p.z, -p.y)));
        gable.triangle(v[0], v[1], v[2]);
        walls.merge(&gable, Affine3A::IDENTITY);
    }
    let mut roof = MeshBuilder::new();
    let slope = vec2(d / 2.0 + 0.5, rise + 0.5 * rise / (d / 2.0));
    let tilt = slope.x.atan2(slope.y);
    for turn in [0.0f32, std::f32::consts::PI] {
        let sheet = parts::tiled_slope(vec2(w + 0.7, slope.length() + 0.05), 40, 15);
        let eave = vec3(0.0, h - 0.5 * rise / (d / 2.0) + 0.02, d / 2.0 + 0.5);
        let lay = Affine3A::from_rotation_translation(Quat::from_rotation_x(-tilt), eave);
        roof.merge(&sheet, Affine3A::from_rotation_y(turn) * lay);
    }
    roof.tube(
        &[
            (vec3(-w / 2.0 - 0.35, h + rise + 0.02, 0.0), 0.13),
            (vec3(w / 2.0 + 0.35, h + rise + 0.02, 0.0), 0.13),
        ],
        12,
    );
    let mut chimney = MeshBuilder::new();
    chimney.block(
        vec3(2.3, h + 0.6, -0.4),
        vec3(3.0, h + rise + 1.0, 0.25),
        0.03,
    );
    chimney.block(
        vec3(2.2, h + rise + 1.0, -0.5),
        vec3(3.1, h + rise + 1.14, 0.35),
        0.03,
    );
    // A lower barn leans on the right.
    let mut barn = MeshBuilder::new();
    barn.block(
        vec3(w / 2.0, -0.4, -2.6),
        vec3(w / 2.0 + 4.2, 2.9, 2.2),
        0.02,
    );
    let barn_roof = parts::tiled_slope(vec2(4.7, 5.3), 20, 12);
    let lay = Affine3A::from_rotation_translation(
        Quat::from_rotation_x(-1.38),
        vec3(w / 2.0 + 2.15, 2.85, 2.5),
    );
    roof.merge(&barn_roof, lay);
    let place = Affine3A::from_rotation_translation(
        Quat::from_rotation_y(-0.32),
        HOUSE + Vec3::Y * (ground(HOUSE.x, HOUSE.z) + 0.05),
    );
    for (name, mesh, material) in [
        ("house-walls", walls, kit.plaster),
        ("house-frames", frames, kit.stone),
        ("house-panes", panes, kit.pane),
        ("house-shutters", shutters, kit.shutter),
        ("house-door", door, kit.wood),
        ("house-roof", roof, kit.roof),
        ("house-chimney", chimney, kit.walls),
        ("house-barn", barn, kit.walls),
    ] {
        let mesh = scene.mesh(name, mesh, material);
        scene.place(mesh, place);
    }
}
