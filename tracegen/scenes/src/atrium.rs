//! A two-storey colonnaded courtyard: a stand-in for the Sponza scenes.
//!
//! Everything sits on a lattice of 3.5 m bays: an open court of 8 x 2 bays, ringed by an arcade
//! one bay deep with a gallery on top.

mod furnishing;
pub(crate) mod parts;

use super::mesh_builder::MeshBuilder;
use super::scene_builder::SceneBuilder;
use super::scene_text::Code;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use parts::{Bay, Column, baluster, cornice, groin_vault, lion_medallion, moulding, rib};
use std::f32::consts::{FRAC_PI_2, PI};

/// Edge of a bay in metres.
const BAY: f32 = 3.5;
/// Half extents of the court and of the whole building in metres.
const COURT: (f32, f32) = (4.0 * BAY, BAY);
const OUTER: (f32, f32) = (5.0 * BAY, 2.0 * BAY);
/// Heights in metres: spring of the lower arches, upper floor, spring of the upper arches, eaves.
const SPRING: f32 = 3.3;
const FLOOR2: f32 = 5.6;
const SPRING2: f32 = FLOOR2 + 2.4;
const EAVES: f32 = 10.0;

/// Modelling detail of the architecture.
#[derive(Clone, Copy, Debug)]
struct Detail {
    column: Column,
    column_high: Column,
    arch_segments: usize,
    moulding_steps: usize,
    vault_cells: usize,
    baluster: (usize, usize),
    balusters: usize,
    dentils: bool,
    /// Factor of the chamfers of blocks.
    bevel: f32,
    floor_cells: usize,
}

impl Detail {
    /// Blocks: two corners and a chamfer each.
    fn blocks(&self, blocks: &[[f32; 7]]) -> MeshBuilder {
        let mut m = MeshBuilder::new();
        for &[x0, y0, z0, x1, y1, z1, bevel] in blocks {
            m.block(vec3(x0, y0, z0), vec3(x1, y1, z1), bevel * self.bevel);
        }
        m
    }
}

const RICH: Detail = Detail {
    column: Column {
        radius: 0.33,
        height: SPRING,
        segments: 22,
        rows: 8,
        flutes: 8,
        steps: 2,
    },
    column_high: Column {
        radius: 0.21,
        height: SPRING2 - FLOOR2,
        segments: 12,
        rows: 6,
        flutes: 6,
        steps: 2,
    },
    arch_segments: 18,
    moulding_steps: 2,
    vault_cells: 7,
    baluster: (8, 1),
    balusters: 7,
    dentils: true,
    bevel: 1.0,
    floor_cells: 4,
};

const PLAIN: Detail = Detail {
    column: Column {
        radius: 0.33,
        height: SPRING,
        segments: 14,
        rows: 4,
        flutes: 0,
        steps: 1,
    },
    column_high: Column {
        radius: 0.21,
        height: SPRING2 - FLOOR2,
        segments: 8,
        rows: 3,
        flutes: 0,
        steps: 1,
    },
    arch_segments: 12,
    moulding_steps: 1,
    vault_cells: 4,
    baluster: (5, 1),
    balusters: 5,
    dentils: false,
    bevel: 0.0,
    floor_cells: 2,
};

/// What the scenes' texts name.
pub const CODE: Code = Code {
    shapes: &[
        ("fountain", |m, _| furnishing::fountain(m)),
        ("lamp-chain", |m, _| furnishing::lamp_chain(m)),
        ("lion-medallion", |m, row| {
            m.append(lion_medallion(row.number(), row.number()));
        }),
    ],
    steps: &[
        ("architecture", |scene, row| match row.word() {
            "rich" => build(scene, &RICH),
            _ => build(scene, &PLAIN),
        }),
        ("drapes", |scene, _| furnishing::drapes(scene)),
        ("lamps", |scene, _| furnishing::lamps(scene)),
        ("plants", |scene, _| furnishing::plants(scene)),
        ("reliefs", |scene, _| furnishing::reliefs(scene)),
    ],
};

