//! The farm house: walls with recessed openings, shutters, tiled roof, barn.

use super::parts;
use super::{HOUSE, ground};
use crate::mesh_builder::MeshBuilder;
use crate::row::Row;
use crate::scene_builder::SceneBuilder;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::FRAC_PI_2;

/// A wall of thickness 0.5 m in the x-y plane from (0, 0) to `size`, with rectangular openings (x,
/// y, width, height). The outside is +z.
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

/// Width along x, depth along z, height of the walls and rise of the roof, metres.
const WIDTH: f32 = 9.0;
const DEPTH: f32 = 6.0;
const EAVES: f32 = 4.9;
const RISE: f32 = 1.75;

pub(super) fn farm_house(scene: &mut SceneBuilder, row: &mut Row) {
    let front: Vec<[f32; 4]> = row.points().collect();
    row.expect("sides");
    let sides: Vec<[f32; 4]> = row.points().collect();
    let mut house = House::default();
    house.facades(&front, &sides);
    house.gables();
    house.roof();
    let place = Affine3A::from_rotation_translation(
        Quat::from_rotation_y(-0.32),
        HOUSE + Vec3::Y * (ground(HOUSE.x, HOUSE.z) + 0.05),
    );
    for (name, mesh, material) in [
        ("house-walls", house.walls, "ochre-plaster"),
        ("house-frames", house.frames, "field-stone"),
        ("house-panes", house.panes, "window-pane"),
        ("house-shutters", house.shutters, "blue-shutters"),
        ("house-door", house.door, "door-wood"),
        ("house-roof", house.roof, "clay-tiles"),
        ("house-chimney", chimney(), "farm-stone"),
        ("house-barn", barn(), "farm-stone"),
    ] {
        scene.put(name, mesh, material, place);
    }
}

fn chimney() -> MeshBuilder {
    let mut chimney = MeshBuilder::new();
    chimney.block(
        vec3(2.3, EAVES + 0.6, -0.4),
        vec3(3.0, EAVES + RISE + 1.0, 0.25),
        0.03,
    );
    chimney.block(
        vec3(2.2, EAVES + RISE + 1.0, -0.5),
        vec3(3.1, EAVES + RISE + 1.14, 0.35),
        0.03,
    );
    chimney
}

/// A lower barn that leans on the right.
fn barn() -> MeshBuilder {
    let mut barn = MeshBuilder::new();
    barn.block(
        vec3(WIDTH / 2.0, -0.4, -2.6),
        vec3(WIDTH / 2.0 + 4.2, 2.9, 2.2),
        0.02,
    );
    barn
}

/// Meshes of the house, by material.
#[derive(Default)]
struct House {
    walls: MeshBuilder,
    frames: MeshBuilder,
    panes: MeshBuilder,
    shutters: MeshBuilder,
    door: MeshBuilder,
    roof: MeshBuilder,
}

impl House {
    /// Front (+z), back, left and right. Openings are x, y, width and height.
    fn facades(&mut self, front: &[[f32; 4]], side: &[[f32; 4]]) {
        let corner = |turn: f32, at: Vec3| {
            Affine3A::from_rotation_translation(Quat::from_rotation_y(turn), at)
        };
        let facades = [
            (
                vec2(WIDTH, EAVES),
                front,
                corner(0.0, vec3(-WIDTH / 2.0, 0.0, DEPTH / 2.0)),
            ),
            (
                vec2(WIDTH, EAVES),
                front,
                corner(std::f32::consts::PI, vec3(WIDTH / 2.0, 0.0, -DEPTH / 2.0)),
            ),
            (
                vec2(DEPTH, EAVES),
                side,
                corner(-FRAC_PI_2, vec3(-WIDTH / 2.0, 0.0, -DEPTH / 2.0)),
            ),
            (
                vec2(DEPTH, EAVES),
                side,
                corner(FRAC_PI_2, vec3(WIDTH / 2.0, 0.0, DEPTH / 2.0)),
            ),
        ];
        for (size, openings, place) in facades {
            self.walls.merge(&wall(size, openings), place);
            for &opening in openings {
                self.lintel(opening, place);
                if opening[1] > 0.0 {
                    self.window(opening, place);
                } else {
                    self.entrance(opening, place);
                }
            }
        }
    }

