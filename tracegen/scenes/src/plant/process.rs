//! Pipes, and the process plant next to the pipe rack.

use super::materials::SERVICES;
use super::parts::{BEND, RADII_M, SIZES};
use super::{ALONG, AROUND, LEFT, Layout, RIGHT, RIGHT_DOWN, UP, UP_LEFT, UP_WHEEL_OUT};
use crate::noise::hash;

impl Layout {
    /// Three levels of pipes along the nave, with supports, joints and branches.
    pub(super) fn pipe_rack(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        for post in [0.9, 3.3] {
            self.put("rack-post", ALONG, x + post, 0.0, z + 1.0);
            self.bolts(x + post, 0.02, z + 1.0, 0.15, 0.15);
        }
        for (level, y) in [4.0, 5.0, 6.0].into_iter().enumerate() {
            self.put("rack-beam", ALONG, x + 0.9, y, z + 1.0);
            let mut at = x + 1.15;
            for slot in 0..7 {
                let (size, service) = rack_pipe(nave, level, slot);
                let radius = RADII_M[size];
                at += radius;
                let height = y + 0.16 + radius;
                let name = SIZES[size];
                self.put_pipe(&format!("pipe-{name}"), service, ALONG, at, height, z);
                self.put("pipe-shoe", ALONG, at, y + 0.1, z + 1.0);
                if (bay + slot).is_multiple_of(2) {
                    self.put(&format!("flange-{name}"), ALONG, at, height, z);
                }
                if (bay * 7 + slot) % 9 == 4 && size == 1 {
                    self.put("valve", ALONG, at, height, z + 4.0);
                }
                at += radius + 0.1;
            }
        }
    }

    /// Process plant next to the pipe rack.
    pub(super) fn west(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
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
        self.put("bollard", ALONG, x + 9.7, 0.0, z + 1.6);
        self.put("bollard", ALONG, x + 9.7, 0.0, z + 4.6);
        // Switchgear under the rack.
        for k in 0..3 {
            self.cabinet(x + 1.9, z + 1.9 + 1.15 * k as f32, RIGHT, k == 1);
        }
    }

    /// A branch from the rack's lowest level to +x and down to `x + reach`, with a valve.
    fn drop_pipe(&mut self, x: f32, z: f32, nave: usize, bay: usize, reach: f32) {
        let service = (nave + bay) % SERVICES;
        let bend = BEND * RADII_M[1];
        let (y, end) = (3.6, x + reach);
        self.put_pipe("spool-m", service, RIGHT, end - bend - 2.0, y, z);
        self.put_pipe("elbow-m", service, RIGHT_DOWN, end - bend, y, z);
        self.put_pipe("spool-m", service, UP, end, y - bend - 2.0, z);
        self.put("flange-m", UP, end, y - bend, z);
        let valve = y - bend - 2.0 - 0.2;
        self.put("valve", UP, end, valve, z);
        self.put("flange-m", UP, end, valve - 0.2, z);
        // Continues into the floor.
        self.put_pipe("spool-m", service, UP, end, valve - 2.2, z);
    }

