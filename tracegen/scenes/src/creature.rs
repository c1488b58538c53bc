//! Shapes of a tyrannosaur: limbs, toes, teeth and claws.

use super::mesh_builder::{MeshBuilder, curve, lathed, sharp, smooth};
use super::noise::{bank, smoothstep};
use super::row::Row;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// A ring of a swept oval: centre, half width (across), half height (in the plane of the sweep).
#[derive(Clone, Copy, Debug)]
struct Ring {
    at: Vec3,
    width: f32,
    height: f32,
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

/// Folds of the skin.
fn wrinkles(s: f32, t: f32) -> f32 {
    1.0 + 0.05 * (bank().mottle.smooth(s, 3.0 * t) - 0.5)
}

/// Wrinkles and a row of scutes along the back, which is at s = 1/4.
fn scutes(s: f32, t: f32) -> f32 {
    let ridge = smoothstep(0.05, 0.0, (s - 0.25).abs()) * (0.5 + 0.5 * (t * 230.0).sin());
    wrinkles(s, t) + 0.07 * ridge
}

/// Wrinkles and the ridges above the eyes.
fn brow(s: f32, t: f32) -> f32 {
    let brow = (-((t - 0.38) / 0.09).powi(2)).exp()
        * smoothstep(0.09, 0.0, ((s - 0.25).abs() - 0.13).abs());
    wrinkles(s, t) + 0.22 * brow
}

/// The limb of a row: its cells, its skin and its rings.
pub fn limb_of(m: &mut MeshBuilder, row: &mut Row) {
    let cells = [row.number(), row.number()];
    let skin = row.named(&[
        ("brow", brow as fn(f32, f32) -> f32),
        ("scutes", scutes),
        ("wrinkles", wrinkles),
    ]);
    let rings = row.points().map(|[x, y, z, width, height]| Ring {
        at: vec3(x, y, z),
        width,
        height,
    });
    m.append(limb(&rings.collect::<Vec<_>>(), cells, skin));
}

/// Root, tip and direction of the toes of a foot.
fn toe_lines(side: f32) -> [(Vec3, Vec3, [f32; 2]); 3] {
    let step = if side > 0.0 { 0.35 } else { -0.45 };
    [-1.0, 0.0, 1.0].map(|toe: f32| {
        let (dz, dx) = (toe * 0.34).sin_cos();
        let root = vec3(0.0 + step, 0.12, side * 0.53);
        (root, root + vec3(0.46 * dx, -0.07, 0.46 * dz), [dx, dz])
    })
}

/// The toes of a foot.
pub fn toes(m: &mut MeshBuilder, side: f32) {
    for (root, tip, _) in toe_lines(side) {
        let middle = root.lerp(tip, 0.55) + Vec3::Y * 0.03;
        let rings = [
            (root, 0.085, 0.09),
            (middle, 0.065, 0.065),
            (tip, 0.045, 0.045),
        ];
        let rings = rings.map(|(at, width, height)| Ring { at, width, height });
        m.merge(&limb(&rings, [10, 8], wrinkles), Affine3A::IDENTITY);
    }
}

/// Teeth and claws of a side.
pub fn teeth(m: &mut MeshBuilder, side: f32) {
    for i in 0..9 {
        let t = i as f32 / 8.0;
        let x = 2.95 + 0.72 * t;
        let z = 0.115 + side * (0.20 - 0.09 * t);
        let size = 0.10 + 0.04 * ((i * 5 % 3) as f32);
        cone(
            m,
            vec3(x, 3.36 - 0.06 * t, z),
            vec3(0.1, -1.0, 0.0),
            0.024,
            size,
        );
        let low = vec3(x - 0.16, 3.09 - 0.13 * t, z - side * 0.02);
        cone(m, low, vec3(0.15, 1.0, 0.0), 0.020, size * 0.75);
    }
    for (_, tip, [dx, dz]) in toe_lines(side) {
        let root = tip - vec3(0.03 * dx, 0.0, 0.03 * dz);
        cone(m, root, vec3(dx, -0.25, dz), 0.036, 0.14);
    }
    for z in [-0.025f32, 0.025] {
        let root = vec3(2.04, 1.79, side * 0.39 + z);
        cone(m, root, vec3(0.7, -0.7, z * 4.0), 0.018, 0.11);
    }
}
