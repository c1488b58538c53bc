//! The plant's building, pipework, cables and walkways: small meshes that are placed many times.
//!
//! Long parts run along +z from their origin. Parts on the floor have their origin there.

use super::materials::{CABLES, PIPES};
use crate::mesh_builder::{MeshBuilder, lathed, sharp};
use crate::scene_builder::SceneBuilder;
use glam::{Affine3A, Vec3, vec3};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Length of a bay, of pipes and of other continuous parts, metres.
pub(super) const BAY_M: f32 = 6.0;
/// Width of a nave, metres.
pub(super) const NAVE_M: f32 = 24.0;
/// Height of the underside of the roof, metres.
pub(super) const ROOF_M: f32 = 13.0;
/// Radii of pipes, metres.
pub(super) const RADII_M: [f32; 3] = [0.045, 0.09, 0.19];
/// Radius of a bend's centre line in radii of its pipe.
pub(super) const BEND: f32 = 3.0;
/// Sides and names of pipes by size.
const SIDES: [usize; 3] = [6, 8, 12];
pub(super) const SIZES: [&str; 3] = ["s", "m", "l"];

fn straight_pipe(radius: f32, length: f32, sides: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    m.rod(Vec3::ZERO, Vec3::Z * length, radius, sides);
    m
}

/// From the origin along +z, bent to +y.
fn bent_pipe(radius: f32, sides: usize) -> MeshBuilder {
    let bend = BEND * radius;
    let mut m = MeshBuilder::new();
    let points: Vec<(Vec3, f32)> = (0..=5)
        .map(|i| {
            let (sin, cos) = (FRAC_PI_2 * i as f32 / 5.0).sin_cos();
            (vec3(0.0, bend * (1.0 - cos), bend * sin), radius)
        })
        .collect();
    m.tube(&points, sides);
    m
}

/// A disc about the z axis: the joint of two pipes, or the closed end of one.
fn flange(radius: f32, sides: usize) -> MeshBuilder {
    let (r, h) = (1.55 * radius, 0.22 * radius + 0.012);
    let mut m = MeshBuilder::new();
    let disc = lathed(
        &[sharp(0.0, -h), sharp(r, -h), sharp(r, h), sharp(0.0, h)],
        sides,
    );
    m.merge(&disc, Affine3A::from_rotation_x(FRAC_PI_2));
    m
}

/// A roof girder across a nave, its lower chord at the origin's height.
pub(super) fn truss(m: &mut MeshBuilder) {
    let (depth, panels) = (1.5, 8);
    let half = NAVE_M / 2.0;
    m.block(vec3(-half, 0.0, -0.09), vec3(half, 0.18, 0.09), 0.0);
    m.block(
        vec3(-half, depth, -0.09),
        vec3(half, depth + 0.18, 0.09),
        0.0,
    );
    let step = NAVE_M / panels as f32;
    for i in 0..panels {
        let x = -half + step * i as f32;
        let (low, high) = (0.17, depth + 0.01);
        let (a, b) = if i < panels / 2 {
            (low, high)
        } else {
            (high, low)
        };
        m.bar(vec3(x, b, 0.0), vec3(x + step, a, 0.0), 0.1);
        m.bar(
            vec3(x + step * 0.999, low, 0.0),
            vec3(x + step * 0.999, high, 0.0),
            0.08,
        );
    }
}

/// Stairs up +z to a height of 3.5 m, 1 m wide.
pub(super) fn stairs(m: &mut MeshBuilder) {
    let (steps, rise, run) = (17, 3.5 / 17.0, 0.25);
    for i in 0..steps {
        let (y, z) = (rise * (i + 1) as f32, run * i as f32);
        m.block(vec3(-0.48, y - 0.04, z), vec3(0.48, y, z + 0.27), 0.0);
    }
    let top = vec3(0.0, 3.4, run * steps as f32);
    for x in [-0.5, 0.5] {
        m.bar(vec3(x, 0.06, 0.0), top + Vec3::X * x, 0.08);
        m.bar(vec3(x, 1.0, 0.0), top + vec3(x, 1.0, 0.0), 0.045);
        for t in [0.02, 0.35, 0.68, 0.98] {
            let foot = vec3(x, 0.06, 0.0).lerp(top + Vec3::X * x, t);
            m.bar(foot, foot + Vec3::Y * 0.97, 0.04);
        }
    }
}

/// Cable of bay length that sags and wanders.
fn cable(number: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let phase = number as f32 * 1.7;
    let points: Vec<(Vec3, f32)> = (0..=8)
        .map(|i| {
            let t = i as f32 / 8.0;
            // Cables of adjacent bays meet.
            let x = 0.02 * ((TAU * t + phase).sin() - phase.sin());
            (vec3(x, 0.0, BAY_M * t), 0.016)
        })
        .collect();
    m.tube(&points, 5);
    m
}

pub(super) fn sign(m: &mut MeshBuilder) {
    m.surface(1, 1, |s, t| {
        (vec3(s - 0.5, t, 0.0) * 0.5, glam::vec2(s, 1.0 - t))
    });
}

/// Pipes, spools and elbows, each by size and service, and flanges by size.
pub(super) fn pipes(scene: &mut SceneBuilder) {
    let mut each = |what: &str, mesh: fn(usize) -> MeshBuilder| {
        for (size, name) in SIZES.into_iter().enumerate() {
            for (service, material) in PIPES.into_iter().enumerate() {
                let name = pipe_name(&format!("{what}-{name}"), service);
                scene.mesh(&name, mesh(size), material);
            }
        }
    };
    each("pipe", |size| {
        straight_pipe(RADII_M[size], BAY_M, SIDES[size])
    });
    each("spool", |size| {
        straight_pipe(RADII_M[size], 2.0, SIDES[size])
    });
    each("elbow", |size| bent_pipe(RADII_M[size], SIDES[size]));
    for (size, name) in SIZES.into_iter().enumerate() {
        let flange = flange(RADII_M[size], SIDES[size] + 2);
        scene.mesh(&format!("flange-{name}"), flange, "cast-iron");
    }
}

/// Name of a kind of pipe for a service.
pub(super) fn pipe_name(what: &str, service: usize) -> String {
    PIPES[service].replace("pipe", what)
}

/// The cables.
pub(super) fn cables(scene: &mut SceneBuilder) {
    for (i, material) in CABLES.into_iter().enumerate() {
        scene.mesh("cable", cable(i), material);
    }
}
