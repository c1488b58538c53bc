//! Plants of the meadow as geometry without alpha masks: lavender, grass, poppies, broad-leaved
//! trees, cypresses.

use crate::mesh_builder::MeshBuilder;
use crate::noise::Rng;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{PI, TAU};

fn compass(angle: f32) -> Vec3 {
    let (sin, cos) = angle.sin_cos();
    vec3(cos, 0.0, -sin)
}

/// A flat, bent blade from `root` to `tip`: a quad and a pointed triangle, 3 triangles in all.
fn blade(m: &mut MeshBuilder, root: Vec3, tip: Vec3, sag: Vec3, half: Vec3) {
    let mid = root.lerp(tip, 0.55) + sag;
    let normal = half.cross(tip - root).normalize_or(Vec3::Y);
    let v = [
        root - half,
        root + half,
        mid + half * 0.7,
        mid - half * 0.7,
        tip,
    ]
    .map(|p| m.vertex(p, normal, vec2(p.x + p.z, -p.y)));
    m.indices
        .extend([v[0], v[1], v[2], v[0], v[2], v[3], v[3], v[2], v[4]]);
}

/// A three-sided spindle about a line: 6 triangles.
fn spindle(m: &mut MeshBuilder, base: Vec3, top: Vec3, radius: f32, turn: f32) {
    let axis = (top - base).normalize_or(Vec3::Y);
    let right = axis.any_orthonormal_vector();
    let up = axis.cross(right);
    let waist = base.lerp(top, 0.4);
    let around = |k: usize| {
        let (sin, cos) = (turn + TAU * k as f32 / 3.0).sin_cos();
        right * cos + up * sin
    };
    for k in 0..3 {
        let (a, b) = (around(k), around(k + 1));
        let (pa, pb) = (waist + a * radius, waist + b * radius);
        for (apex, swap) in [(top, false), (base, true)] {
            let corners = if swap { [pb, pa, apex] } else { [pa, pb, apex] };
            let normal = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .normalize_or(a);
            let v = corners.map(|p| m.vertex(p, normal, vec2(p.x + p.z, -p.y)));
            m.triangle(v[0], v[1], v[2]);
        }
    }
}

/// A lavender bush: stems and leaves, and the flower spikes with a radius of `spike` metres. 5 + 6
/// triangles per stalk.
pub fn lavender(stalks: usize, radius: f32, spike: f32, rng: &mut Rng) -> [MeshBuilder; 2] {
    let (mut green, mut purple) = (MeshBuilder::new(), MeshBuilder::new());
    for i in 0..stalks {
        let ring = ((i as f32 + 0.5) / stalks as f32).sqrt();
        let out = compass(2.399_963 * i as f32 + rng.jitter(0.3));
        let root = out * (0.12 * radius * ring);
        let lean = ring * (0.75 + rng.jitter(0.15));
        let length = radius * rng.range(0.95, 1.25);
        let top = root + (out * lean + Vec3::Y * (1.25 - 0.45 * lean)) * length;
        let side = out.cross(Vec3::Y) * 0.006;
        // The face of the stem that points outwards.
        let normal = (side * 2.0).cross(top - root + side).normalize_or(out);
        let side = if normal.dot(out) < 0.0 { -side } else { side };
        let normal = if normal.dot(out) < 0.0 {
            -normal
        } else {
            normal
        };
        let v =
            [root - side, root + side, top].map(|p| green.vertex(p, normal, vec2(p.x + p.z, -p.y)));
        green.triangle(v[0], v[1], v[2]);
        let head = 0.19 * radius * rng.range(0.8, 1.3);
        let along = (top - root).normalize_or(Vec3::Y);
        spindle(
            &mut purple,
            top - along * 0.02,
            top + along * head,
            spike * rng.range(0.8, 1.2),
            i as f32,
        );
        if i % 2 == 0 {
            let tip = root + (out * (0.9 * ring + 0.25) + Vec3::Y * 0.7) * (0.55 * length);
            blade(&mut green, root, tip, Vec3::Y * 0.02, side * 2.0);
        }
    }
    [green, purple]
}

/// A tuft of grass.
pub fn tuft(blades: usize, height: f32, rng: &mut Rng) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..blades {
        let out = compass(2.4 * i as f32 + rng.jitter(0.5));
        let root = out * rng.range(0.0, 0.07) - Vec3::Y * 0.01;
        let tall = height * rng.range(0.6, 1.15);
        let tip = root + out * (tall * rng.range(0.15, 0.55)) + Vec3::Y * tall;
        blade(
            &mut m,
            root,
            tip,
            Vec3::Y * (0.1 * tall),
            out.cross(Vec3::Y) * 0.006,
        );
    }
    m
}

