//! Clockwork: spur gears whose teeth mesh, worms, screws.

use super::mesh_builder::{MeshBuilder, lathed, sharp, smooth};
use glam::{Affine3A, Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{PI, TAU};

/// Points along a tooth's flank.
const FLANK: usize = 6;

/// A spur gear in the plane of x and y, its axle along z.
#[derive(Clone, Copy, Debug)]
pub struct Gear {
    /// Number of teeth.
    pub teeth: u32,
    /// Module: pitch diameter per tooth, metres. Gears of equal module mesh.
    pub module: f32,
    /// Thickness along z, metres.
    pub thickness: f32,
    /// Radius of the bore, metres.
    pub bore: f32,
    /// Spokes; 0 for a solid disc.
    pub spokes: u32,
}

impl Gear {
    /// Radius of the pitch circle, on which gears roll on one another.
    pub fn pitch_radius(&self) -> f32 {
        0.5 * self.module * self.teeth as f32
    }

    /// The rotation with which this gear meshes with a driver rotated by `driver_turn`, if it is at
    /// `direction` (an angle) from the driver: its gap meets the driver's tooth.
    pub fn mesh_turn(&self, driver: &Self, driver_turn: f32, direction: f32) -> f32 {
        let phase = (direction - driver_turn) * driver.teeth as f32 / TAU;
        direction + PI - (0.5 - phase) * TAU / self.teeth as f32
    }

    /// Outline of one tooth centred on angle 0: root, involute flank, tip, flank.
    fn outline(&self) -> Vec<Vec2> {
        let pitch = self.pitch_radius();
        let (root, tip) = (pitch - 1.2 * self.module, pitch + 0.98 * self.module);
        let base = pitch * 20f32.to_radians().cos();
        let involute = |r: f32| {
            let a = (base / r.max(base)).acos();
            a.tan() - a
        };
        // Half the tooth's angle at radius r: a quarter of the pitch at the pitch circle, minus
        // clearance.
        let half = |r: f32| 0.94 * PI / (2.0 * self.teeth as f32) + involute(pitch) - involute(r);
        let low = root.max(base);
        let mut points = Vec::new();
        for i in 0..self.teeth {
            let center = TAU * i as f32 / self.teeth as f32;
            let polar = |r: f32, a: f32| Vec2::from_angle(center + a) * r;
            points.push(polar(root, -half(low) * 1.12));
            for k in 0..FLANK {
                let r = low + (tip - low) * k as f32 / (FLANK - 1) as f32;
                points.push(polar(r, -half(r)));
            }
            for k in (0..FLANK).rev() {
                let r = low + (tip - low) * k as f32 / (FLANK - 1) as f32;
                points.push(polar(r, half(r)));
            }
            points.push(polar(root, half(low) * 1.12));
        }
        points
    }

    /// The gear, centred on the origin.
    pub fn build(&self) -> MeshBuilder {
        let mut m = MeshBuilder::new();
        let outline = self.outline();
        let half = 0.5 * self.thickness;
        let chamfer = 0.12 * self.thickness;
        let rim = (self.pitch_radius() - 3.0 * self.module).max(self.bore * 1.5);
        let n = outline.len();
        let inner = |p: Vec2| {
            if self.spokes > 0 {
                p.normalize() * rim
            } else {
                p.normalize() * self.bore
            }
        };
        for i in 0..n {
            let (a, b) = (outline[i], outline[(i + 1) % n]);
            let normal = vec2(b.y - a.y, a.x - b.x).normalize_or_zero();
            let (ca, cb) = (a - a.normalize() * chamfer, b - b.normalize() * chamfer);
            wall(&mut m, a, b, -half + chamfer, half - chamfer, normal);
            for side in [-1.0f32, 1.0] {
                let (z0, z1) = (side * (half - chamfer), side * half);
                let slope = (normal.extend(0.0) + Vec3::Z * side).normalize_or(Vec3::Z);
                let face = Vec3::Z * side;
                strip(
                    &mut m,
                    [a.extend(z0), b.extend(z0), cb.extend(z1), ca.extend(z1)],
                    slope,
                );
                strip(
                    &mut m,
                    [
                        ca.extend(z1),
                        cb.extend(z1),
                        inner(b).extend(z1),
                        inner(a).extend(z1),
                    ],
                    face,
                );
            }
        }
        if self.spokes == 0 {
            ring_wall(&mut m, self.bore, half, 32, false);
            return m;
        }
        ring_wall(&mut m, rim, half, 72, false);
        let hub = (self.bore * 2.2).min(rim * 0.5);
        let boss = lathed(
            &[
                sharp(self.bore, -0.75 * self.thickness),
                sharp(hub * 0.92, -0.75 * self.thickness),
                sharp(hub, -0.65 * self.thickness),
                sharp(hub, 0.65 * self.thickness),
                sharp(hub * 0.92, 0.75 * self.thickness),
                sharp(self.bore, 0.75 * self.thickness),
                sharp(self.bore, -0.75 * self.thickness),
            ],
            32,
        );
        m.merge(
            &boss,
            Affine3A::from_rotation_x(std::f32::consts::FRAC_PI_2),
        );
        for i in 0..self.spokes {
            let mut spoke = MeshBuilder::new();
            let width = 0.16 * rim;
            spoke.block(
                vec3(hub * 0.9, -0.5 * width, -0.36 * self.thickness),
                vec3(rim * 1.02, 0.5 * width, 0.36 * self.thickness),
                0.12 * self.thickness,
            );
            m.merge(
                &spoke,
                Affine3A::from_rotation_z(TAU * i as f32 / self.spokes as f32),
            );
        }
        m
    }
}

fn strip(m: &mut MeshBuilder, corners: [Vec3; 4], normal: Vec3) {
    let facing = (corners[1] - corners[0])
        .cross(corners[2] - corners[0])
        .dot(normal);
    let v = corners.map(|p| m.vertex(p, normal, vec2(p.x, -p.y)));
    let order = if facing > 0.0 {
        [0, 1, 2, 0, 2, 3]
    } else {
        [0, 2, 1, 0, 3, 2]
    };
    m.indices.extend(order.map(|i| v[i]));
}

fn wall(m: &mut MeshBuilder, a: Vec2, b: Vec2, low: f32, high: f32, normal: Vec2) {
    strip(
        m,
        [a.extend(low), b.extend(low), b.extend(high), a.extend(high)],
        normal.extend(0.0),
    );
}

/// A cylinder's wall about z, facing the axis.
fn ring_wall(m: &mut MeshBuilder, radius: f32, half: f32, segments: usize, outwards: bool) {
    let mut ring = lathed(&[sharp(radius, -half), sharp(radius, half)], segments);
    if !outwards {
        ring.flip();
    }
    m.merge(
        &ring,
        Affine3A::from_rotation_x(std::f32::consts::FRAC_PI_2),
    );
}

/// A screw with a slotted head, standing on y = 0.
pub fn screw(radius: f32) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let h = 0.55 * radius;
    m.lathe(
        &[
            sharp(radius, 0.0),
            sharp(radius, 0.55 * h),
            smooth(0.85 * radius, 0.85 * h),
            sharp(0.66 * radius, h),
        ],
        20,
    );
    // The head's top in two halves, with the slot sunk between.
    let (r, slot, deep) = (0.66 * radius, 0.13 * radius, 0.4 * h);
    let edge = (r * r - slot * slot).sqrt();
    for side in [-1.0f32, 1.0] {
        let mut top = MeshBuilder::new();
        top.surface(14, 1, |s, t| {
            let x = edge * (2.0 * s - 1.0);
            let z = side * (slot + t * ((r * r - x * x).max(0.0).sqrt() - slot));
            (vec3(x, h, z), vec2(x, z))
        });
        top.orient(|_| Vec3::Y);
        top.normals.fill(Vec3::Y);
        m.merge(&top, Affine3A::IDENTITY);
        let z = side * slot;
        strip(
            &mut m,
            [
                vec3(-edge, h, z),
                vec3(edge, h, z),
                vec3(edge, h - deep, z),
                vec3(-edge, h - deep, z),
            ],
            Vec3::Z * -side,
        );
    }
    strip(
        &mut m,
        [
            vec3(-edge, h - deep, -slot),
            vec3(-edge, h - deep, slot),
            vec3(edge, h - deep, slot),
            vec3(edge, h - deep, -slot),
        ],
        Vec3::Y,
    );
    m
}

/// A worm about the z axis: a thread of `turns` around a shaft.
pub fn worm(radius: f32, length: f32, turns: f32, steps_per_turn: usize) -> MeshBuilder {
    let steps = (turns * steps_per_turn as f32) as usize;
    let mut m = MeshBuilder::new();
    let points: Vec<(Vec3, f32)> = (0..=steps)
        .map(|i| {
            let t = i as f32 / steps as f32;
            let (sin, cos) = (TAU * turns * t).sin_cos();
            (
                vec3(radius * cos, radius * sin, length * (t - 0.5)),
                0.34 * length / turns,
            )
        })
        .collect();
    m.tube(&points, 8);
    ring_wall(&mut m, radius, 0.5 * length, 24, true);
    m
}

/// A gear placed at `center` in the plane whose normal is the rotated z axis.
pub fn placed(center: Vec3, facing: Quat, turn: f32) -> Affine3A {
    Affine3A::from_rotation_translation(facing * Quat::from_rotation_z(turn), center)
}