/// A rotation about the vertical, then a translation.
fn at(position: Vec3, turn: f32) -> Affine3A {
    Affine3A::from_rotation_translation(Quat::from_rotation_y(turn), position)
}

/// One side of the court: centres of its bays and the rotation that makes +z face the court.
struct Side {
    bays: Vec<Vec3>,
    turn: f32,
}

fn sides() -> [Side; 4] {
    let along = |n: i32| (0..n).map(move |i| (i as f32 + 0.5 - n as f32 * 0.5) * BAY);
    [
        Side {
            bays: along(8).map(|x| vec3(x, 0.0, -COURT.1)).collect(),
            turn: 0.0,
        },
        Side {
            bays: along(8).map(|x| vec3(x, 0.0, COURT.1)).collect(),
            turn: PI,
        },
        Side {
            bays: along(2).map(|z| vec3(-COURT.0, 0.0, z)).collect(),
            turn: FRAC_PI_2,
        },
        Side {
            bays: along(2).map(|z| vec3(COURT.0, 0.0, z)).collect(),
            turn: -FRAC_PI_2,
        },
    ]
}

/// Axes of the columns around the court.
fn column_axes() -> Vec<Vec3> {
    let mut axes = Vec::new();
    for z in [-COURT.1, COURT.1] {
        axes.extend((-4..=4).map(|i| vec3(i as f32 * BAY, 0.0, z)));
    }
    axes.extend([vec3(-COURT.0, 0.0, 0.0), vec3(COURT.0, 0.0, 0.0)]);
    axes
}

fn place_all(
    scene: &mut SceneBuilder,
    name: &str,
    mesh: MeshBuilder,
    material: &str,
    places: &[Affine3A],
) {
    let mesh = scene.mesh(name, mesh, material);
    for place in places {
        scene.place(mesh, *place);
    }
}

fn build(scene: &mut SceneBuilder, d: &Detail) {
    floors_and_walls(scene, d);
    colonnades(scene, d);
    arcade_ceilings(scene, d);
    mouldings_and_roof(scene, d);
}

fn floors_and_walls(scene: &mut SceneBuilder, d: &Detail) {
    let n = d.floor_cells;
    let mut court = MeshBuilder::new();
    let (cx, cz) = COURT;
    court.panel(
        vec3(-cx, 0.0, cz),
        Vec3::X * 2.0 * cx,
        Vec3::NEG_Z * 2.0 * cz,
        8 * n,
        2 * n,
    );
    scene.add("court", court, "court-floor");

    let mut tiles = MeshBuilder::new();
    let mut ceiling = MeshBuilder::new();
    let (ox, oz) = OUTER;
    // Four strips around the court on both floors; the wooden ceiling mirrors them.
    let strips = [
        (vec3(-ox, 0.0, -cz), 2.0 * ox, oz - cz),
        (vec3(-ox, 0.0, oz), 2.0 * ox, oz - cz),
        (vec3(-ox, 0.0, cz), ox - cx, 2.0 * cz),
        (vec3(cx, 0.0, cz), ox - cx, 2.0 * cz),
    ];
    for (corner, w, h) in strips {
        let cells = |m: f32| (m / BAY).round() as usize * n;
        for y in [0.0, FLOOR2] {
            tiles.panel(
                corner + Vec3::Y * y,
                Vec3::X * w,
                Vec3::NEG_Z * h,
                cells(w),
                cells(h),
            );
        }
        let far = corner + vec3(0.0, EAVES - 0.08, -h);
        ceiling.panel(far, Vec3::X * w, Vec3::Z * h, cells(w), 1);
    }
    scene.add("arcade-floors", tiles, "arcade-floor");
    scene.add("gallery-ceiling", ceiling, "beam");

    // Outer walls: corner, direction seen from inside, width.
    let walls = [
        (vec3(-ox, 0.0, -oz), Vec3::X, 2.0 * ox),
        (vec3(ox, 0.0, oz), Vec3::NEG_X, 2.0 * ox),
        (vec3(ox, 0.0, -oz), Vec3::Z, 2.0 * oz),
        (vec3(-ox, 0.0, oz), Vec3::NEG_Z, 2.0 * oz),
    ];
    let (mut low, mut dado, mut high) =
        (MeshBuilder::new(), MeshBuilder::new(), MeshBuilder::new());
    for (corner, right, w) in walls {
        let cells = (w / BAY).round() as usize * n;
        let dado_height = 1.15;
        low.panel(
            corner + Vec3::Y * dado_height,
            right * w,
            Vec3::Y * (FLOOR2 - dado_height),
            cells,
            n,
        );
        high.panel(
            corner + Vec3::Y * FLOOR2,
            right * w,
            Vec3::Y * (EAVES - FLOOR2),
            cells,
            n,
        );
        let inward = Vec3::Y.cross(right) * -0.06;
        let inward = if inward.dot(corner) > 0.0 {
            -inward
        } else {
            inward
        };
        dado.panel(corner + inward, right * w, Vec3::Y * dado_height, cells, 1);
        dado.panel(
            corner + inward + Vec3::Y * dado_height,
            right * w,
            -inward,
            cells,
            1,
        );
    }
    scene.add("wall-low", low, "wall-low");
    scene.add("dado", dado, "dado");
    scene.add("wall-high", high, "wall-high");
}

