//! Parts of every bay: walls, roof, lamps, cable trays and walkways.

use super::parts::{BAY_M, NAVE_M, ROOF_M};
use super::{ALONG, AROUND, Layout, RAIL_M};
use glam::Mat3;

impl Layout {
    /// 6 m of wall: cladding, a band of windows, cladding, windows, cladding to the roof.
    pub(super) fn side_wall(&mut self, x: f32, z: f32, turn: Mat3) {
        self.put("wall", turn, x, 0.0, z);
        self.put("window", turn, x, 5.0, z);
        self.put("wall", turn, x, 6.5, z);
        self.put("window", turn, x, 11.5, z);
    }

    pub(super) fn building(&mut self, x: f32, z: f32) {
        for k in 0..4 {
            let left = x + BAY_M * k as f32;
            self.put("floor-slab", ALONG, left, 0.0, z);
            self.put("roof-deck", ALONG, left, ROOF_M, z);
            self.put("sky-light", ALONG, left + 2.1, ROOF_M, z);
        }
        for lane in [10.0, 13.0] {
            self.put("lane", ALONG, x + lane, 0.006, z);
        }
        self.columns(x, z);
        self.put("truss", ALONG, x + NAVE_M / 2.0, ROOF_M - 1.9, z);
        for k in 0..8 {
            self.put("purlin", ALONG, x + 1.5 + 3.0 * k as f32, ROOF_M - 0.21, z);
        }
        for (side, turn) in [(0.2, ALONG), (NAVE_M - 0.2, AROUND)] {
            self.put("bracket", turn, x + side, RAIL_M - 0.75, z);
        }
        for side in [0.75, NAVE_M - 0.75] {
            self.put("runway", ALONG, x + side, RAIL_M - 0.33, z);
        }
    }

    pub(super) fn columns(&mut self, x: f32, z: f32) {
        self.put("column", ALONG, x, 0.0, z);
        self.bolts(x, 0.03, z, 0.28, 0.28);
    }

    /// Lamps, sprinklers and a ventilation duct.
    pub(super) fn overhead(&mut self, x: f32, z: f32) {
        for lamp in [6.0, 11.5, 17.0] {
            self.put("lamp-shade", ALONG, x + lamp, 10.05, z);
            self.put("lamp", ALONG, x + lamp, 10.05, z);
        }
        for main in [4.0, 19.0] {
            self.put("pipe-s-fire", ALONG, x + main, 11.05, z);
            for k in 0..3 {
                self.put(
                    "sprinkler",
                    ALONG,
                    x + main,
                    11.01,
                    z + 1.0 + 2.0 * k as f32,
                );
            }
        }
        self.put("duct", ALONG, x + 22.4, 6.6, z);
        self.put("diffuser", ALONG, x + 22.4, 6.6, z + 3.0);
    }

    /// Three trays with cables along the nave's other side, on stands that also carry the duct.
    pub(super) fn cable_trays(&mut self, x: f32, z: f32) {
        let x = x + 22.4;
        for k in 0..2 {
            self.put("stand", ALONG, x, 4.4, z + 0.5 + 3.0 * k as f32);
        }
        for level in 0..3 {
            let y = 4.4 + 0.55 * level as f32;
            self.put("tray", ALONG, x, y, z);
            for k in 0..6 {
                let kind = (k * 5 + level * 2) % 3;
                let across = x - 0.22 + 0.085 * k as f32;
                self.put_mesh(self.cables[kind], ALONG, across, y + 0.018, z);
            }
        }
    }

    /// A mezzanine along the nave, with stairs in every eighth bay.
    pub(super) fn walkway(&mut self, x: f32, z: f32, bay: usize) {
        let (x, y) = (x + 20.2, 3.5);
        let stairs = bay % 8 == 3;
        for k in 0..3 {
            let along = z + 2.0 * k as f32;
            self.put("grating", ALONG, x, y, along);
            for side in [-0.65, 0.65] {
                self.put("stringer", ALONG, x + side, y, along);
                if !(stairs && side < 0.0 && k == 2) {
                    self.put("railing", ALONG, x + side, y, along);
                }
            }
        }
        for side in [-0.65, 0.65] {
            self.put("leg", ALONG, x + side, 0.0, z + 0.15);
        }
        if stairs {
            // Up along the walkway's side, to the gap in its railing.
            self.put("stairs", ALONG, x - 1.25, 0.0, z + 0.4);
        }
    }
}
