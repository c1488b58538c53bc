//! An industrial hall of very many objects: naves of pipe racks, tanks, pumps, machines, stores and
//! walkways under travelling cranes. It stands for the data of a factory's planners.
//!
//! The hall is laid out bay by bay, then sorted by mesh, so that the instances of a mesh follow each
//! other and make one draw call. Directions are quarter turns throughout: their matrices hold
//! zeros and ones, which keeps boxes tight and cheap.

use super::noise::{Rng, hash};
use super::plant_machines::{Machines, machines};
use super::plant_materials::{SERVICES, kit};
use super::plant_parts::{BAY_M, BEND, NAVE_M, Parts, RADII_M, ROOF_M, parts};
use super::scene_builder::SceneBuilder;
use glam::{Affine3A, Mat3, Vec3, vec3};
use scene::{Movement, Scene};
use std::ops::RangeInclusive;

/// Instances where no number is asked for.
pub const DEFAULT_INSTANCES: u32 = 20_000;
/// Instances that can be asked for.
pub const INSTANCES: RangeInclusive<u32> = 20_000..=100_000;

/// Instances that a bay of a nave has at most.
const BAY_INSTANCES: usize = 460;
/// Foot of the cranes' rails, metres.
const RAIL_M: f32 = 7.8;

/// Quarter turns: where x, y and z point.
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

/// What is placed where, before it is sorted.
struct Layout {
    placed: Vec<(usize, Affine3A, Option<usize>)>,
    motions: Vec<Vec<Movement>>,
    p: Parts,
    m: Machines,
}

/// The scene with its usual number of instances.
#[must_use]
pub fn scene() -> Scene {
    with_instances(DEFAULT_INSTANCES)
}

/// The scene with exactly so many instances, of [`INSTANCES`].
#[must_use]
pub fn with_instances(instances: u32) -> Scene {
    let instances = instances as usize;
    let mut scene = SceneBuilder::new("plant");
    let kit = kit(&mut scene);
    let (p, m) = (parts(&mut scene, &kit), machines(&mut scene, &kit));
    let mut layout = Layout {
        placed: Vec::with_capacity(instances),
        motions: Vec::new(),
        p,
        m,
    };
    // A hall some three times as long as wide; its last bay holds the stores.
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
    layout.finish(&mut scene);

    let (width, length) = (naves as f32 * NAVE_M, bays as f32 * BAY_M);
    let nave = |x: f32| x - width / 2.0;
    let end = length / 2.0;
    let mut camera =
        |name: &str, eye: Vec3, target: Vec3| scene.camera(name, eye, target, 0.1, 600.0);
    camera(
        "default",
        vec3(nave(11.6), 1.75, end - 31.0),
        vec3(nave(4.6), 2.6, end - 12.0),
    );
    camera(
        "aisle",
        vec3(nave(11.5), 1.7, end - 50.0),
        vec3(nave(11.5), 2.2, end),
    );
    camera(
        "walkway",
        vec3(nave(20.2), 5.2, end - 40.0),
        vec3(nave(8.0), 1.5, end - 22.0),
    );
    camera(
        "pumps",
        vec3(nave(9.4), 1.5, end - 24.0),
        vec3(nave(2.0), 1.6, end - 17.0),
    );
    camera(
        "overview",
        vec3(nave(20.5), 9.9, -end + 1.0),
        vec3(nave(10.0), 3.0, end),
    );
    scene.sun(vec3(-0.42, -1.0, 0.3), vec3(1.2, 1.16, 1.08));
    for k in 0..8 {
        let (x, z) = (
            nave(6.0 + 12.0 * (k % 2) as f32),
            end - 10.0 - 12.0 * (k / 2) as f32,
        );
        scene.lamp(vec3(x, 9.0, z), vec3(11.0, 10.4, 9.2));
    }
    scene.finish(vec3(0.5, 0.55, 0.6), 0)
}

impl Layout {
    fn clear(&mut self) {
        self.placed.clear();
        self.motions.clear();
    }