    /// Two tanks with legs, ladder, pipes and gauges.
    fn tanks(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        for (k, (dx, dz)) in [(5.6, 1.5), (7.6, 4.4)].into_iter().enumerate() {
            let (tx, tz) = (x + dx, z + dz);
            self.put("tank", ALONG, tx, 0.0, tz);
            for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                let (lx, lz) = (tx + sx * 0.72, tz + sz * 0.72);
                self.put("tank-leg", ALONG, lx, 0.0, lz);
                self.bolts(lx, 0.02, lz, 0.1, 0.1);
            }
            self.put("ladder", ALONG, tx, 0.0, tz - 1.32);
            self.put("gauge", RIGHT, tx + 0.9, 4.1, tz);
            self.put("sign", RIGHT, tx + 1.14, 1.5, tz);
            // From the tank's top back to the rack.
            let service = (nave + bay + k) % SERVICES;
            let bend = BEND * RADII_M[1];
            let top = 4.45 + 0.3;
            self.put("flange-m", UP, tx, 4.55, tz);
            self.put_pipe("elbow-m", service, UP_LEFT, tx, top - 0.28, tz);
            let turned = tx - bend;
            self.put_pipe("spool-m", service, LEFT, turned, top - 0.28 + bend, tz);
            if k == 1 {
                self.put_pipe(
                    "spool-m",
                    service,
                    LEFT,
                    turned - 2.0,
                    top - 0.28 + bend,
                    tz,
                );
                self.put("flange-m", LEFT, turned - 2.0, top - 0.28 + bend, tz);
            }
        }
    }

    /// Pumps with motors and valves between a suction and a discharge header.
    fn pump_row(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        let service = (nave * 2 + bay / 3) % SERVICES;
        let pz = z + 3.2;
        for k in 0..4 {
            let px = x + 4.9 + 1.25 * k as f32;
            self.put("plinth", ALONG, px, 0.0, pz);
            self.bolts(px, 0.15, pz + 0.3, 0.32, 0.75);
            self.put("pump", ALONG, px, 0.15, pz);
            self.put("motor", ALONG, px, 0.15, pz + 0.36);
            self.put("gauge", AROUND, px - 0.2, 0.6, pz);
            let riser = px + 0.12;
            self.put("flange-m", UP, riser, 1.12, pz);
            self.put("valve", UP_WHEEL_OUT, riser, 1.34, pz);
            self.put("flange-m", UP, riser, 1.56, pz);
            self.put_pipe("spool-m", service, UP, riser, 1.56, pz);
            self.put("flange-m", ALONG, px, 0.5, pz - 0.42);
            self.put("valve", ALONG, px, 0.5, pz - 0.64);
            self.put("flange-m", ALONG, px, 0.5, pz - 0.86);
            self.put_pipe("spool-m", service, AROUND, px, 0.5, pz - 0.84);
        }
        self.put_pipe("pipe-l", service, RIGHT, x + 3.3, 3.75, pz);
        self.put("flange-l", RIGHT, x + 9.3, 3.75, pz);
        self.put_pipe("pipe-l", service, RIGHT, x + 3.5, 0.5, z + 0.36);
        for end in [3.5, 9.5] {
            self.put("flange-l", RIGHT, x + end, 0.5, z + 0.36);
        }
        for k in 0..3 {
            self.put("drum", ALONG, x + 5.2 + 0.75 * k as f32, 0.0, z + 5.3);
        }
    }

    /// Heat exchangers, two on saddles and one above each.
    fn vessels(&mut self, x: f32, z: f32, bay: usize) {
        for dx in [5.4, 7.6] {
            for dz in [0.9, 3.8] {
                self.put("saddle", ALONG, x + dx, 0.0, z + dz + 0.2);
                self.put("saddle", ALONG, x + dx, 1.8, z + dz + 0.2);
                self.bolts(x + dx, 0.0, z + dz + 0.2, 0.62, 0.0);
            }
            for y in [1.2, 3.0] {
                self.put("vessel", ALONG, x + dx, y, z + 0.4);
                self.put("flange-m", UP, x + dx, y + 0.6, z + 2.0);
                self.put("gauge", RIGHT, x + dx + 0.3, y + 0.5, z + 3.2);
            }
            self.put_pipe("spool-m", bay % SERVICES, UP, x + dx, 3.6, z + 2.0);
            let bend = BEND * RADII_M[1];
            self.put_pipe("elbow-m", bay % SERVICES, UP_LEFT, x + dx, 5.6, z + 2.0);
            for k in 0..=usize::from(dx > 6.0) {
                let from = x + dx - bend - 2.0 * k as f32;
                self.put_pipe("spool-m", bay % SERVICES, LEFT, from, 5.6 + bend, z + 2.0);
            }
        }
        self.put("sign", RIGHT, x + 8.22, 1.0, z + 1.8);
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
