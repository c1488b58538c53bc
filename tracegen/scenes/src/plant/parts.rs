//! The plant's building, pipework, cables and walkways: small meshes that are placed many times.
//!
//! Long parts run along +z from their origin. Parts on the floor have their origin there.

use super::materials::{CABLES, PIPES, SERVICES};
use crate::mesh_builder::{Knot, MeshBuilder, SweepFrame, lathed, sharp, smooth, turned};
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
const SIZES: [&str; 3] = ["s", "m", "l"];

/// Numbers of the meshes that exist in several sizes and colours.
pub(super) struct Pipework {
    /// Pipes of bay length, by size and service.
    pub(super) pipe: [[usize; SERVICES]; 3],
    /// Pipes of 2 m length, by size and service.
    pub(super) spool: [[usize; SERVICES]; 3],
    pub(super) elbow: [[usize; SERVICES]; 3],
    pub(super) flange: [usize; 3],
    pub(super) cable: [usize; 3],
}

/// A straight prism of an outline (counter-clockwise, closed by its first point) along +z.
fn prism(outline: &[[f32; 2]], length: f32) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let mut knots: Vec<Knot> = outline.iter().map(|p| sharp(p[0], p[1])).collect();
    knots.extend(knots.first().copied());
    let frame = |z: f32| SweepFrame {
        origin: Vec3::Z * z,
        right: Vec3::X,
        up: Vec3::Y,
        scale: 1.0,
    };
    m.sweep(&knots, &[frame(0.0), frame(length)]);
    m
}

/// An outline as a prism that stands upright.
fn upright(outline: &[[f32; 2]], height: f32) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    m.merge(
        &prism(outline, height),
        Affine3A::from_rotation_x(-FRAC_PI_2),
    );
    m
}

/// I-beam outline of a width, height and thickness.
fn i_beam(w: f32, h: f32, t: f32) -> [[f32; 2]; 12] {
    let (x, y, s) = (w / 2.0, h / 2.0, t / 2.0);
    [
        [-x, -y],
        [x, -y],
        [x, t - y],
        [s, t - y],
        [s, y - t],
        [x, y - t],
        [x, y],
        [-x, y],
        [-x, y - t],
        [-s, y - t],
        [-s, t - y],
        [-x, t - y],
    ]
}

fn block(low: [f32; 3], high: [f32; 3]) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    m.block(Vec3::from(low), Vec3::from(high), 0.0);
    m
}

/// A box between two points, `width` thick in both directions.
pub(super) fn bar(m: &mut MeshBuilder, from: Vec3, to: Vec3, width: f32) {
    let length = from.distance(to);
    let h = width / 2.0;
    let rotation = glam::Quat::from_rotation_arc(Vec3::Z, (to - from).normalize_or(Vec3::Z));
    m.merge(
        &block([-h, -h, 0.0], [h, h, length]),
        Affine3A::from_rotation_translation(rotation, from),
    );
}

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

/// A gate valve on a medium pipe along z, its handwheel up.
fn valve() -> MeshBuilder {
    let r = RADII_M[1];
    let mut m = MeshBuilder::new();
    let body = lathed(
        &[
            sharp(r * 1.5, -0.2),
            sharp(r * 1.5, -0.17),
            smooth(r * 1.1, -0.14),
            smooth(r * 1.45, 0.0),
            smooth(r * 1.1, 0.14),
            sharp(r * 1.5, 0.17),
            sharp(r * 1.5, 0.2),
        ],
        10,
    );
    m.merge(&body, Affine3A::from_rotation_x(FRAC_PI_2));
    let bonnet = turned("0.07,0.08! 0.06,0.22! 0.02,0.24! 0.018,0.42! 0,0.42!", 8);
    m.merge(&bonnet, Affine3A::IDENTITY);
    m.ring([10, 4], 0.014, |sin, cos| {
        vec3(0.14 * cos, 0.39, 0.14 * sin)
    });
    bar(&mut m, vec3(-0.14, 0.39, 0.0), vec3(0.14, 0.39, 0.0), 0.016);
    bar(&mut m, vec3(0.0, 0.39, -0.14), vec3(0.0, 0.39, 0.14), 0.016);
    m
}

