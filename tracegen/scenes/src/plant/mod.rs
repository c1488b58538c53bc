//! An industrial hall with a very large number of objects: naves of pipe racks, tanks, pumps,
//! machines, stores and walkways under travelling cranes. It is a stand-in for factory planning
//! data.
//!
//! The hall is laid out bay by bay and then sorted by mesh, so that the instances of a mesh are
//! consecutive and make one draw call. All directions are quarter turns: their matrices contain
//! only zeros and ones, which keeps boxes tight and cheap to compute.

mod building;
mod goods;
mod machines;
pub(crate) mod materials;
mod moving;
mod parts;
mod process;

use crate::scene_builder::SceneBuilder;
use crate::scene_text::Code;
use glam::{Affine3A, Mat3, Vec3, vec3};
use parts::{BAY_M, NAVE_M, pipe_name};
use scene::Movement;
use std::collections::HashMap;
use std::ops::RangeInclusive;

/// Default number of instances.
pub const DEFAULT_INSTANCES: u32 = 20_000;
/// Allowed numbers of instances.
pub const INSTANCES: RangeInclusive<u32> = 20_000..=100_000;

/// Largest number of instances in a bay of a nave.
const BAY_INSTANCES: usize = 460;
/// Height of the foot of the cranes' rails, metres.
const RAIL_M: f32 = 7.8;

/// Quarter turns, given by the directions of x, y and z.
const ALONG: Mat3 = Mat3::IDENTITY;
const AROUND: Mat3 = Mat3::from_cols(Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z);
/// z to +x.
const RIGHT: Mat3 = Mat3::from_cols(Vec3::NEG_Z, Vec3::Y, Vec3::X);
/// z to -x.
const LEFT: Mat3 = Mat3::from_cols(Vec3::Z, Vec3::Y, Vec3::NEG_X);
/// z to +y.
const UP: Mat3 = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
/// z to +x, y to -y: an elbow from +x down.
const RIGHT_DOWN: Mat3 = Mat3::from_cols(Vec3::Z, Vec3::NEG_Y, Vec3::X);
/// z to +y, y to -x: an elbow from up to -x.
const UP_LEFT: Mat3 = Mat3::from_cols(Vec3::NEG_Z, Vec3::NEG_X, Vec3::Y);
/// z to +y, y to +z: a valve in a riser, its wheel to +z.
const UP_WHEEL_OUT: Mat3 = Mat3::from_cols(Vec3::NEG_X, Vec3::Z, Vec3::Y);

/// What the scene's text names.
pub const CODE: Code = Code {
    shapes: &[
        ("hook", |m, _| machines::hook(m)),
        ("motor-body", |m, _| machines::motor(m)),
        ("cabinet-door", |m, _| machines::panel(m)),
        ("sign", |m, _| parts::sign(m)),
        ("stairs", |m, _| parts::stairs(m)),
        ("truss", |m, _| parts::truss(m)),
    ],
    steps: &[
        ("cables", |scene, _| parts::cables(scene)),
        ("pipes", |scene, _| parts::pipes(scene)),
    ],
};

/// Placements before they are sorted.
struct Layout {
    placed: Vec<(usize, Affine3A, Option<usize>)>,
    motions: Vec<Vec<Movement>>,
    /// Cables by colour.
    cables: Vec<usize>,
    /// Green and red lights.
    signals: Vec<usize>,
    /// Mesh numbers by name.
    meshes: HashMap<String, usize>,
}

/// Places exactly this number of instances, within [`INSTANCES`].
pub fn lay_out(scene: &mut SceneBuilder, instances: u32) {
    let instances = instances as usize;
    let mut layout = Layout {
        placed: Vec::with_capacity(instances),
        motions: Vec::new(),
        cables: scene.numbers("cable"),
        signals: scene.numbers("signal"),
        meshes: scene.mesh_numbers(),
    };
    // The hall is about three times as long as wide. Its last bay holds the stores.
    let cells = instances as f32 / 390.0;
    let naves = ((cells * BAY_M / (3.0 * NAVE_M)).sqrt().round() as usize).max(1);
    let mut bays = instances / (naves * BAY_INSTANCES / 2);
    loop {
        layout.clear();
        layout.hall(naves, bays);
        if layout.placed.len() <= instances {
            break;
        }
        bays -= 1;
    }
    layout.stores(naves, bays, instances);
    layout.finish(scene);

    let (width, length) = (naves as f32 * NAVE_M, bays as f32 * BAY_M);
    let nave = |x: f32| x - width / 2.0;
    let end = length / 2.0;
    for (name, eye, target) in [
        ("default", [11.6, 1.75, end - 31.0], [4.6, 2.6, end - 12.0]),
        ("aisle", [11.5, 1.7, end - 50.0], [11.5, 2.2, end]),
        ("walkway", [20.2, 5.2, end - 40.0], [8.0, 1.5, end - 22.0]),
        ("pumps", [9.4, 1.5, end - 24.0], [2.0, 1.6, end - 17.0]),
        ("overview", [20.5, 9.9, -end + 1.0], [10.0, 3.0, end]),
    ] {
        let in_nave = |[x, y, z]: [f32; 3]| vec3(nave(x), y, z);
        scene.camera(name, 0.1, 600.0, in_nave(eye), in_nave(target));
    }
    for k in 0..8 {
        let (x, z) = (
            nave(6.0 + 12.0 * (k % 2) as f32),
            end - 10.0 - 12.0 * (k / 2) as f32,
        );
        scene.lamp(vec3(x, 9.0, z), vec3(11.0, 10.4, 9.2));
    }
}