    fn put(&mut self, mesh: usize, turn: Mat3, x: f32, y: f32, z: f32) {
        let place = Affine3A::from_mat3_translation(turn, vec3(x, y, z));
        self.placed.push((mesh, place, None));
    }

    /// Puts a part of what moves together.
    fn put_moving(&mut self, motion: usize, mesh: usize, turn: Mat3, at: Vec3) {
        let place = Affine3A::from_mat3_translation(turn, at);
        self.placed.push((mesh, place, Some(motion)));
    }

    fn motion(&mut self, movements: Vec<Movement>) -> usize {
        self.motions.push(movements);
        self.motions.len() - 1
    }

    /// Instances of a mesh follow each other, in the order in which they were placed.
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

    /// The building with all that stands in it, but for the stores.
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

    /// 6 m of wall: cladding, a band of windows, cladding, windows, cladding to the roof.
    fn side_wall(&mut self, x: f32, z: f32, turn: Mat3) {
        self.put(self.p.wall, turn, x, 0.0, z);
        self.put(self.p.window, turn, x, 5.0, z);
        self.put(self.p.wall, turn, x, 6.5, z);
        self.put(self.p.window, turn, x, 11.5, z);
    }

    fn building(&mut self, x: f32, z: f32) {
        for k in 0..4 {
            let left = x + BAY_M * k as f32;
            self.put(self.p.slab, ALONG, left, 0.0, z);
            self.put(self.p.deck, ALONG, left, ROOF_M, z);
            self.put(self.p.sky_light, ALONG, left + 2.1, ROOF_M, z);
        }
        for lane in [10.0, 13.0] {
            self.put(self.p.lane, ALONG, x + lane, 0.006, z);
        }
        self.columns(x, z);
        self.put(self.p.truss, ALONG, x + NAVE_M / 2.0, ROOF_M - 1.9, z);
        for k in 0..8 {
            self.put(
                self.p.purlin,
                ALONG,
                x + 1.5 + 3.0 * k as f32,
                ROOF_M - 0.21,
                z,
            );
        }
        for (side, turn) in [(0.2, ALONG), (NAVE_M - 0.2, AROUND)] {
            self.put(self.p.bracket, turn, x + side, RAIL_M - 0.75, z);
        }
        for side in [0.75, NAVE_M - 0.75] {
            self.put(self.p.runway, ALONG, x + side, RAIL_M - 0.33, z);
        }
    }

    fn columns(&mut self, x: f32, z: f32) {
        self.put(self.p.column, ALONG, x, 0.0, z);
        self.bolts(x, 0.03, z, 0.28, 0.28);
    }