/// A pressure gauge on a stem, its face to +z.
fn gauge() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let stem = turned("0.012,0! 0.012,0.16!", 6);
    m.merge(&stem, Affine3A::IDENTITY);
    let can = turned("0,-0.02! 0.06,-0.02! 0.06,0.02! 0,0.02!", 12);
    let face = Affine3A::from_translation(Vec3::Y * 0.2) * Affine3A::from_rotation_x(FRAC_PI_2);
    m.merge(&can, face);
    m
}

/// A roof girder across a nave, its lower chord at the origin's height.
fn truss() -> MeshBuilder {
    let mut m = MeshBuilder::new();
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
        bar(&mut m, vec3(x, b, 0.0), vec3(x + step, a, 0.0), 0.1);
        bar(
            &mut m,
            vec3(x + step * 0.999, low, 0.0),
            vec3(x + step * 0.999, high, 0.0),
            0.08,
        );
    }
    m
}

/// 2 m of railing with toe board: posts at both ends and the middle.
fn railing() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for z in [0.03, 1.0, 1.97] {
        m.block(vec3(-0.02, 0.0, z - 0.02), vec3(0.02, 1.1, z + 0.02), 0.0);
    }
    for y in [0.55, 1.1] {
        m.rod(vec3(0.0, y, 0.0), vec3(0.0, y, 2.0), 0.024, 6);
    }
    m.block(vec3(-0.006, 0.02, 0.0), vec3(0.006, 0.14, 2.0), 0.0);
    m
}

/// Stairs up +z to a height of 3.5 m, 1 m wide.
fn stairs() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let (steps, rise, run) = (17, 3.5 / 17.0, 0.25);
    for i in 0..steps {
        let (y, z) = (rise * (i + 1) as f32, run * i as f32);
        m.block(vec3(-0.48, y - 0.04, z), vec3(0.48, y, z + 0.27), 0.0);
    }
    let top = vec3(0.0, 3.4, run * steps as f32);
    for x in [-0.5, 0.5] {
        bar(&mut m, vec3(x, 0.06, 0.0), top + Vec3::X * x, 0.08);
        bar(&mut m, vec3(x, 1.0, 0.0), top + vec3(x, 1.0, 0.0), 0.045);
        for t in [0.02, 0.35, 0.68, 0.98] {
            let foot = vec3(x, 0.06, 0.0).lerp(top + Vec3::X * x, t);
            bar(&mut m, foot, foot + Vec3::Y * 0.97, 0.04);
        }
    }
    m
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

fn fan_blades() -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..6 {
        let turn = Affine3A::from_rotation_z(TAU * i as f32 / 6.0);
        let mut blade = MeshBuilder::new();
        blade.block(vec3(0.08, -0.11, -0.01), vec3(0.68, 0.11, 0.01), 0.0);
        m.merge(&blade, turn * Affine3A::from_rotation_x(0.5));
    }
    let hub = turned("0,-0.08! 0.11,-0.08! 0.11,0.06! 0,0.1", 10);
    m.merge(&hub, Affine3A::from_rotation_x(FRAC_PI_2));
    m
}

fn fan_ring() -> MeshBuilder {
    let ring = turned(
        "0.74,-0.15! 0.82,-0.15! 0.82,0.15! 0.74,0.15! 0.74,-0.15!",
        18,
    );
    let mut m = MeshBuilder::new();
    m.merge(&ring, Affine3A::from_rotation_x(FRAC_PI_2));
    bar(&mut m, vec3(-0.8, 0.0, 0.12), vec3(0.8, 0.0, 0.12), 0.05);
    m
}

fn column() -> MeshBuilder {
    let mut column = upright(&i_beam(0.4, 0.4, 0.03), ROOF_M);
    column.block(vec3(-0.35, 0.0, -0.35), vec3(0.35, 0.03, 0.35), 0.0);
    column
}

fn purlin() -> MeshBuilder {
    prism(
        &[[-0.03, 0.0], [0.03, 0.0], [0.03, 0.2], [-0.03, 0.2]],
        BAY_M,
    )
}

fn runway() -> MeshBuilder {
    let mut runway = prism(&i_beam(0.3, 0.6, 0.025), BAY_M);
    runway.block(vec3(-0.035, 0.3, 0.0), vec3(0.035, 0.36, BAY_M), 0.0);
    runway
}

fn bracket() -> MeshBuilder {
    let mut bracket = MeshBuilder::new();
    bracket.block(vec3(0.0, 0.0, -0.15), vec3(0.75, 0.12, 0.15), 0.0);
    bar(
        &mut bracket,
        vec3(0.02, -0.6, 0.0),
        vec3(0.65, 0.05, 0.0),
        0.12,
    );
    bracket
}

