//! Wheels, lamps, mirrors, seams and the other small parts of the car.

use super::body::{self, AXLES, TYRE};
use crate::mesh_builder::{MeshBuilder, rounded, smooth, turned};
use crate::row::Row;
use crate::scene_builder::SceneBuilder;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

pub(super) fn wheels(scene: &mut SceneBuilder) {
    let [tyre, rim, disc, caliper] =
        ["tyre", "rim", "brake-disc", "caliper"].map(|name| scene.numbers(name)[0]);
    for (i, x) in AXLES.into_iter().enumerate() {
        for side in [-1.0f32, 1.0] {
            let outward = Quat::from_rotation_x(side * FRAC_PI_2);
            let steer = if i == 0 {
                Quat::from_rotation_y(-0.16)
            } else {
                Quat::IDENTITY
            };
            let z = side * (if i == 0 { 0.75 } else { 0.78 });
            let spin = Quat::from_rotation_y(0.3 + i as f32 + side);
            let place = |q: Quat| {
                Affine3A::from_rotation_translation(steer * outward * q, vec3(x, TYRE, z))
            };
            scene.place(tyre, place(spin));
            scene.place(rim, place(spin));
            scene.place(disc, place(Quat::IDENTITY));
            scene.place(
                caliper,
                place(Quat::from_rotation_y(if i == 0 { PI } else { 0.0 })),
            );
        }
    }
}

/// The spokes of a rim and its nuts.
pub(super) fn spokes(rim: &mut MeshBuilder) {
    for i in 0..10 {
        let pair = if i % 2 == 0 { 0.115 } else { -0.115 };
        let angle = TAU * (i / 2) as f32 / 5.0;
        rim.merge(&spoke(angle, pair), Affine3A::IDENTITY);
        if i % 2 == 0 {
            let (sin, cos) = (angle + PI / 5.0).sin_cos();
            rim.merge(
                &wheel_nut(),
                Affine3A::from_translation(vec3(0.044 * cos, 0.07, -0.044 * sin)),
            );
        }
    }
}

/// A spoke that leans from `angle` towards `angle + pair`, dished outwards.
fn spoke(angle: f32, pair: f32) -> MeshBuilder {
    let mut spoke = MeshBuilder::new();
    spoke.surface(10, 7, |s, t| {
        let r = 0.04 + 0.178 * t;
        let lean = angle + pair * (0.35 + 0.65 * t);
        let (sin, cos) = (TAU * (s - s.floor())).sin_cos();
        let (width, depth) = (0.0165 - 0.003 * t, 0.018 + 0.004 * t);
        let box_like = |c: f32| c.signum() * c.abs().powf(0.6);
        let out = vec3(lean.cos(), 0.0, -lean.sin());
        let side = vec3(-lean.sin(), 0.0, -lean.cos());
        let y = 0.062 + 0.022 * t * t;
        let p =
            out * r + side * (width * box_like(cos)) + Vec3::Y * (y + depth * box_like(sin) * 0.8);
        (p, vec2(s * 0.1, t * 0.2))
    });
    spoke.orient(|p| {
        let r = vec2(p.x, p.z).length();
        let t = ((r - 0.04) / 0.178).clamp(0.0, 1.0);
        Vec3::Y * (p.y - 0.062 - 0.022 * t * t)
    });
    spoke
}

fn wheel_nut() -> MeshBuilder {
    rounded("0.0085,0! 0.0085,0.01! 0.006,0.016 0,0.018", 2, 8)
}

pub(super) fn caliper(caliper: &mut MeshBuilder) {
    caliper.surface(8, 10, |s, t| {
        let a = 0.9 * (t - 0.5);
        let (sin, cos) = (TAU * (s - s.floor())).sin_cos();
        let out = vec3(a.cos(), 0.0, -a.sin());
        (
            out * (0.15 + 0.035 * cos) + Vec3::Y * (0.012 + 0.034 * sin),
            vec2(s, t) * 0.1,
        )
    });
    caliper.orient(|p| {
        let out = vec3(p.x, 0.0, p.z).normalize_or_zero();
        p - out * 0.15 - Vec3::Y * 0.012
    });
}

