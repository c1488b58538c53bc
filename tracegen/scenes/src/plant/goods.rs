//! Products and stores on the other side of the aisle.

use super::parts::{BAY_M, NAVE_M};
use super::{ALONG, LEFT, Layout, RIGHT};
use crate::noise::{Rng, hash};

impl Layout {
    /// Products and stores on the other side of the aisle.
    pub(super) fn east(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        let kind = |bay: usize| hash(nave as i32, bay as i32 / 4, 97) % 4;
        match kind(bay) {
            0 | 1 => self.pallet_racks(x, z, nave, bay, kind(bay + 1) > 1),
            2 => self.conveyors(x, z, nave, bay),
            _ => self.workshop(x, z, bay),
        }
        self.cabinet(x + 21.9, z + 2.0, LEFT, bay.is_multiple_of(2));
        if !bay.is_multiple_of(2) {
            self.put("sign", LEFT, x + 21.64, 1.2, z + 2.0);
        }
    }

    /// Shelves of pallets with their loads. The last bay of a row closes it.
    fn pallet_racks(&mut self, x: f32, z: f32, nave: usize, bay: usize, last: bool) {
        let mut rng = Rng::new(u64::from(hash(nave as i32, bay as i32, 5)));
        for rx in [x + 14.4, x + 17.2] {
            for k in 0..2 + usize::from(last) {
                self.put("rack-upright", ALONG, rx, 0.0, z + 0.15 + 3.0 * k as f32);
            }
            for k in 0..2 {
                let along = z + 0.2 + 3.0 * k as f32;
                for y in [1.2, 2.5, 3.8] {
                    self.put("shelf-beam", ALONG, rx - 0.5, y, along);
                    self.put("shelf-beam", ALONG, rx + 0.5, y, along);
                }
                for y in [0.0, 1.26, 2.56, 3.86] {
                    for j in 0..3 {
                        let pz = along + 0.5 + 0.95 * j as f32;
                        self.put("pallet", ALONG, rx, y, pz);
                        self.load(rx, y + 0.144, pz, &mut rng);
                    }
                }
            }
        }
    }

    /// Goods on a pallet: a crate, two drums, or cartons in layers.
    fn load(&mut self, x: f32, y: f32, z: f32, rng: &mut Rng) {
        match rng.below(4) {
            0 => self.put("crate", ALONG, x, y, z),
            1 => {
                for dx in [-0.3, 0.3] {
                    self.put("drum", ALONG, x + dx, y, z);
                }
            }
            2 => {
                for k in 0..6 {
                    let (dx, layer, dz) = (k % 2, k / 4, (k / 2) % 2);
                    let across = x - 0.29 + 0.58 * dx as f32;
                    let deep = z - 0.195 + 0.39 * dz as f32;
                    self.put("carton", ALONG, across, y + 0.36 * layer as f32, deep);
                }
            }
            _ => {}
        }
    }

    /// Roller conveyors with their loads, and a press between them.
    fn conveyors(&mut self, x: f32, z: f32, nave: usize, bay: usize) {
        let mut rng = Rng::new(u64::from(hash(nave as i32, bay as i32, 6)));
        for dx in [14.2, 17.9] {
            for k in 0..3 {
                let along = z + 2.0 * k as f32;
                self.put("conveyor", ALONG, x + dx, 0.0, along);
                for j in 0..16 {
                    let at = along + 0.0625 + 0.125 * j as f32;
                    self.put("roller", ALONG, x + dx, 0.735, at);
                }
                if rng.unit() < 0.7 {
                    let shift = rng.range(0.4, 1.6);
                    self.put("carton", ALONG, x + dx, 0.77, along + shift);
                }
            }
        }
        self.put("press", RIGHT, x + 16.2, 0.0, z + 3.0);
        self.bolts(x + 16.2, 0.0, z + 3.0, 0.7, 0.95);
        self.cabinet(x + 16.2, z + 5.2, RIGHT, true);
    }

    /// Benches, mills and small stock.
    fn workshop(&mut self, x: f32, z: f32, bay: usize) {
        self.mill(x + 16.9, z + 1.5, LEFT, bay);
        self.mill(x + 16.9, z + 4.5, LEFT, bay + 1);
        for dz in [1.6, 4.3] {
            self.put("bench", RIGHT, x + 14.2, 0.0, z + dz);
            for k in 0..4 {
                let at = z + dz - 0.75 + 0.5 * k as f32;
                self.put("bin", RIGHT, x + 14.2, 0.92, at);
            }
        }
        for k in 0..4 {
            let at = z + 0.6 + 1.4 * k as f32;
            self.put("drum", ALONG, x + 18.05, 0.0, at);
        }
    }

    /// Bins stacked in the hall's last bay until the requested number of instances is reached.
    pub(super) fn stores(&mut self, naves: usize, bays: usize, instances: usize) {
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
                    self.put("bin", ALONG, across, y, along);
                }
            }
        }
    }
}