fn bolt() -> MeshBuilder {
    turned("0.024,0! 0.024,0.03! 0.012,0.03! 0.012,0.07! 0,0.07!", 6)
}

fn lamp_shade() -> MeshBuilder {
    turned(
        "0.32,0! 0.3,0.1 0.12,0.26 0.1,0.45! 0.012,0.45! 0.012,1.1!",
        12,
    )
}

fn lamp() -> MeshBuilder {
    let mut lamp = turned("0,0.02! 0.29,0.06!", 12);
    lamp.orient(|_| Vec3::NEG_Y);
    lamp
}

fn pipe_shoe() -> MeshBuilder {
    block([-0.05, 0.0, -0.1], [0.05, 0.06, 0.1])
}

fn rack_post() -> MeshBuilder {
    let mut post = upright(&i_beam(0.22, 0.22, 0.02), 6.3);
    post.block(vec3(-0.2, 0.0, -0.2), vec3(0.2, 0.02, 0.2), 0.0);
    post
}

fn rack_beam() -> MeshBuilder {
    let mut beam = MeshBuilder::new();
    beam.merge(
        &prism(&i_beam(0.14, 0.2, 0.02), 2.4),
        Affine3A::from_rotation_y(FRAC_PI_2),
    );
    beam
}

fn tray() -> MeshBuilder {
    let mut tray = MeshBuilder::new();
    tray.block(vec3(-0.3, -0.01, 0.0), vec3(0.3, 0.0, BAY_M), 0.0);
    for x in [-0.3, 0.29] {
        tray.block(vec3(x, 0.0, 0.0), vec3(x + 0.01, 0.1, BAY_M), 0.0);
    }
    tray
}

/// Starts on the floor, 4.4 m below, and reaches past three trays to the duct.
fn stand() -> MeshBuilder {
    let mut stand = MeshBuilder::new();
    for x in [-0.36, 0.32] {
        stand.block(vec3(x, -4.4, -0.02), vec3(x + 0.04, 1.72, 0.02), 0.0);
    }
    for y in [0.0, 0.55, 1.1, 1.76] {
        stand.block(
            vec3(-0.36, y - 0.06, -0.025),
            vec3(0.36, y - 0.01, 0.025),
            0.0,
        );
    }
    stand
}

fn duct() -> MeshBuilder {
    let mut duct = straight_pipe(0.45, BAY_M, 14);
    for z in [0.02, 2.0, 4.0] {
        let ring = turned("0.45,-0.03! 0.48,-0.03! 0.48,0.03! 0.45,0.03!", 14);
        let place = Affine3A::from_translation(Vec3::Z * z) * Affine3A::from_rotation_x(FRAC_PI_2);
        duct.merge(&ring, place);
    }
    duct
}

fn diffuser() -> MeshBuilder {
    turned("0,-0.75! 0.35,-0.75! 0.2,-0.6! 0.2,-0.4!", 12)
}

fn sprinkler() -> MeshBuilder {
    turned("0,-0.2! 0.035,-0.19! 0.012,-0.17! 0.012,0!", 6)
}

fn grating() -> MeshBuilder {
    let mut grating = MeshBuilder::new();
    grating.quad(
        vec3(-0.6, 0.0, 2.0),
        Vec3::X * 1.2,
        Vec3::Z * -2.0,
        glam::Vec2::ZERO,
    );
    grating
}

fn stringer() -> MeshBuilder {
    block([-0.05, -0.22, 0.0], [0.05, -0.01, 2.0])
}

fn leg() -> MeshBuilder {
    let mut leg = upright(&i_beam(0.12, 0.12, 0.012), 3.3);
    leg.block(vec3(-0.12, 0.0, -0.12), vec3(0.12, 0.015, 0.12), 0.0);
    leg
}

fn bollard() -> MeshBuilder {
    turned("0.1,0! 0.1,0.9! 0.07,0.98 0,1", 10)
}

fn sign() -> MeshBuilder {
    let mut sign = MeshBuilder::new();
    sign.surface(1, 1, |s, t| {
        (vec3(s - 0.5, t, 0.0) * 0.5, glam::vec2(s, 1.0 - t))
    });
    sign
}