    /// The lintel of any opening.
    fn lintel(&mut self, [x, y, ow, oh]: [f32; 4], place: Affine3A) {
        self.frames.merge_block(
            vec3(x - 0.14, y + oh, -0.02),
            vec3(x + ow + 0.14, y + oh + 0.22, 0.04),
            0.012,
            place,
        );
    }

    /// Sill, bars, pane and shutters.
    fn window(&mut self, [x, y, ow, oh]: [f32; 4], place: Affine3A) {
        self.frames.merge_block(
            vec3(x - 0.14, y - 0.12, -0.05),
            vec3(x + ow + 0.14, y, 0.09),
            0.015,
            place,
        );
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
            self.shutters.merge_block(a, b, 0.006, place);
        }
        let mut pane = MeshBuilder::new();
        pane.quad(
            vec3(x, y, -0.29),
            Vec3::X * ow,
            Vec3::Y * oh,
            vec2(0.0, 0.0),
        );
        self.panes.merge(&pane, place);
        for s in [-1.0f32, 1.0] {
            let near = if s < 0.0 {
                x - 0.03 - ow * 0.5
            } else {
                x + ow + 0.03
            };
            self.shutters.merge_block(
                vec3(near, y, 0.015),
                vec3(near + ow * 0.5, y + oh, 0.06),
                0.008,
                place,
            );
            for k in 0..9 {
                let ly = y + oh * (0.08 + 0.095 * k as f32);
                self.shutters.merge_block(
                    vec3(near + 0.05, ly, 0.055),
                    vec3(near + ow * 0.5 - 0.05, ly + 0.055, 0.075),
                    0.006,
                    place,
                );
            }
        }
    }

    /// The door and its step.
    fn entrance(&mut self, [x, y, ow, oh]: [f32; 4], place: Affine3A) {
        let (low, high) = (vec3(x, y, -0.3), vec3(x + ow, y + oh, -0.22));
        self.door.merge_block(low, high, 0.02, place);
        self.frames.merge_block(
            vec3(x - 0.3, -0.4, 0.0),
            vec3(x + ow + 0.3, 0.02, 0.55),
            0.03,
            place,
        );
    }

    fn gables(&mut self) {
        for s in [-1.0f32, 1.0] {
            let x = s * WIDTH / 2.0;
            let mut gable = MeshBuilder::new();
            let corners = [
                vec3(x, EAVES, s * DEPTH / 2.0),
                vec3(x, EAVES, -s * DEPTH / 2.0),
                vec3(x, EAVES + RISE, 0.0),
            ];
            let v = corners.map(|p| gable.vertex(p, Vec3::X * s, vec2(-s * p.z, -p.y)));
            gable.triangle(v[0], v[1], v[2]);
            self.walls.merge(&gable, Affine3A::IDENTITY);
        }
    }

    /// Tiles of the house and of the barn, and the ridge.
    fn roof(&mut self) {
        let slope = vec2(DEPTH / 2.0 + 0.5, RISE + 0.5 * RISE / (DEPTH / 2.0));
        let tilt = slope.x.atan2(slope.y);
        for turn in [0.0f32, std::f32::consts::PI] {
            let sheet = parts::tiled_slope(vec2(WIDTH + 0.7, slope.length() + 0.05), 40, 15);
            let eave = vec3(
                0.0,
                EAVES - 0.5 * RISE / (DEPTH / 2.0) + 0.02,
                DEPTH / 2.0 + 0.5,
            );
            let lay = Affine3A::from_rotation_translation(Quat::from_rotation_x(-tilt), eave);
            self.roof
                .merge(&sheet, Affine3A::from_rotation_y(turn) * lay);
        }
        self.roof.rod(
            vec3(-WIDTH / 2.0 - 0.35, EAVES + RISE + 0.02, 0.0),
            vec3(WIDTH / 2.0 + 0.35, EAVES + RISE + 0.02, 0.0),
            0.13,
            12,
        );
        let barn_roof = parts::tiled_slope(vec2(4.7, 5.3), 20, 12);
        let lay = Affine3A::from_rotation_translation(
            Quat::from_rotation_x(-1.38),
            vec3(WIDTH / 2.0 + 2.15, 2.85, 2.5),
        );
        self.roof.merge(&barn_roof, lay);
    }
}
