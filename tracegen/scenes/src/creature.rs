//! A tyrannosaur: ovals swept along the centre lines of body, neck, tail, legs and arms.

use super::mesh_builder::{MeshBuilder, curve, lathed, rounded, sharp, smooth};
use super::noise::{bank, smoothstep};
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// The parts, each with its own material.
#[derive(Default)]
pub struct Creature {
    /// Body.
    pub hide: MeshBuilder,
    /// Teeth and claws.
    pub teeth: MeshBuilder,
    /// Eyes.
    pub eyes: MeshBuilder,
}

/// A ring of a swept oval: centre, half width (across), half height (in the plane of the sweep).
#[derive(Clone, Copy, Debug)]
struct Ring {
    at: Vec3,
    width: f32,
    height: f32,
}

fn ring(x: f32, y: f32, z: f32, width: f32, height: f32) -> Ring {
    Ring {
        at: vec3(x, y, z),
        width,
        height,
    }
}

fn catmull(rings: &[Ring], t: f32) -> Ring {
    let last = rings.len() - 1;
    let x = t.clamp(0.0, 1.0) * last as f32;
    let i = (x as usize).min(last - 1);
    let f = x - i as f32;
    let at = |k: usize| rings[k.min(last)];
    let (a, b, c, d) = (at(i.saturating_sub(1)), at(i), at(i + 1), at(i + 2));
    let weights = [
        0.5 * (-f + 2.0 * f * f - f * f * f),
        0.5 * (2.0 - 5.0 * f * f + 3.0 * f * f * f),
        0.5 * (f + 4.0 * f * f - 3.0 * f * f * f),
        0.5 * (-f * f + f * f * f),
    ];
    let [wa, wb, wc, wd] = weights;
    Ring {
        at: a.at * wa + b.at * wb + c.at * wc + d.at * wd,
        width: (a.width * wa + b.width * wb + c.width * wc + d.width * wd).max(0.0),
        height: (a.height * wa + b.height * wb + c.height * wc + d.height * wd).max(0.0),
    }
}

/// Sweeps ovals through the rings, closed at both ends; `swell(around, along)` scales the skin.
fn limb(rings: &[Ring], cells: [usize; 2], swell: impl Fn(f32, f32) -> f32) -> MeshBuilder {
    let length: f32 = rings.windows(2).map(|w| w[0].at.distance(w[1].at)).sum();
    let girth = rings.iter().map(|r| r.width + r.height).fold(0.0, f32::max) * 3.1;
    let mut m = MeshBuilder::new();
    m.surface(cells[0], cells[1], |s, t| {
        let here = catmull(rings, t);
        let along =
            (catmull(rings, t + 0.01).at - catmull(rings, t - 0.01).at).normalize_or(Vec3::X);
        // `across` stays level. The oval's other axis is perpendicular to it and to the sweep.
        let across = along.cross(Vec3::Y).normalize_or(Vec3::Z);
        let up = across.cross(along);
        let (sin, cos) = (TAU * (s - s.floor())).sin_cos();
        let caps = (1.0 - (2.0 * t - 1.0).abs().powi(24)).max(0.0).sqrt();
        let k = caps * swell(s - s.floor(), t);
        let p = here.at + across * (here.width * k * cos) + up * (here.height * k * sin);
        (p, vec2(s * girth, -t * length))
    });
    let middle: Vec<Vec3> = (0..=32)
        .map(|i| catmull(rings, i as f32 / 32.0).at)
        .collect();
    m.orient(|p| {
        let nearest = middle
            .iter()
            .min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p)));
        nearest.map_or(Vec3::Y, |c| p - *c)
    });
    m
}

fn cone(m: &mut MeshBuilder, at: Vec3, direction: Vec3, radius: f32, length: f32) {
    let one = lathed(
        &curve(
            &[
                sharp(radius, 0.0),
                smooth(radius * 0.75, length * 0.5),
                smooth(0.0, length),
            ],
            2,
        ),
        7,
    );
    m.merge(
        &one,
        Affine3A::from_rotation_translation(
            Quat::from_rotation_arc(Vec3::Y, direction.normalize()),
            at,
        ),
    );
}

/// The animal, 3.6 m tall at the head and 8 m long, standing at the origin, facing +x.
pub fn tyrannosaur() -> Creature {
    let mut animal = Creature::default();
    animal.torso();
    animal.head();
    for side in [-1.0f32, 1.0] {
        animal.teeth_and_eye(side);
        animal.hind_leg(side);
        animal.arm(side);
    }
    animal
}

/// Folds of the skin.
fn wrinkles(s: f32, t: f32) -> f32 {
    1.0 + 0.05 * (bank().mottle.smooth(s, 3.0 * t) - 0.5)
}

impl Creature {
    /// Tail, trunk and neck.
    fn torso(&mut self) {
        let body = [
            ring(-4.6, 2.15, 0.55, 0.03, 0.03),
            ring(-3.6, 2.02, 0.42, 0.13, 0.15),
            ring(-2.6, 2.05, 0.18, 0.22, 0.27),
            ring(-1.5, 2.18, 0.0, 0.36, 0.45),
            ring(-0.5, 2.28, 0.0, 0.52, 0.66),
            ring(0.5, 2.30, 0.0, 0.58, 0.70),
            ring(1.3, 2.48, 0.0, 0.52, 0.62),
            ring(1.85, 2.82, 0.02, 0.36, 0.46),
            ring(2.15, 3.18, 0.06, 0.28, 0.38),
            ring(2.42, 3.42, 0.08, 0.27, 0.34),
            ring(2.75, 3.48, 0.10, 0.22, 0.24),
        ];
        let spines = |s: f32, t: f32| {
            // The back is at s = 1/4: a row of scutes.
            let ridge = smoothstep(0.05, 0.0, (s - 0.25).abs()) * (0.5 + 0.5 * (t * 230.0).sin());
            wrinkles(s, t) + 0.07 * ridge
        };
        self.hide
            .merge(&limb(&body, [28, 84], spines), Affine3A::IDENTITY);
    }