/// Flat sheets: slab, lane, wall, window, roof deck and sky light.
fn panels(scene: &mut SceneBuilder) {
    let b = BAY_M;
    let corner = vec3(0.0, 0.0, b);
    for (name, corner, right, up, material) in [
        ("floor-slab", corner, Vec3::X * b, Vec3::Z * -b, "floor"),
        (
            "lane",
            vec3(-0.06, 0.0, b),
            Vec3::X * 0.12,
            Vec3::Z * -b,
            "lane-paint",
        ),
        // Walls face +x and are half as high as the hall, with room for bands of windows between them.
        ("wall", corner, Vec3::Z * -b, Vec3::Y * 5.0, "cladding"),
        ("window", corner, Vec3::Z * -b, Vec3::Y * 1.5, "sky-light"),
        // Seen from below.
        (
            "roof-deck",
            Vec3::ZERO,
            Vec3::X * b,
            Vec3::Z * b,
            "roof-deck",
        ),
        (
            "sky-light",
            vec3(0.3, -0.05, 0.9),
            Vec3::X * 1.2,
            Vec3::Z * (b - 1.8),
            "sky-light",
        ),
    ] {
        let mut m = MeshBuilder::new();
        m.panel(corner, right, up, 1, 1);
        scene.mesh(name, m, material);
    }
}

/// Pipes, spools and elbows, each by size and service.
fn pipes(scene: &mut SceneBuilder) -> [[[usize; SERVICES]; 3]; 3] {
    let mut each = |what: &str, mesh: &dyn Fn(usize) -> MeshBuilder| {
        std::array::from_fn(|size| {
            std::array::from_fn(|service| {
                let material = PIPES[service];
                let name = material.replace("pipe", &format!("{what}-{}", SIZES[size]));
                scene.mesh(&name, mesh(size), material)
            })
        })
    };
    let pipe = each("pipe", &|size| {
        straight_pipe(RADII_M[size], BAY_M, SIDES[size])
    });
    let spool = each("spool", &|size| {
        straight_pipe(RADII_M[size], 2.0, SIDES[size])
    });
    let elbow = each("elbow", &|size| bent_pipe(RADII_M[size], SIDES[size]));
    [pipe, spool, elbow]
}

/// Adds the parts.
pub(super) fn parts(scene: &mut SceneBuilder) -> Pipework {
    panels(scene);
    let [pipe, spool, elbow] = pipes(scene);
    let flange = std::array::from_fn(|size| {
        let name = format!("flange-{}", SIZES[size]);
        scene.mesh(&name, flange(RADII_M[size], SIDES[size] + 2), "cast-iron")
    });
    for (name, mesh, material) in [
        ("column", column(), "steel-frame"),
        ("truss", truss(), "steel-frame"),
        ("purlin", purlin(), "zinc"),
        ("runway", runway(), "steel-frame"),
        ("bracket", bracket(), "steel-frame"),
        ("bolt", bolt(), "zinc"),
        ("lamp-shade", lamp_shade(), "zinc"),
        ("lamp", lamp(), "lamp"),
        ("pipe-shoe", pipe_shoe(), "zinc"),
        ("valve", valve(), "handwheel"),
        ("gauge", gauge(), "dial"),
        ("rack-post", rack_post(), "steel-frame"),
        ("rack-beam", rack_beam(), "steel-frame"),
        ("tray", tray(), "zinc"),
        ("stand", stand(), "zinc"),
    ] {
        scene.mesh(name, mesh, material);
    }
    let cable = std::array::from_fn(|i| scene.mesh("cable", cable(i), CABLES[i]));
    for (name, mesh, material) in [
        ("duct", duct(), "zinc"),
        ("diffuser", diffuser(), "zinc"),
        ("sprinkler", sprinkler(), "stainless"),
        ("grating", grating(), "grating"),
        ("stringer", stringer(), "steel-frame"),
        ("railing", railing(), "crane-paint"),
        ("leg", leg(), "steel-frame"),
        ("stairs", stairs(), "steel-frame"),
        ("bollard", bollard(), "hazard"),
        ("sign", sign(), "sign"),
        ("fan-ring", fan_ring(), "steel-frame"),
        ("fan-blades", fan_blades(), "cast-iron"),
    ] {
        scene.mesh(name, mesh, material);
    }
    Pipework {
        pipe,
        spool,
        elbow,
        flange,
        cable,
    }
}
