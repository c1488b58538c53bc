//! Moving parts: cranes, carts and fans.

use super::parts::{BAY_M, NAVE_M};
use super::{ALONG, Layout, RAIL_M, RIGHT};
use glam::{Vec3, vec3};
use scene::Movement;

impl Layout {
    /// A crane that travels the nave, its trolley and its hook.
    pub(super) fn crane(&mut self, x: f32, z0: f32, bays: usize, seed: usize) {
        let run = (bays as f32 * BAY_M - 12.0).min(60.0);
        // Near the end at which the cameras are.
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
                "crane-girder",
                ALONG,
                vec3(middle, rail + 0.1, z + dz),
            );
        }
        for side in [0.75, NAVE_M - 0.75] {
            self.put_moving(
                bridge,
                "crane-end-truck",
                ALONG,
                vec3(x + side, rail + 0.1, z),
            );
        }
        let trolley = self.motion(vec![travel, across]);
        let at = vec3(x + 10.3, rail + 1.06, z);
        self.put_moving(trolley, "crane-trolley", ALONG, at);
        // The ropes' upper ends stay inside the trolley's drum.
        let load = self.motion(vec![travel, across, hoist]);
        self.put_moving(load, "crane-rope", ALONG, at - Vec3::Y * 2.7);
        self.put_moving(load, "crane-hook", ALONG, at - Vec3::Y * 3.6);
    }

    /// A cart that drives along the aisle with a crate.
    pub(super) fn cart(&mut self, x: f32, z0: f32, bays: usize, nave: usize) {
        let end = z0 + bays as f32 * BAY_M;
        let z = end - 14.0 - 4.0 * nave as f32;
        let drive = Movement::Shuttle {
            by: Vec3::Z * -30.0,
            period_s: 50.0,
            phase: 0.08,
        };
        let motion = self.motion(vec![drive]);
        self.put_moving(motion, "cart", ALONG, vec3(x, 0.0, z));
        self.put_moving(motion, "pallet", RIGHT, vec3(x, 0.35, z));
        self.put_moving(motion, "crate", RIGHT, vec3(x, 0.494, z));
        for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let at = vec3(x + 0.4 * sx, 0.14, z + 0.5 * sz);
            self.put_moving(motion, "cart-wheel", ALONG, at);
        }
    }

    /// A fan in the end wall.
    pub(super) fn fan(&mut self, x: f32, z: f32, phase: f32) {
        let at = vec3(x, 9.0, z);
        self.put("fan-ring", ALONG, at.x, at.y, at.z);
        let turning = self.motion(vec![Movement::Turn {
            pivot: at,
            axis: Vec3::Z,
            turns_per_s: 1.3 + 0.2 * phase,
        }]);
        self.put_moving(turning, "fan-blades", ALONG, at);
    }
}