    /// Four anchor bolts around a base plate.
    fn bolts(&mut self, x: f32, y: f32, z: f32, half_x: f32, half_z: f32) {
        for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            self.put(self.p.bolt, ALONG, x + sx * half_x, y, z + sz * half_z);
        }
    }

    /// Lamps, sprinklers and a ventilation duct.
    fn overhead(&mut self, x: f32, z: f32) {
        for lamp in [6.0, 11.5, 17.0] {
            self.put(self.p.lamp_shade, ALONG, x + lamp, 10.05, z);
            self.put(self.p.lamp, ALONG, x + lamp, 10.05, z);
        }
        for main in [4.0, 19.0] {
            self.put(self.p.pipe[0][3], ALONG, x + main, 11.05, z);
            for k in 0..3 {
                self.put(
                    self.p.sprinkler,
                    ALONG,
                    x + main,
                    11.01,
                    z + 1.0 + 2.0 * k as f32,
                );
            }
        }
        self.put(self.p.duct, ALONG, x + 22.4, 6.6, z);
        self.put(self.p.diffuser, ALONG, x + 22.4, 6.6, z + 3.0);
    }

    /// Three levels of pipes along the nave, with supports, joints and branches.
    fn pipe_rack(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        for post in [0.9, 3.3] {
            self.put(self.p.rack_post, ALONG, x + post, 0.0, z + 1.0);
            self.bolts(x + post, 0.02, z + 1.0, 0.15, 0.15);
        }
        for (level, y) in [4.0, 5.0, 6.0].into_iter().enumerate() {
            self.put(self.p.rack_beam, ALONG, x + 0.9, y, z + 1.0);
            let mut at = x + 1.15;
            for slot in 0..7 {
                let (size, service) = rack_pipe(nave, level, slot);
                let radius = RADII_M[size];
                at += radius;
                let height = y + 0.16 + radius;
                self.put(self.p.pipe[size][service], ALONG, at, height, z);
                self.put(self.p.shoe, ALONG, at, y + 0.1, z + 1.0);
                if (bay + slot).is_multiple_of(2) {
                    self.put(self.p.flange[size], ALONG, at, height, z);
                }
                if (bay * 7 + slot) % 9 == 4 && size == 1 {
                    self.put(self.p.valve, ALONG, at, height, z + 4.0);
                }
                at += radius + 0.1;
            }
        }
    }

    /// Three trays with cables along the nave's other side, on stands that carry the duct, too.
    fn cable_trays(&mut self, x: f32, z: f32) {
        let x = x + 22.4;
        for k in 0..2 {
            self.put(self.p.stand, ALONG, x, 4.4, z + 0.5 + 3.0 * k as f32);
        }
        for level in 0..3 {
            let y = 4.4 + 0.55 * level as f32;
            self.put(self.p.tray, ALONG, x, y, z);
            for k in 0..6 {
                let kind = (k * 5 + level * 2) % 3;
                let across = x - 0.22 + 0.085 * k as f32;
                self.put(self.p.cable[kind], ALONG, across, y + 0.018, z);
            }
        }
    }

    /// A mezzanine along the nave, with stairs in every eighth bay.
    fn walkway(&mut self, x: f32, z: f32, bay: usize) {
        let (x, y) = (x + 20.2, 3.5);
        let stairs = bay % 8 == 3;
        for k in 0..3 {
            let along = z + 2.0 * k as f32;
            self.put(self.p.grating, ALONG, x, y, along);
            for side in [-0.65, 0.65] {
                self.put(self.p.stringer, ALONG, x + side, y, along);
                if !(stairs && side < 0.0 && k == 2) {
                    self.put(self.p.railing, ALONG, x + side, y, along);
                }
            }
        }
        for side in [-0.65, 0.65] {
            self.put(self.p.leg, ALONG, x + side, 0.0, z + 0.15);
        }
        if stairs {
            // Up along the walkway's side, to the gap in its railing.
            self.put(self.p.stairs, ALONG, x - 1.25, 0.0, z + 0.4);
        }
    }

    /// Process plant beside the pipe rack.
    fn west(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        match hash(nave as i32, bay as i32 / 3, 41) % 4 {
            0 => self.tanks(x, z, nave, bay),
            1 => self.pump_row(x, z, nave, bay),
            2 => self.vessels(x, z, bay),
            _ => {
                self.mill(x + 6.6, z + 1.5, RIGHT, bay);
                self.mill(x + 6.6, z + 4.5, RIGHT, bay + 1);
                self.drop_pipe(x, z + 2.95, nave, bay, 4.4);
            }
        }
        self.put(self.p.bollard, ALONG, x + 9.7, 0.0, z + 1.6);
        self.put(self.p.bollard, ALONG, x + 9.7, 0.0, z + 4.6);
        // Switchgear under the rack.
        for k in 0..3 {
            self.cabinet(x + 1.9, z + 1.9 + 1.15 * k as f32, RIGHT, k == 1);
        }
    }

    /// What is made and stored, on the other side of the aisle.
    fn east(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        let kind = |bay: usize| hash(nave as i32, bay as i32 / 4, 97) % 4;
        match kind(bay) {
            0 | 1 => self.pallet_racks(x, z, nave, bay, kind(bay + 1) > 1),
            2 => self.conveyors(x, z, nave, bay),
            _ => self.workshop(x, z, bay),
        }
        self.cabinet(x + 21.9, z + 2.0, LEFT, bay.is_multiple_of(2));
        if !bay.is_multiple_of(2) {
            self.put(self.p.sign, LEFT, x + 21.64, 1.2, z + 2.0);
        }
    }

    fn cabinet(&mut self, x: f32, z: f32, turn: Mat3, panel: bool) {
        // The door is at -z: it faces against the turned z axis.
        let turn = turn * AROUND;
        self.put(self.m.cabinet, turn, x, 0.0, z);
        if panel {
            self.put(self.m.panel, turn, x, 0.0, z);
            self.put(
                self.m.signal[usize::from(z as i32 % 5 == 0)],
                turn,
                x,
                2.0,
                z,
            );
        }
    }

    /// A branch from the rack's lowest level to +x and down to `x + reach`, with a valve.
    fn drop_pipe(&mut self, x: f32, z: f32, nave: usize, bay: usize, reach: f32) {
        let service = (nave + bay) % SERVICES;
        let bend = BEND * RADII_M[1];
        let (y, end) = (3.6, x + reach);
        self.put(self.p.spool[1][service], RIGHT, end - bend - 2.0, y, z);
        self.put(self.p.elbow[1][service], RIGHT_DOWN, end - bend, y, z);
        self.put(self.p.spool[1][service], UP, end, y - bend - 2.0, z);
        self.put(self.p.flange[1], UP, end, y - bend, z);
        let valve = y - bend - 2.0 - 0.2;
        self.put(self.p.valve, UP, end, valve, z);
        self.put(self.p.flange[1], UP, end, valve - 0.2, z);
        // On into the floor.
        self.put(self.p.spool[1][service], UP, end, valve - 2.2, z);
    }

    /// Two tanks with legs, ladder, pipes and gauges.
    fn tanks(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        for (k, (dx, dz)) in [(5.6, 1.5), (7.6, 4.4)].into_iter().enumerate() {
            let (tx, tz) = (x + dx, z + dz);
            self.put(self.m.tank, ALONG, tx, 0.0, tz);
            for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                let (lx, lz) = (tx + sx * 0.72, tz + sz * 0.72);
                self.put(self.m.tank_leg, ALONG, lx, 0.0, lz);
                self.bolts(lx, 0.02, lz, 0.1, 0.1);
            }
            self.put(self.m.ladder, ALONG, tx, 0.0, tz - 1.32);
            self.put(self.p.gauge, RIGHT, tx + 0.9, 4.1, tz);
            self.put(self.p.sign, RIGHT, tx + 1.14, 1.5, tz);
            // From the tank's top back to the rack.
            let service = (nave + bay + k) % SERVICES;
            let bend = BEND * RADII_M[1];
            let top = 4.45 + 0.3;
            self.put(self.p.flange[1], UP, tx, 4.55, tz);
            self.put(self.p.elbow[1][service], UP_LEFT, tx, top - 0.28, tz);
            let turned = tx - bend;
            self.put(
                self.p.spool[1][service],
                LEFT,
                turned,
                top - 0.28 + bend,
                tz,
            );
            if k == 1 {
                self.put(
                    self.p.spool[1][service],
                    LEFT,
                    turned - 2.0,
                    top - 0.28 + bend,
                    tz,
                );
                self.put(self.p.flange[1], LEFT, turned - 2.0, top - 0.28 + bend, tz);
            }
        }
    }

    /// Pumps with motors and valves between a suction and a discharge header.
    fn pump_row(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        let service = (nave * 2 + bay / 3) % SERVICES;
        let pz = z + 3.2;
        for k in 0..4 {
            let px = x + 4.9 + 1.25 * k as f32;
            self.put(self.m.plinth, ALONG, px, 0.0, pz);
            self.bolts(px, 0.15, pz + 0.3, 0.32, 0.75);
            self.put(self.m.pump, ALONG, px, 0.15, pz);
            self.put(self.m.motor, ALONG, px, 0.15, pz + 0.36);
            self.put(self.p.gauge, AROUND, px - 0.2, 0.6, pz);
            let riser = px + 0.12;
            self.put(self.p.flange[1], UP, riser, 1.12, pz);
            self.put(self.p.valve, UP_WHEEL_OUT, riser, 1.34, pz);
            self.put(self.p.flange[1], UP, riser, 1.56, pz);
            self.put(self.p.spool[1][service], UP, riser, 1.56, pz);
            self.put(self.p.flange[1], ALONG, px, 0.5, pz - 0.42);
            self.put(self.p.valve, ALONG, px, 0.5, pz - 0.64);
            self.put(self.p.flange[1], ALONG, px, 0.5, pz - 0.86);
            self.put(self.p.spool[1][service], AROUND, px, 0.5, pz - 0.84);
        }
        self.put(self.p.pipe[2][service], RIGHT, x + 3.3, 3.75, pz);
        self.put(self.p.flange[2], RIGHT, x + 9.3, 3.75, pz);
        self.put(self.p.pipe[2][service], RIGHT, x + 3.5, 0.5, z + 0.36);
        for end in [3.5, 9.5] {
            self.put(self.p.flange[2], RIGHT, x + end, 0.5, z + 0.36);
        }
        for k in 0..3 {
            self.put(self.m.drum, ALONG, x + 5.2 + 0.75 * k as f32, 0.0, z + 5.3);
        }
    }

    /// Heat exchangers, two on saddles and one above each.
    fn vessels(&mut self, x: f32, z: f32, bay: usize) {
        for dx in [5.4, 7.6] {
            for dz in [0.9, 3.8] {
                self.put(self.m.saddle, ALONG, x + dx, 0.0, z + dz + 0.2);
                self.put(self.m.saddle, ALONG, x + dx, 1.8, z + dz + 0.2);
                self.bolts(x + dx, 0.0, z + dz + 0.2, 0.62, 0.0);
            }
            for y in [1.2, 3.0] {
                self.put(self.m.vessel, ALONG, x + dx, y, z + 0.4);
                self.put(self.p.flange[1], UP, x + dx, y + 0.6, z + 2.0);
                self.put(self.p.gauge, RIGHT, x + dx + 0.3, y + 0.5, z + 3.2);
            }
            self.put(self.p.spool[1][bay % SERVICES], UP, x + dx, 3.6, z + 2.0);
            let bend = BEND * RADII_M[1];
            self.put(
                self.p.elbow[1][bay % SERVICES],
                UP_LEFT,
                x + dx,
                5.6,
                z + 2.0,
            );
            for k in 0..=usize::from(dx > 6.0) {
                let from = x + dx - bend - 2.0 * k as f32;
                self.put(
                    self.p.spool[1][bay % SERVICES],
                    LEFT,
                    from,
                    5.6 + bend,
                    z + 2.0,
                );
            }
        }
        self.put(self.p.sign, RIGHT, x + 8.22, 1.0, z + 1.8);
    }

    fn mill(&mut self, x: f32, z: f32, turn: Mat3, number: usize) {
        // The door looks along the turned z axis.
        let turn = turn * AROUND;
        let side = |along: f32, out: f32| turn * vec3(along, 0.0, -out);
        self.put(self.m.mill, turn, x, 0.0, z);
        self.put(self.m.mill_guard, turn, x, 0.0, z);
        let light = side(1.0, 0.4);
        self.put(
            self.m.signal[number % 2],
            turn,
            x + light.x,
            2.35,
            z + light.z,
        );
        let bench = side(0.4, 1.4);
        self.put(self.m.bin, turn, x + bench.x, 0.0, z + bench.z);
    }

    /// Shelves of pallets with what lies on them; the last bay of a row closes it.
    fn pallet_racks(&mut self, x: f32, z: f32, nave: usize, bay: usize, last: bool) {
        let mut rng = Rng::new(u64::from(hash(nave as i32, bay as i32, 5)));
        for rx in [x + 14.4, x + 17.2] {
            for k in 0..2 + usize::from(last) {
                self.put(self.m.upright, ALONG, rx, 0.0, z + 0.15 + 3.0 * k as f32);
            }
            for k in 0..2 {
                let along = z + 0.2 + 3.0 * k as f32;
                for y in [1.2, 2.5, 3.8] {
                    self.put(self.m.beam, ALONG, rx - 0.5, y, along);
                    self.put(self.m.beam, ALONG, rx + 0.5, y, along);
                }
                for y in [0.0, 1.26, 2.56, 3.86] {
                    for j in 0..3 {
                        let pz = along + 0.5 + 0.95 * j as f32;
                        self.put(self.m.pallet, ALONG, rx, y, pz);
                        self.load(rx, y + 0.144, pz, &mut rng);
                    }
                }
            }
        }
    }

    /// Goods on a pallet: a crate, two drums, or cartons in layers.
    fn load(&mut self, x: f32, y: f32, z: f32, rng: &mut Rng) {
        match rng.below(4) {
            0 => self.put(self.m.crate_box, ALONG, x, y, z),
            1 => {
                for dx in [-0.3, 0.3] {
                    self.put(self.m.drum, ALONG, x + dx, y, z);
                }
            }
            2 => {
                for k in 0..6 {
                    let (dx, layer, dz) = (k % 2, k / 4, (k / 2) % 2);
                    let across = x - 0.29 + 0.58 * dx as f32;
                    let deep = z - 0.195 + 0.39 * dz as f32;
                    self.put(self.m.carton, ALONG, across, y + 0.36 * layer as f32, deep);
                }
            }
            _ => {}
        }
    }

    /// Roller conveyors with what they carry, and a press between them.
    fn conveyors(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        let mut rng = Rng::new(u64::from(hash(nave as i32, bay as i32, 6)));
        for dx in [14.2, 17.9] {
            for k in 0..3 {
                let along = z + 2.0 * k as f32;
                self.put(self.m.conveyor, ALONG, x + dx, 0.0, along);
                for j in 0..16 {
                    let at = along + 0.0625 + 0.125 * j as f32;
                    self.put(self.m.roller, ALONG, x + dx, 0.735, at);
                }
                if rng.unit() < 0.7 {
                    let shift = rng.range(0.4, 1.6);
                    self.put(self.m.carton, ALONG, x + dx, 0.77, along + shift);
                }
            }
        }
        self.put(self.m.press, RIGHT, x + 16.2, 0.0, z + 3.0);
        self.bolts(x + 16.2, 0.0, z + 3.0, 0.7, 0.95);
        self.cabinet(x + 16.2, z + 5.2, RIGHT, true);
    }

    /// Benches, mills and small stock.
    fn workshop(&mut self, x: f32, z: f32, bay: usize) {
        self.mill(x + 16.9, z + 1.5, LEFT, bay);
        self.mill(x + 16.9, z + 4.5, LEFT, bay + 1);
        for dz in [1.6, 4.3] {
            self.put(self.m.bench, RIGHT, x + 14.2, 0.0, z + dz);
            for k in 0..4 {
                let at = z + dz - 0.75 + 0.5 * k as f32;
                self.put(self.m.bin, RIGHT, x + 14.2, 0.92, at);
            }
        }
        for k in 0..4 {
            let at = z + 0.6 + 1.4 * k as f32;
            self.put(self.m.drum, ALONG, x + 18.05, 0.0, at);
        }
    }

    /// A crane that travels the nave, its trolley and its hook.
    fn crane(&mut self, x: f32, z0: f32, bays: usize, seed: usize) {
        let run = (bays as f32 * BAY_M - 12.0).min(60.0);
        // Near the end where the cameras are.
        let z = z0 + bays as f32 * BAY_M - 8.0 - 2.0 * seed as f32;
        let travel = Movement::Shuttle {
            by: Vec3::Z * -(run - 8.0),
            period_s: run / 0.4,
            phase: 0.06,
        };
        let across = Movement::Shuttle {
            by: Vec3::X * 6.0,
            period_s: 26.0,
            phase: 0.1,
        };
        let hoist = Movement::Shuttle {
            by: Vec3::Y * 0.8,
            period_s: 17.0,
            phase: 0.3,
        };
        let rail = RAIL_M + 0.03;
        let middle = x + NAVE_M / 2.0;
        let bridge = self.motion(vec![travel]);
        for dz in [-1.0, 1.0] {
            self.put_moving(
                bridge,
                self.m.girder,
                ALONG,
                vec3(middle, rail + 0.1, z + dz),
            );
        }
        for side in [0.75, NAVE_M - 0.75] {
            self.put_moving(
                bridge,
                self.m.end_truck,
                ALONG,
                vec3(x + side, rail + 0.1, z),
            );
        }
        let trolley = self.motion(vec![travel, across]);
        let at = vec3(x + 10.3, rail + 1.06, z);
        self.put_moving(trolley, self.m.trolley, ALONG, at);
        // The ropes' upper ends stay inside the trolley's drum.
        let load = self.motion(vec![travel, across, hoist]);
        self.put_moving(load, self.m.rope, ALONG, at - Vec3::Y * 2.7);
        self.put_moving(load, self.m.hook, ALONG, at - Vec3::Y * 3.6);
    }

    /// A cart that drives along the aisle with a crate.
    fn cart(&mut self, x: f32, z0: f32, bays: usize, nave: usize) {
        let end = z0 + bays as f32 * BAY_M;
        let z = end - 14.0 - 4.0 * nave as f32;
        let drive = Movement::Shuttle {
            by: Vec3::Z * -30.0,
            period_s: 50.0,
            phase: 0.08,
        };
        let motion = self.motion(vec![drive]);
        self.put_moving(motion, self.m.cart, ALONG, vec3(x, 0.0, z));
        self.put_moving(motion, self.m.pallet, RIGHT, vec3(x, 0.35, z));
        self.put_moving(motion, self.m.crate_box, RIGHT, vec3(x, 0.494, z));
        for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let at = vec3(x + 0.4 * sx, 0.14, z + 0.5 * sz);
            self.put_moving(motion, self.m.wheel, ALONG, at);
        }
    }

    /// A fan in the end wall.
    fn fan(&mut self, x: f32, z: f32, phase: f32) {
        let at = vec3(x, 9.0, z);
        self.put(self.p.fan_ring, ALONG, at.x, at.y, at.z);
        let turning = self.motion(vec![Movement::Turn {
            pivot: at,
            axis: Vec3::Z,
            turns_per_s: 1.3 + 0.2 * phase,
        }]);
        self.put_moving(turning, self.p.fan_blades, ALONG, at);
    }

    /// Bins stacked in the hall's last bay until there are as many instances as asked for.
    fn stores(&mut self, naves: usize, bays: usize, instances: usize) {
        let z = bays as f32 * BAY_M / 2.0 - BAY_M + 1.6;
        let (columns, rows) = (26, 9);
        let mut left = instances - self.placed.len();
        for layer in 0.. {
            for nave in 0..naves {
                let x = (nave as f32 - naves as f32 / 2.0) * NAVE_M;
                for k in 0..columns * rows {
                    if left == 0 {
                        return;
                    }
                    left -= 1;
                    let (column, row) = (k % columns, k / columns);
                    // The aisle stays free.
                    let across = if column < 13 { 4.3 } else { 13.4 - 0.38 * 13.0 };
                    let across = x + across + 0.38 * column as f32;
                    let (y, along) = (0.262 * layer as f32, z + 0.42 * row as f32);
                    self.put(self.m.bin, ALONG, across, y, along);
                }
            }
        }
    }
}

/// Size and service of a pipe of the rack.
fn rack_pipe(nave: usize, level: usize, slot: usize) -> (usize, usize) {
    let sizes = [
        [1, 1, 0, 2, 1, 0, 0],
        [2, 1, 1, 0, 0, 1, 0],
        [1, 2, 0, 1, 1, 0, 0],
    ];
    (sizes[level][slot], (nave + 2 * level + slot * 5) % SERVICES)
}