fn colonnades(scene: &mut SceneBuilder, d: &Detail) {
    let axes: Vec<Affine3A> = column_axes().into_iter().map(|c| at(c, 0.0)).collect();
    let raised: Vec<Affine3A> = column_axes()
        .into_iter()
        .map(|c| at(c + Vec3::Y * FLOOR2, 0.0))
        .collect();
    place_all(scene, "column", d.column.shaft(), "shaft", &axes);
    place_all(scene, "capital", d.column.capital(), "capital", &axes);
    place_all(
        scene,
        "column-high",
        d.column_high.shaft(),
        "shaft-high",
        &raised,
    );
    place_all(
        scene,
        "capital-high",
        d.column_high.capital(),
        "capital",
        &raised,
    );

    let bays: Vec<Affine3A> = sides()
        .iter()
        .flat_map(|s| s.bays.iter().map(|c| at(*c, s.turn)).collect::<Vec<_>>())
        .collect();
    let low = Bay {
        pitch: BAY,
        radius: 0.5 * BAY - 0.43,
        spring: SPRING,
        top: FLOOR2,
        thickness: 0.75,
        segments: d.arch_segments,
    };
    let high = Bay {
        radius: 0.5 * BAY - 0.29,
        spring: SPRING2,
        top: EAVES,
        thickness: 0.5,
        ..low
    };
    place_all(scene, "spandrel", low.spandrel(), "spandrel", &bays);
    place_all(
        scene,
        "arch",
        low.archivolt(d.moulding_steps),
        "arch",
        &bays,
    );
    place_all(scene, "spandrel-high", high.spandrel(), "spandrel", &bays);
    place_all(
        scene,
        "arch-high",
        high.archivolt(d.moulding_steps),
        "arch",
        &bays,
    );

    // Balustrade between the upper columns: plinth, balusters, rail.
    let (half, foot) = (0.5 * BAY - 0.3, FLOOR2);
    let mut rails = d.blocks(&[
        [-half, foot, -0.12, half, foot + 0.12, 0.12, 0.015],
        [-half, foot + 0.82, -0.13, half, foot + 0.95, 0.13, 0.03],
    ]);
    let one = baluster(d.baluster.0, d.baluster.1);
    for i in 0..d.balusters {
        let x = ((i as f32 + 0.5) / d.balusters as f32 * 2.0 - 1.0) * half;
        rails.merge(&one, Affine3A::from_translation(vec3(x, foot + 0.12, 0.0)));
    }
    place_all(scene, "balustrade", rails, "rail", &bays);
}

fn arcade_ceilings(scene: &mut SceneBuilder, d: &Detail) {
    vaults(scene, d);
    ribs_and_pilasters(scene, d);
    joists(scene, d);
    doors(scene, d);
}