/// A strip along the points (x, t) of a row that follows the body, on one side.
pub(super) fn seam(m: &mut MeshBuilder, row: &mut Row) {
    let points: Vec<[f32; 2]> = row.points().collect();
    let side = match row.word() {
        "left" => -1.0,
        _ => 1.0,
    };
    let on_body = |x: f32, t: f32| (body::body(x, t), 0.0035);
    let points: Vec<[f32; 2]> = points.iter().map(|[x, t]| [*x, t * side]).collect();
    let line: Vec<(Vec3, f32)> = points
        .windows(2)
        .flat_map(|w| (0..6).map(move |k| (w[0], w[1], k as f32 / 6.0)))
        .map(|(a, b, f)| on_body(a[0] + (b[0] - a[0]) * f, a[1] + (b[1] - a[1]) * f))
        .chain(points.last().map(|[x, t]| on_body(*x, *t)))
        .collect();
    let mut strip = MeshBuilder::new();
    strip.tube(&line, 5);
    m.merge(&strip, Affine3A::IDENTITY);
}

/// A ball of radius 1 about the origin.
fn ball(cells: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let profile: Vec<_> = (0..=cells)
        .map(|i| {
            let (sin, cos) = (PI * (i as f32 / cells as f32 - 0.5)).sin_cos();
            smooth(if i % cells == 0 { 0.0 } else { cos }, sin)
        })
        .collect();
    m.lathe(&profile, 2 * cells);
    m
}

/// Meshes of the small parts, by material.
#[derive(Default)]
struct Details {
    chrome: MeshBuilder,
    lamps: MeshBuilder,
    tails: MeshBuilder,
    dark: MeshBuilder,
    paint: MeshBuilder,
}

pub(super) fn details(scene: &mut SceneBuilder) {
    let mut details = Details::default();
    for side in [-1.0f32, 1.0] {
        details.headlamp(side);
        details.tail_lamps(side);
        details.mirror(side);
        details.door_handle(side);
        details.exhausts(side);
        details.intake(side);
        details.wiper(side);
    }
    details.spoiler_plate_and_badge();
    scene.add("chrome", details.chrome, "chrome");
    scene.add("headlamps", details.lamps, "headlamp");
    scene.add("tail-lamps", details.tails, "tail-lamp");
    scene.add("intakes", details.dark, "trim");
    scene.add("mirrors-and-wing", details.paint, "paint");
}

impl Details {
    /// A lens over two reflectors.
    fn headlamp(&mut self, side: f32) {
        let at = body::body(1.86, side * 0.50);
        let tilt = Quat::from_rotation_y(-side * 0.45) * Quat::from_rotation_z(-0.55);
        self.lamps.merge(
            &ball(16),
            Affine3A::from_scale_rotation_translation(
                vec3(0.15, 0.052, 0.105),
                tilt,
                at - Vec3::Y * 0.004,
            ),
        );
        for k in [-1.0f32, 1.0] {
            let bowl = rounded(
                "0,0! 0.022,0.006 0.036,0.026 0.038,0.03! 0.034,0.028! 0.02,0.011 0,0.005",
                2,
                18,
            );
            let forward = tilt * Quat::from_rotation_z(-0.9);
            self.chrome.merge(
                &bowl,
                Affine3A::from_rotation_translation(
                    forward,
                    at + tilt * vec3(0.045 * k, -0.02, 0.03 * k * side),
                ),
            );
        }
    }

    /// Two round lamps per side.
    fn tail_lamps(&mut self, side: f32) {
        for k in 0..2 {
            let z = side * (0.40 + 0.18 * k as f32);
            let back = Quat::from_rotation_z(FRAC_PI_2);
            self.tails.merge(
                &ball(12),
                Affine3A::from_scale_rotation_translation(
                    vec3(0.062, 0.03, 0.062),
                    back,
                    vec3(-2.205 + 0.02 * k as f32, 0.70, z),
                ),
            );
            self.chrome.ring([32, 8], 0.006, |sin, cos| {
                vec3(
                    -2.208 + 0.02 * k as f32,
                    0.70 + 0.067 * sin,
                    z + 0.067 * cos,
                )
            });
        }
    }

