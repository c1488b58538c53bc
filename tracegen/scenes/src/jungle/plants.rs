//! Plants, rocks and trunks of the jungle, one mesh each, for instancing.

use crate::atrium::parts::arching_leaf;
use crate::mesh_builder::MeshBuilder;
use crate::noise::{Rng, bank};
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Adds a leaf that starts at `root`, rotated about the vertical and raised by `pitch`.
fn attach(m: &mut MeshBuilder, leaf: &MeshBuilder, root: Vec3, turn: f32, pitch: f32, roll: f32) {
    let rotation =
        Quat::from_rotation_y(turn) * Quat::from_rotation_z(pitch) * Quat::from_rotation_x(roll);
    m.merge(leaf, Affine3A::from_rotation_translation(rotation, root));
}

/// Leaves around a crown: `leaf(age)` gives one of them and its root, with an age from 0 to 1.
fn whorl(
    count: usize,
    roll: f32,
    rng: &mut Rng,
    leaf: impl Fn(f32, &mut Rng) -> (MeshBuilder, Vec3),
) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..count {
        let (leaf, root) = leaf(i as f32 / count as f32, rng);
        let turn = 2.4 * i as f32 + rng.jitter(0.3);
        attach(&mut m, &leaf, root, turn, 0.0, rng.jitter(roll));
    }
    m
}

/// A fern: fronds around a crown, arching over.
pub fn fern(fronds: usize, length: f32, rng: &mut Rng) -> MeshBuilder {
    whorl(fronds, 0.3, rng, |young, rng| {
        let size = length * rng.range(0.75, 1.1) * (1.0 - 0.3 * young);
        let rise = 0.5 + 0.9 * young;
        let leaf = arching_leaf(size, 0.34 * size, rise, 0.5 + 0.5 * rise, 0.10, [2, 6]);
        (leaf, Vec3::Y * 0.03)
    })
}

/// A banana-like plant: broad blades on short stalks.
pub fn broadleaf(blades: usize, length: f32, rng: &mut Rng) -> MeshBuilder {
    whorl(blades, 0.2, rng, |young, rng| {
        let size = length * rng.range(0.8, 1.1);
        let leaf = arching_leaf(size, 0.38 * size, 1.0 + 0.6 * young, 1.1, 0.22, [4, 7]);
        (leaf, Vec3::Y * (0.25 * length * young))
    })
}

/// A bush: cards with sprays of small leaves around a dome.
pub fn bush(cards: usize, radius: f32, rng: &mut Rng) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..cards {
        let up = (i as f32 + 0.5) / cards as f32;
        let turn = 2.4 * i as f32 + rng.jitter(0.4);
        let (sin, cos) = turn.sin_cos();
        let lift = radius * 0.9 * up;
        let out = radius * 0.45 * (1.0 - up * up).sqrt();
        let leaf = arching_leaf(
            radius * rng.range(0.55, 0.85),
            radius * 0.6,
            0.25,
            0.35,
            0.1,
            [2, 3],
        );
        attach(
            &mut m,
            &leaf,
            vec3(out * cos, lift, -out * sin),
            turn,
            0.2 + 1.0 * up + rng.jitter(0.3),
            rng.jitter(0.6),
        );
    }
    m
}

/// Tufts of grass: crossed cards.
pub fn grass(tufts: usize, spread: f32, height: f32, rng: &mut Rng) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for _ in 0..tufts {
        let root = vec3(rng.jitter(spread), -0.02, rng.jitter(spread));
        let size = height * rng.range(0.7, 1.2);
        let turn = rng.range(0.0, TAU);
        for k in 0..2 {
            let blade = arching_leaf(size, size * 1.1, 0.06, 0.12, 0.0, [1, 2]);
            attach(
                &mut m,
                &blade,
                root,
                turn + k as f32 * FRAC_PI_2,
                1.45 + rng.jitter(0.1),
                0.0,
            );
        }
    }
    m
}