fn vaults(scene: &mut SceneBuilder, d: &Detail) {
    let mut vaults = Vec::new();
    for i in -5..5 {
        for j in -2..2 {
            let c = vec3((i as f32 + 0.5) * BAY, 0.0, (j as f32 + 0.5) * BAY);
            if c.x.abs() > COURT.0 || c.z.abs() > COURT.1 {
                vaults.push(at(c, 0.0));
            }
        }
    }
    let half = 0.5 * BAY;
    place_all(
        scene,
        "vault",
        groin_vault(vec2(half, half), SPRING, half, d.vault_cells),
        "vault",
        &vaults,
    );
}

/// Ribs from each column to the wall, on pilasters.
fn ribs_and_pilasters(scene: &mut SceneBuilder, d: &Detail) {
    let half = 0.5 * BAY;
    let mut ribs = Vec::new();
    let mut pilasters = Vec::new();
    for side in [-1.0, 1.0] {
        for i in -4..=4 {
            let x = i as f32 * BAY;
            ribs.push(at(vec3(x, 0.0, side * (COURT.1 + half)), FRAC_PI_2));
            pilasters.push(at(vec3(x, 0.0, side * OUTER.1), 0.0));
        }
        for z in [-BAY, 0.0, BAY] {
            ribs.push(at(vec3(side * (COURT.0 + half), 0.0, z), 0.0));
            pilasters.push(at(vec3(side * OUTER.0, 0.0, z), 0.0));
        }
    }
    place_all(
        scene,
        "rib",
        rib(half, SPRING, 0.42, 0.14, d.arch_segments),
        "rib",
        &ribs,
    );
    let pilaster = d.blocks(&[
        [-0.3, 0.0, -0.3, 0.3, 0.35, 0.3, 0.02],
        [-0.24, 0.35, -0.24, 0.24, SPRING - 0.28, 0.24, 0.02],
        [-0.29, SPRING - 0.28, -0.29, 0.29, SPRING - 0.2, 0.29, 0.015],
        [-0.34, SPRING - 0.2, -0.34, 0.34, SPRING, 0.34, 0.03],
    ]);
    place_all(scene, "pilaster", pilaster, "rib", &pilasters);
}

/// Joists under the gallery's ceiling, every 0.7 m along the long sides.
fn joists(scene: &mut SceneBuilder, d: &Detail) {
    let half = 0.5 * BAY;
    let joist = d.blocks(&[[-0.09, EAVES - 0.32, -half, 0.09, EAVES - 0.08, half, 0.012]]);
    let joists: Vec<Affine3A> = (-20..=20)
        .flat_map(|i| [-1.0, 1.0].map(|s| at(vec3(i as f32 * 0.7, 0.0, s * (COURT.1 + half)), 0.0)))
        .chain((-4..=4).flat_map(|i| {
            [-1.0, 1.0].map(|s| at(vec3(s * (COURT.0 + half), 0.0, i as f32 * 0.7), FRAC_PI_2))
        }))
        .collect();
    place_all(scene, "joist", joist, "beam", &joists);
}

/// Doors in the outer wall, every other bay.
fn doors(scene: &mut SceneBuilder, d: &Detail) {
    let door = d.blocks(&[
        [-0.75, 0.0, -0.05, -0.01, 2.55, 0.1, 0.015],
        [0.01, 0.0, -0.05, 0.75, 2.55, 0.1, 0.015],
        [-0.64, 0.25, 0.09, -0.64 + 0.52, 0.25 + 0.95, 0.13, 0.03],
        [0.12, 0.25, 0.09, 0.12 + 0.52, 0.25 + 0.95, 0.13, 0.03],
        [-0.64, 1.45, 0.09, -0.64 + 0.52, 1.45 + 0.95, 0.13, 0.03],
        [0.12, 1.45, 0.09, 0.12 + 0.52, 1.45 + 0.95, 0.13, 0.03],
    ]);
    let frame = d.blocks(&[
        [-1.0, 0.0, -0.05, -0.75, 2.55, 0.18, 0.03],
        [0.75, 0.0, -0.05, 1.0, 2.55, 0.18, 0.03],
        [-1.08, 2.55, -0.05, 1.08, 2.85, 0.24, 0.04],
    ]);
    let doors: Vec<Affine3A> = (0..4)
        .flat_map(|i| {
            let x = (i as f32 * 2.0 - 3.5) * BAY;
            [
                at(vec3(x, 0.0, -OUTER.1), 0.0),
                at(vec3(x + BAY, 0.0, OUTER.1), PI),
            ]
        })
        .chain([
            at(vec3(-OUTER.0, 0.0, -0.5 * BAY), FRAC_PI_2),
            at(vec3(OUTER.0, 0.0, 0.5 * BAY), -FRAC_PI_2),
        ])
        .collect();
    let above: Vec<Affine3A> = doors
        .iter()
        .map(|a| Affine3A::from_translation(Vec3::Y * FLOOR2) * *a)
        .collect();
    let all: Vec<Affine3A> = doors.into_iter().chain(above).collect();
    place_all(scene, "door", door, "door", &all);
    place_all(scene, "door-frame", frame, "rib", &all);
}