/// A poppy: stem and leaves, and four cupped petals.
pub fn poppy(height: f32, rng: &mut Rng) -> [MeshBuilder; 2] {
    let (mut green, mut red) = (MeshBuilder::new(), MeshBuilder::new());
    let lean = compass(rng.range(0.0, TAU)) * 0.12;
    let top = (Vec3::Y + lean) * height;
    for turn in [0.3f32, 1.9] {
        let side = compass(turn) * 0.004;
        blade(&mut green, Vec3::ZERO, top, -lean * 0.1, side);
    }
    for i in 0..4 {
        let out = compass(2.1 * i as f32);
        blade(
            &mut green,
            Vec3::ZERO,
            out * 0.12 + Vec3::Y * 0.10,
            Vec3::Y * 0.05,
            out.cross(Vec3::Y) * 0.016,
        );
    }
    for i in 0..4 {
        let turn = TAU * i as f32 / 4.0;
        red.surface(3, 2, |s, t| {
            let a = turn + 1.9 * (s - 0.5);
            let r = 0.045 * (0.12 + 0.88 * t) * (1.0 - 0.25 * (2.0 * s - 1.0).powi(2) * t);
            (
                top + compass(a) * r + Vec3::Y * (0.035 * t * t),
                vec2(s, t) * 0.1,
            )
        });
    }
    red.orient(|_| Vec3::Y);
    [green, red]
}

/// A leaf: a rhombus, 2 triangles.
fn leaf(m: &mut MeshBuilder, center: Vec3, along: Vec3, across: Vec3) {
    let normal = across.cross(along).normalize_or(Vec3::Y);
    let corners = [
        center - along,
        center + across,
        center + along,
        center - across,
    ];
    let uv = [
        vec2(0.5, 1.0),
        vec2(1.0, 0.5),
        vec2(0.5, 0.0),
        vec2(0.0, 0.5),
    ];
    let v: [u32; 4] = std::array::from_fn(|i| m.vertex(corners[i], normal, uv[i] * 0.3));
    m.indices.extend([v[0], v[1], v[2], v[0], v[2], v[3]]);
}

/// Leaves of a round crown: clusters on the shells of several balls.
pub fn crown(leaves: usize, height: f32, radius: f32, rng: &mut Rng) -> MeshBuilder {
    let balls: Vec<(Vec3, f32)> = (0..11)
        .map(|i| {
            let out = compass(2.4 * i as f32 + rng.jitter(0.3))
                * (radius * 0.62 * ((i as f32 + 0.5) / 11.0).sqrt());
            let center =
                out + Vec3::Y * (height + rng.range(-0.25, 0.45) * radius - 0.25 * out.length());
            (center, radius * rng.range(0.38, 0.52))
        })
        .collect();
    let mut m = MeshBuilder::new();
    for i in 0..leaves {
        let (center, r) = balls[i % balls.len()];
        let y = rng.range(-0.8, 1.0);
        let d = compass(rng.range(0.0, TAU)) * (1.0 - y * y).sqrt() + Vec3::Y * y;
        let p = center + d * (r * rng.range(0.75, 1.05));
        let hang = (d + vec3(rng.jitter(0.8), rng.jitter(0.8) - 0.4, rng.jitter(0.8)))
            .normalize_or(Vec3::X);
        let across = hang.cross(d + Vec3::X * 0.01).normalize_or(Vec3::Z);
        let size = rng.range(0.10, 0.17);
        leaf(&mut m, p, hang * size, across * (0.55 * size));
    }
    m
}

/// Foliage of a cypress: a flame of upright sprays.
pub fn cypress(leaves: usize, height: f32, radius: f32, rng: &mut Rng) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..leaves {
        let t = (i as f32 + rng.unit()) / leaves as f32;
        let outline =
            radius * (PI * (0.08 + 0.92 * t)).sin().max(0.02).powf(0.55) * (1.0 - 0.55 * t);
        let out = compass(2.399_963 * i as f32);
        let p = out * (outline * rng.range(0.7, 1.05)) + Vec3::Y * (0.25 + height * t);
        let up = (Vec3::Y + out * rng.range(0.1, 0.45)).normalize();
        let across = up.cross(out).normalize_or(Vec3::X) + out * rng.jitter(0.6);
        let size = rng.range(0.16, 0.26);
        leaf(
            &mut m,
            p,
            up * size,
            across.normalize_or(Vec3::X) * (0.32 * size),
        );
    }
    m
}

/// A surface of half-round tiles, `size` metres: across (x) and up the slope (y), on the x-y plane.
pub fn tiled_slope(size: Vec2, columns: usize, rows: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let course = size.y / rows as f32;
    for row in 0..rows {
        m.surface(columns * 5, 1, |s, t| {
            let wave = (PI * columns as f32 * s).sin().abs();
            let y = course * (row as f32 + t * 1.12);
            let z = 0.07 * wave + 0.045 * (1.0 - t);
            (vec3(size.x * (s - 0.5), y, z), vec2(size.x * (s - 0.5), -y))
        });
    }
    m.orient(|_| Vec3::Z);
    // The deck under the tiles.
    m.quad(
        vec3(-0.5 * size.x, 0.0, 0.0),
        Vec3::X * size.x,
        Vec3::Y * size.y,
        Vec2::ZERO,
    );
    m
}