impl Layout {
    fn clear(&mut self) {
        self.placed.clear();
        self.motions.clear();
    }

    fn put(&mut self, name: &str, turn: Mat3, x: f32, y: f32, z: f32) {
        self.put_mesh(self.meshes[name], turn, x, y, z);
    }

    /// Places a kind of pipe for a service.
    fn put_pipe(&mut self, what: &str, service: usize, turn: Mat3, x: f32, y: f32, z: f32) {
        self.put(&pipe_name(what, service), turn, x, y, z);
    }

    fn put_mesh(&mut self, mesh: usize, turn: Mat3, x: f32, y: f32, z: f32) {
        let place = Affine3A::from_mat3_translation(turn, vec3(x, y, z));
        self.placed.push((mesh, place, None));
    }

    /// Places a part of a moving group.
    fn put_moving(&mut self, motion: usize, name: &str, turn: Mat3, at: Vec3) {
        let place = Affine3A::from_mat3_translation(turn, at);
        self.placed.push((self.meshes[name], place, Some(motion)));
    }

    fn motion(&mut self, movements: Vec<Movement>) -> usize {
        self.motions.push(movements);
        self.motions.len() - 1
    }

    /// Sorts instances by mesh, and keeps the order in which those of a mesh were placed.
    fn finish(mut self, scene: &mut SceneBuilder) {
        self.placed.sort_by_key(|(mesh, ..)| *mesh);
        let mut groups = vec![Vec::new(); self.motions.len()];
        for (number, (mesh, place, motion)) in self.placed.into_iter().enumerate() {
            scene.place(mesh, place);
            if let Some(motion) = motion {
                groups[motion].push(number);
            }
        }
        for (instances, movements) in groups.into_iter().zip(self.motions) {
            scene.motion(instances, movements);
        }
    }

    /// The building with its contents, except for the stores.
    fn hall(&mut self, naves: usize, bays: usize) {
        let (x0, z0) = (-(naves as f32) * NAVE_M / 2.0, -(bays as f32) * BAY_M / 2.0);
        for bay in 0..bays {
            let z = z0 + bay as f32 * BAY_M;
            for nave in 0..naves {
                let x = x0 + nave as f32 * NAVE_M;
                self.building(x, z);
                self.overhead(x, z);
                self.pipe_rack(x, z, nave, bay);
                self.cable_trays(x, z);
                self.walkway(x, z, bay);
                if bay + 1 < bays {
                    self.west(x, z, nave, bay);
                    self.east(x, z, nave, bay);
                }
            }
            self.columns(x0 + naves as f32 * NAVE_M, z);
            for (x, turn, shift) in [
                (x0, ALONG, 0.0),
                (x0 + naves as f32 * NAVE_M, AROUND, BAY_M),
            ] {
                self.side_wall(x, z + shift, turn);
            }
        }
        let z1 = z0 + bays as f32 * BAY_M;
        for quarter in 0..naves * 4 {
            let x = x0 + quarter as f32 * BAY_M;
            self.side_wall(x, z1, RIGHT);
            self.side_wall(x + BAY_M, z0, LEFT);
        }
        for nave in 0..naves {
            let x = x0 + nave as f32 * NAVE_M;
            self.crane(x, z0, bays, 3 * nave + 1);
            self.cart(x + 11.5, z0, bays, nave);
            for k in 0..2 {
                self.fan(x + 8.0 + 8.0 * k as f32, z1 - 0.4, (nave + k) as f32);
            }
        }
    }

    /// Four anchor bolts around a base plate.
    fn bolts(&mut self, x: f32, y: f32, z: f32, half_x: f32, half_z: f32) {
        for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            self.put("bolt", ALONG, x + sx * half_x, y, z + sz * half_z);
        }
    }

    fn cabinet(&mut self, x: f32, z: f32, turn: Mat3, panel: bool) {
        // The door is at -z, so it faces against the rotated z axis.
        let turn = turn * AROUND;
        self.put("cabinet", turn, x, 0.0, z);
        if panel {
            self.put("panel", turn, x, 0.0, z);
            self.put_mesh(
                self.signals[usize::from(z as i32 % 5 == 0)],
                turn,
                x,
                2.0,
                z,
            );
        }
    }

    fn mill(&mut self, x: f32, z: f32, turn: Mat3, number: usize) {
        // The door faces along the rotated z axis.
        let turn = turn * AROUND;
        let side = |along: f32, out: f32| turn * vec3(along, 0.0, -out);
        self.put("mill", turn, x, 0.0, z);
        self.put("mill-guard", turn, x, 0.0, z);
        let light = side(1.0, 0.4);
        self.put_mesh(
            self.signals[number % 2],
            turn,
            x + light.x,
            2.35,
            z + light.z,
        );
        let bench = side(0.4, 1.4);
        self.put("bin", turn, x + bench.x, 0.0, z + bench.z);
    }
}