/// A trunk with buttress roots from below the ground to `height`.
pub fn buttressed_trunk(
    radius: f32,
    height: f32,
    roots: f32,
    cells: [usize; 2],
    seed: u64,
) -> MeshBuilder {
    let mut rng = Rng::new(seed);
    let (phase, lean) = (rng.range(0.0, TAU), vec2(rng.jitter(0.5), rng.jitter(0.5)));
    let twist = rng.jitter(0.5);
    let noise = bank();
    let mut m = MeshBuilder::new();
    m.surface(cells[0], cells[1], |s, t| {
        // Rows are denser towards the foot, where the shape varies most.
        let y = -0.3 + (height + 0.3) * t.powf(1.7);
        let angle = TAU * (s - s.floor());
        let foot = (-(y + 0.3).max(0.0) / (1.5 * radius + 0.35)).exp();
        let fin = (0.5 + 0.5 * (roots * angle + phase + twist * y).cos()).powi(3);
        let lump = noise
            .mottle
            .smooth(0.5 + 0.1 * angle.cos(), y * 0.05 + 0.1 * angle.sin())
            - 0.5;
        let r =
            radius * (1.0 - 0.45 * t) * (1.0 + 0.25 * lump) + radius * foot * (0.35 + 2.4 * fin);
        let bend = vec2((y * 0.35).sin() * lean.x, (y * 0.27).sin() * lean.y) * 0.6 * radius;
        let (sin, cos) = angle.sin_cos();
        (
            vec3(r * cos + bend.x, y, -r * sin + bend.y),
            vec2(s * TAU * radius, -y),
        )
    });
    m
}

/// Boughs with leaf cards at the top of a trunk `height` metres high.
pub fn canopy(height: f32, radius: f32, cards: usize, rng: &mut Rng) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..cards {
        let turn = 2.399_963 * i as f32;
        let ring = ((i as f32 + 0.5) / cards as f32).sqrt();
        let (sin, cos) = turn.sin_cos();
        let dome = radius * 0.45 * (1.0 - ring * ring);
        let root = vec3(
            ring * radius * cos + rng.jitter(0.3),
            height + dome + rng.jitter(0.35) - 0.2,
            -ring * radius * sin + rng.jitter(0.3),
        );
        let size = rng.range(1.0, 1.7);
        let leaf = arching_leaf(size, size * 0.95, 0.1, 0.45, 0.1, [2, 2]);
        attach(
            &mut m,
            &leaf,
            root,
            turn + rng.jitter(0.9),
            rng.jitter(0.5),
            rng.jitter(0.5),
        );
    }
    m
}

/// The boughs that carry a canopy.
pub fn boughs(height: f32, radius: f32, count: usize, thick: f32, rng: &mut Rng) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..count {
        let turn = TAU * i as f32 / count as f32 + rng.jitter(0.4);
        let (sin, cos) = turn.sin_cos();
        let start = height * rng.range(0.72, 0.95);
        let reach = radius * rng.range(0.6, 0.95);
        let points: Vec<(Vec3, f32)> = (0..=5)
            .map(|k| {
                let t = k as f32 / 5.0;
                let out = reach * t;
                let y = start
                    + (height + 0.25 * radius - start) * (1.0 - (1.0 - t).powi(2))
                    + 0.15 * (5.0 * t).sin();
                (vec3(out * cos, y, -out * sin), thick * (1.0 - 0.85 * t))
            })
            .collect();
        m.tube(&points, 6);
    }
    m
}

/// A palm's ringed, curved trunk, and the point at its end for the crown.
pub fn palm_trunk(height: f32, bend: f32) -> (MeshBuilder, Vec3) {
    let center = |t: f32| vec3(bend * t * t, height * t - 0.2 * (1.0 - t), 0.0);
    let points: Vec<(Vec3, f32)> = (0..=26)
        .map(|i| {
            let t = i as f32 / 26.0;
            let ring = if i % 2 == 0 { 1.0 } else { 0.88 };
            (
                center(t),
                (0.17 - 0.06 * t + 0.10 * (-9.0 * t).exp()) * ring,
            )
        })
        .collect();
    let mut m = MeshBuilder::new();
    m.tube(&points, 9);
    (m, center(1.0))
}