    /// Skull and upper jaw, and the open lower jaw.
    fn head(&mut self) {
        let skull = [
            ring(2.30, 3.46, 0.08, 0.24, 0.28),
            ring(2.62, 3.56, 0.10, 0.30, 0.31),
            ring(2.92, 3.56, 0.11, 0.27, 0.26),
            ring(3.22, 3.48, 0.12, 0.20, 0.20),
            ring(3.52, 3.42, 0.13, 0.17, 0.17),
            ring(3.74, 3.36, 0.14, 0.12, 0.12),
        ];
        self.hide.merge(
            &limb(&skull, [22, 26], |s, t| {
                let brow = (-((t - 0.38) / 0.09).powi(2)).exp()
                    * smoothstep(0.09, 0.0, ((s - 0.25).abs() - 0.13).abs());
                wrinkles(s, t) + 0.22 * brow
            }),
            Affine3A::IDENTITY,
        );
        let jaw = [
            ring(2.42, 3.22, 0.08, 0.20, 0.14),
            ring(2.75, 3.12, 0.10, 0.21, 0.12),
            ring(3.10, 3.00, 0.12, 0.17, 0.09),
            ring(3.40, 2.94, 0.13, 0.13, 0.075),
            ring(3.58, 2.92, 0.14, 0.08, 0.055),
        ];
        self.hide
            .merge(&limb(&jaw, [16, 18], wrinkles), Affine3A::IDENTITY);
    }

    fn teeth_and_eye(&mut self, side: f32) {
        for i in 0..9 {
            let t = i as f32 / 8.0;
            let x = 2.95 + 0.72 * t;
            let z = 0.115 + side * (0.20 - 0.09 * t);
            let size = 0.10 + 0.04 * ((i * 5 % 3) as f32);
            cone(
                &mut self.teeth,
                vec3(x, 3.36 - 0.06 * t, z),
                vec3(0.1, -1.0, 0.0),
                0.024,
                size,
            );
            cone(
                &mut self.teeth,
                vec3(x - 0.16, 3.09 - 0.13 * t, z - side * 0.02),
                vec3(0.15, 1.0, 0.0),
                0.020,
                size * 0.75,
            );
        }
        let ball = rounded("0,-0.055 0.055,0 0,0.055", 4, 12);
        self.eyes.merge(
            &ball,
            Affine3A::from_translation(vec3(2.80, 3.64, 0.105 + side * 0.245)),
        );
    }

    /// Thigh, shank and foot. The far leg is in mid-stride.
    fn hind_leg(&mut self, side: f32) {
        let step = if side > 0.0 { 0.35 } else { -0.45 };
        let leg = [
            ring(-0.05, 2.25, side * 0.40, 0.26, 0.42),
            ring(0.12 + 0.3 * step, 1.85, side * 0.52, 0.29, 0.42),
            ring(0.32 + 0.6 * step, 1.38, side * 0.55, 0.20, 0.27),
            ring(0.05 + 0.8 * step, 0.98, side * 0.54, 0.14, 0.17),
            ring(-0.26 + step, 0.62, side * 0.53, 0.10, 0.12),
            ring(-0.12 + step, 0.30, side * 0.53, 0.10, 0.11),
            ring(0.05 + step, 0.10, side * 0.53, 0.13, 0.11),
        ];
        self.hide
            .merge(&limb(&leg, [16, 30], wrinkles), Affine3A::IDENTITY);
        for toe in -1..=1 {
            let spread = toe as f32 * 0.34;
            let (dx, dz) = (spread.cos(), spread.sin());
            let root = vec3(0.0 + step, 0.12, side * 0.53);
            let tip = root + vec3(0.46 * dx, -0.07, 0.46 * dz);
            let mid = root.lerp(tip, 0.55) + Vec3::Y * 0.03;
            let toe = [
                Ring {
                    at: root,
                    width: 0.085,
                    height: 0.09,
                },
                Ring {
                    at: mid,
                    width: 0.065,
                    height: 0.065,
                },
                Ring {
                    at: tip,
                    width: 0.045,
                    height: 0.045,
                },
            ];
            self.hide
                .merge(&limb(&toe, [10, 8], wrinkles), Affine3A::IDENTITY);
            cone(
                &mut self.teeth,
                tip - vec3(0.03 * dx, 0.0, 0.03 * dz),
                vec3(dx, -0.25, dz),
                0.036,
                0.14,
            );
        }
    }

    fn arm(&mut self, side: f32) {
        let arm = [
            ring(1.45, 2.22, side * 0.36, 0.11, 0.13),
            ring(1.55, 1.98, side * 0.44, 0.085, 0.10),
            ring(1.72, 1.82, side * 0.44, 0.06, 0.065),
            ring(1.95, 1.84, side * 0.40, 0.05, 0.05),
            ring(2.05, 1.80, side * 0.39, 0.04, 0.035),
        ];
        self.hide
            .merge(&limb(&arm, [10, 16], wrinkles), Affine3A::IDENTITY);
        for z in [-0.025f32, 0.025] {
            cone(
                &mut self.teeth,
                vec3(2.04, 1.79, side * 0.39 + z),
                vec3(0.7, -0.7, z * 4.0),
                0.018,
                0.11,
            );
        }
    }
}