    fn mirror(&mut self, side: f32) {
        let foot = body::body(0.62, side * 0.48);
        let head = foot + vec3(-0.02, 0.10, side * 0.13);
        self.paint.tube(
            &[
                (foot - Vec3::Y * 0.01, 0.016),
                (foot.lerp(head, 0.5) + Vec3::Y * 0.01, 0.013),
                (head, 0.014),
            ],
            10,
        );
        self.paint.merge(
            &ball(14),
            Affine3A::from_scale_rotation_translation(
                vec3(0.055, 0.058, 0.095),
                Quat::IDENTITY,
                head + vec3(0.0, 0.03, side * 0.03),
            ),
        );
        let mut face = turned("0,0 1,0", 24);
        face.orient(|_| Vec3::Y);
        self.chrome.merge(
            &face,
            Affine3A::from_scale_rotation_translation(
                vec3(0.046, 1.0, 0.082),
                Quat::from_rotation_z(FRAC_PI_2),
                head + vec3(-0.057, 0.03, side * 0.03),
            ),
        );
    }

    fn door_handle(&mut self, side: f32) {
        let middle = body::body(-0.34, side * 0.62);
        self.chrome.tube(
            &[
                (middle + vec3(-0.07, 0.0, side * 0.004), 0.009),
                (middle + vec3(0.0, 0.002, side * 0.028), 0.008),
                (middle + vec3(0.07, 0.0, side * 0.006), 0.009),
            ],
            10,
        );
    }

    fn exhausts(&mut self, side: f32) {
        for k in 0..2 {
            let z = side * (0.28 + 0.095 * k as f32);
            let pipe = turned("0.036,0! 0.04,0.01! 0.04,0.22! 0.036,0.22! 0.036,0!", 24);
            self.chrome.merge(
                &pipe,
                Affine3A::from_rotation_translation(
                    Quat::from_rotation_z(-FRAC_PI_2),
                    vec3(-2.21, 0.33, z),
                ),
            );
        }
    }

    /// The slats of a front intake.
    fn intake(&mut self, side: f32) {
        for k in 0..5 {
            let y = 0.30 + 0.03 * k as f32;
            let x = 2.165 - 0.012 * k as f32;
            self.dark.tube(
                &[
                    (vec3(x, y, side * 0.08), 0.007),
                    (vec3(x - 0.02, y, side * 0.30), 0.007),
                    (vec3(x - 0.16, y, side * 0.56), 0.006),
                ],
                6,
            );
        }
    }

    fn wiper(&mut self, side: f32) {
        let (a, b) = (
            body::cabin(0.03, 0.3 * side + 0.22),
            body::cabin(0.085, 0.3 * side - 0.22),
        );
        self.dark.tube(
            &[
                (a + Vec3::Y * 0.01, 0.006),
                (a.lerp(b, 0.5) + vec3(0.01, 0.015, 0.0), 0.005),
                (b + vec3(0.006, 0.01, 0.0), 0.004),
            ],
            6,
        );
    }

    fn spoiler_plate_and_badge(&mut self) {
        let wing: Vec<(Vec3, f32)> = (0..=24)
            .map(|i| {
                let t = i as f32 / 12.0 - 1.0;
                (
                    vec3(-1.98 + 0.10 * t * t, 0.985 - 0.05 * t.powi(4), 0.72 * t),
                    0.018,
                )
            })
            .collect();
        self.paint.tube(&wing, 10);
        self.dark
            .block(vec3(-2.235, 0.50, -0.26), vec3(-2.20, 0.61, 0.26), 0.004);
        self.chrome.merge(
            &ball(10),
            Affine3A::from_scale_rotation_translation(
                vec3(0.03, 0.008, 0.03),
                Quat::from_rotation_z(-0.5),
                body::body(2.1, 0.0),
            ),
        );
    }
}