/// A palm's crown of feathered fronds around the origin.
pub fn palm_crown(fronds: usize, length: f32, rng: &mut Rng) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..fronds {
        let young = i as f32 / fronds as f32;
        let size = length * rng.range(0.85, 1.1);
        let leaf = arching_leaf(
            size,
            0.42 * size,
            0.15 + 0.95 * young,
            0.65 + 0.45 * young,
            0.16,
            [2, 8],
        );
        attach(
            &mut m,
            &leaf,
            Vec3::ZERO,
            2.4 * i as f32,
            0.0,
            rng.jitter(0.25),
        );
    }
    m
}

/// A liana from `a` to `b` that sags by `sag` metres.
pub fn liana(a: Vec3, b: Vec3, sag: f32, radius: f32) -> MeshBuilder {
    let side = (b - a).cross(Vec3::Y).normalize_or(Vec3::X);
    let points: Vec<(Vec3, f32)> = (0..=18)
        .map(|i| {
            let t = i as f32 / 18.0;
            let wave = side * (0.06 * (17.0 * t).sin());
            (
                a.lerp(b, t) - Vec3::Y * (4.0 * sag * t * (1.0 - t)) + wave,
                radius * (1.0 + 0.2 * (29.0 * t).sin()),
            )
        })
        .collect();
    let mut m = MeshBuilder::new();
    m.tube(&points, 6);
    m
}

/// Leaves along the same liana.
pub fn liana_leaves(a: Vec3, b: Vec3, sag: f32, count: usize, rng: &mut Rng) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..count {
        let t = (i as f32 + rng.unit()) / count as f32;
        let root = a.lerp(b, t) - Vec3::Y * (4.0 * sag * t * (1.0 - t));
        let size = rng.range(0.16, 0.30);
        let leaf = arching_leaf(size, size, 0.05, 0.5, 0.15, [2, 2]);
        attach(
            &mut m,
            &leaf,
            root,
            rng.range(0.0, TAU),
            -0.9 + rng.jitter(0.5),
            rng.jitter(0.5),
        );
    }
    m
}

/// A boulder of radius 1, flat at the bottom.
pub fn boulder(cells: [usize; 2], seed: u64) -> MeshBuilder {
    let mut rng = Rng::new(seed);
    let planes: Vec<(Vec3, f32)> = (0..9)
        .map(|_| {
            let n = vec3(rng.jitter(1.0), rng.jitter(0.8), rng.jitter(1.0)).normalize_or(Vec3::X);
            (n, rng.range(0.62, 0.85))
        })
        .collect();
    let offset = rng.unit();
    let noise = bank();
    let mut m = MeshBuilder::new();
    m.surface(cells[0], cells[1], |s, t| {
        let (sin, cos) = (TAU * (s - s.floor())).sin_cos();
        let (low, high) = (std::f32::consts::PI * (t - 0.5)).sin_cos();
        let d = vec3(high * cos, low, -high * sin);
        // Cut by planes, like rock split by frost.
        let mut r = 1.0f32;
        for (n, distance) in &planes {
            let facing = d.dot(*n);
            if facing > 0.0 {
                r = r.min(distance / facing);
            }
        }
        let lump = noise
            .mottle
            .smooth(offset + 0.12 * d.x + 0.07 * d.y, offset + 0.12 * d.z)
            - 0.5;
        let p = d * (r + 0.16 * lump);
        (
            vec3(p.x, p.y.max(-0.35), p.z),
            vec2(s * 5.0, (0.5 - t) * 2.6),
        )
    });
    m
}