fn mouldings_and_roof(scene: &mut SceneBuilder, d: &Detail) {
    let steps = d.moulding_steps + 1;
    let (string, top) = (cornice(0.24, 0.32, steps), cornice(0.5, 0.6, steps));
    for side in sides() {
        let length = side.bays.len() as f32 * BAY;
        let mid = side.bays.iter().copied().sum::<Vec3>() / side.bays.len() as f32;
        let places = |z: f32| -> Vec<Affine3A> {
            side.bays
                .iter()
                .map(|c| at(*c, side.turn) * Affine3A::from_translation(vec3(-0.5 * BAY, 0.0, z)))
                .collect()
        };
        place_all(
            scene,
            "string-course",
            moulding(&string, BAY, FLOOR2 - 0.32),
            "cornice",
            &places(0.375),
        );
        place_all(
            scene,
            "cornice",
            moulding(&top, BAY, EAVES),
            "cornice",
            &places(0.25),
        );
        if d.dentils {
            let mut row = MeshBuilder::new();
            let count = (length / 0.35) as usize;
            for i in 0..count {
                let x = (i as f32 + 0.5) / count as f32 * length - 0.5 * length;
                row.block(
                    vec3(x - 0.08, EAVES - 0.16, 0.2),
                    vec3(x + 0.08, EAVES + 0.02, 0.40),
                    0.012 * d.bevel,
                );
            }
            place_all(scene, "dentils", row, "cornice", &[at(mid, side.turn)]);
        }
        // The roof slopes up from the eaves to the outer wall.
        let mut roof = MeshBuilder::new();
        let (half, rise, depth) = (0.5 * length + BAY, 1.5, BAY + 0.6);
        roof.panel(
            vec3(-half, EAVES + 0.6, 0.75),
            Vec3::X * 2.0 * half,
            vec3(0.0, rise, -depth),
            side.bays.len() * 2,
            4,
        );
        place_all(scene, "roof", roof, "roof", &[at(mid, side.turn)]);
    }
    // Tie beams and purlins over the open court.
    let mut beams = MeshBuilder::new();
    for i in -4..=4 {
        let x = i as f32 * BAY;
        beams.block(
            vec3(x - 0.11, EAVES + 0.6, -COURT.1 - 0.3),
            vec3(x + 0.11, EAVES + 0.88, COURT.1 + 0.3),
            0.015 * d.bevel,
        );
        for s in [-1.0f32, 1.0] {
            let (z0, z1) = (s * (COURT.1 - 0.25), s * (COURT.1 - 0.05));
            beams.block(
                vec3(x - 0.09, EAVES + 0.1, z0),
                vec3(x + 0.09, EAVES + 0.6, z1),
                0.01 * d.bevel,
            );
        }
    }
    for z in [-1.75, 0.0, 1.75] {
        beams.block(
            vec3(-COURT.0, EAVES + 0.88, z - 0.08),
            vec3(COURT.0, EAVES + 1.06, z + 0.08),
            0.01 * d.bevel,
        );
    }
    scene.add("roof-beams", beams, "beam");
}
