//! Architectural parts of the atrium: columns, arches, vaults, drapes, reliefs, plants.

use crate::mesh_builder::{
    Knot, MeshBuilder, SweepFrame, curve, profile, scaled_profile, sharp, smooth,
};
use crate::noise::{Rng, smoothstep};
use glam::{Affine3A, Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Dimensions of a column, metres.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Radius at the foot of the shaft.
    pub radius: f32,
    /// Height from the floor to the top of the abacus.
    pub height: f32,
    /// Segments around the axis.
    pub segments: usize,
    /// Rows of cells up the shaft.
    pub rows: usize,
    /// Flutes around the capital and neck; 0 for none.
    pub flutes: u32,
    /// Steps between the knots of mouldings.
    pub steps: usize,
}

impl Column {
    /// Mesh of the base and the shaft.
    pub fn shaft(&self) -> MeshBuilder {
        let (r, top) = (self.radius, self.height - 2.0 * self.radius);
        let mut m = MeshBuilder::new();
        let plinth = 1.42 * r;
        m.block(
            vec3(-plinth, 0.0, -plinth),
            vec3(plinth, 0.3 * r, plinth),
            0.02,
        );
        let base = scaled_profile(
            "1.38,0.3! 1.42,0.42 1.3,0.55! 1.16,0.62 1.2,0.72! \
             1.22,0.79 1.1,0.86! 1.03,0.9 1,1!",
            Vec2::splat(r),
        );
        m.lathe(&curve(&base, self.steps), self.segments);
        let entasis: Vec<Knot> = (0..=self.rows)
            .map(|i| {
                let t = i as f32 / self.rows as f32;
                smooth(r * (1.0 - 0.13 * t.powf(1.8)), r + t * (top - r))
            })
            .collect();
        m.lathe(&entasis, self.segments);
        m
    }

    /// Mesh of the neck ring, the fluted bell with leaves curling outwards, and the abacus.
    pub fn capital(&self) -> MeshBuilder {
        let (r, top) = (self.radius * 0.87, self.height - 2.0 * self.radius);
        let mut m = MeshBuilder::new();
        let h = 2.0 * self.radius;
        let ring = [
            sharp(r, top),
            smooth(1.12 * r, top + 0.04 * h),
            sharp(1.02 * r, top + 0.09 * h),
        ];
        m.lathe(&curve(&ring, self.steps), self.segments);
        let bell = [
            sharp(1.02 * r, top + 0.09 * h),
            smooth(1.08 * r, top + 0.3 * h),
            smooth(1.22 * r, top + 0.5 * h),
            smooth(1.52 * r, top + 0.68 * h),
            sharp(1.62 * r, top + 0.72 * h),
            smooth(1.5 * r, top + 0.76 * h),
            sharp(1.2 * r, top + 0.78 * h),
        ];
        let flutes = self.flutes as f32;
        m.lathe_shaped(
            &curve(&bell, self.steps + 1),
            self.segments * if self.flutes > 0 { 2 } else { 1 },
            |angle, y| {
                let t = (y - top) / h;
                // Two tiers of leaves, the upper one offset by half a leaf.
                let tier = if t > 0.42 { PI } else { 0.0 };
                let leaf = 0.5 + 0.5 * (angle * flutes + tier).cos();
                let curl = 1.0 + 0.2 * smoothstep(0.28, 0.4, t) * (1.0 - smoothstep(0.4, 0.44, t));
                if self.flutes == 0 {
                    1.0
                } else {
                    (0.80 + 0.24 * leaf.sqrt()) * lerp_curl(curl, leaf)
                }
            },
        );
        let (low, a) = (top + 0.78 * h, 1.62 * r);
        m.block(
            vec3(-0.86 * a, low, -0.86 * a),
            vec3(0.86 * a, top + 0.84 * h, 0.86 * a),
            0.01,
        );
        m.block(vec3(-a, top + 0.84 * h, -a), vec3(a, self.height, a), 0.025);
        m
    }
}

fn lerp_curl(curl: f32, leaf: f32) -> f32 {
    1.0 + (curl - 1.0) * leaf
}

/// A bay of an arcade wall: from x = -pitch/2 to pitch/2, y from the spring to `top`, z from
/// -thickness/2 to thickness/2, with a round arch cut out.
#[derive(Clone, Copy, Debug)]
pub struct Bay {
    /// Distance between the column axes.
    pub pitch: f32,
    /// Radius of the arch.
    pub radius: f32,
    /// Height of the spring line.
    pub spring: f32,
    /// Top of the wall.
    pub top: f32,
    /// Thickness of the wall.
    pub thickness: f32,
    /// Segments of the arch.
    pub segments: usize,
}

impl Bay {
    fn arch_point(&self, radius: f32, i: usize) -> Vec2 {
        let angle = PI * (1.0 - i as f32 / self.segments as f32);
        vec2(radius * angle.cos(), self.spring + radius * angle.sin())
    }

    /// Both faces of the wall above the arch.
    pub fn spandrel(&self) -> MeshBuilder {
        let mut m = MeshBuilder::new();
        let half = self.pitch * 0.5;
        let mut outline = vec![vec2(-half, self.spring)];
        outline.extend((0..=self.segments).map(|i| self.arch_point(self.radius, i)));
        outline.push(vec2(half, self.spring));
        for side in [1.0f32, -1.0] {
            let z = side * self.thickness * 0.5;
            for pair in outline.windows(2) {
                let (a, b) = if side > 0.0 {
                    (pair[0], pair[1])
                } else {
                    (pair[1], pair[0])
                };
                let corners = [a, b, vec2(b.x, self.top), vec2(a.x, self.top)];
                let v = corners
                    .map(|p| m.vertex(p.extend(z), Vec3::Z * side, vec2(p.x * side + half, -p.y)));
                m.indices.extend([v[0], v[1], v[2], v[0], v[2], v[3]]);
            }
            // The strip next to the arch below its shoulder is level with the spring.
        }
        m
    }

    /// The arch's underside, and the moulded voussoirs on both faces.
    pub fn archivolt(&self, moulding_steps: usize) -> MeshBuilder {
        let mut m = MeshBuilder::new();
        let half = self.thickness * 0.5;
        let (w, d) = (0.26 * self.radius, 0.05);
        // Across the arch's band: from the soffit out over the face.
        let face = |side: f32| -> Vec<Knot> {
            let s = side;
            let p = [
                sharp(0.0, s * (half + 0.3 * d)),
                sharp(0.35 * w, s * (half + 0.3 * d)),
                smooth(0.42 * w, s * (half + 0.75 * d)),
                sharp(0.6 * w, s * (half + 0.6 * d)),
                smooth(0.85 * w, s * (half + 1.1 * d)),
                sharp(w, s * (half + d)),
                sharp(w, s * half * 0.98),
            ];
            curve(&p, moulding_steps)
        };
        let path: Vec<SweepFrame> = (0..=self.segments)
            .map(|i| {
                let p = self.arch_point(self.radius, i);
                let out = (p - vec2(0.0, self.spring)) / self.radius;
                SweepFrame {
                    origin: p.extend(0.0),
                    right: out.extend(0.0),
                    up: Vec3::Z,
                    scale: 1.0,
                }
            })
            .collect();
        let mut profile: Vec<Knot> = face(-1.0);
        profile.reverse();
        profile.extend(face(1.0));
        m.sweep(&profile, &path);
        m.orient(|p| towards_opening(p, self.spring, half));
        m
    }
}

/// Direction in which an arch's surface at `p` faces: outwards on its faces, down into the opening
/// below.
fn towards_opening(p: Vec3, spring: f32, half_thickness: f32) -> Vec3 {
    if p.z.abs() > half_thickness {
        Vec3::Z * p.z.signum()
    } else {
        -vec3(p.x, p.y - spring, 0.0).normalize_or_zero()
    }
}

/// A groin vault seen from below over a bay of `half.x` by `half.y` (half extents), rising `rise`.
pub fn groin_vault(half: Vec2, spring: f32, rise: f32, cells: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for web in 0..4 {
        m.surface(cells, cells, |s, t| {
            let across = 2.0 * s - 1.0;
            let (a, b) = (t, t * across);
            let (x, z) = match web {
                0 => (a, b),
                1 => (-b, a),
                2 => (-a, -b),
                _ => (b, -a),
            };
            let y = spring + rise * (1.0 - b * b).max(0.0).sqrt();
            let p = vec3(half.x * x, y, half.y * z);
            // Texture coordinates around the barrel and along it.
            let around = (b.asin() / FRAC_PI_2) * 0.5 * PI * half.x;
            (p, vec2(around, a * half.y))
        });
    }
    m.orient(|_| Vec3::NEG_Y);
    m
}

/// A rib under a vault: a square-edged band along a half circle of `radius` about z.
pub fn rib(radius: f32, spring: f32, width: f32, depth: f32, segments: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let w = width * 0.5;
    let profile = [
        sharp(depth, w),
        sharp(0.3 * depth, w),
        sharp(0.0, 0.6 * w),
        sharp(0.0, -0.6 * w),
        sharp(0.3 * depth, -w),
        sharp(depth, -w),
    ];
    let path: Vec<SweepFrame> = (0..=segments)
        .map(|i| {
            let (sin, cos) = (PI * (1.0 - i as f32 / segments as f32)).sin_cos();
            let out = vec3(cos, sin, 0.0);
            SweepFrame {
                origin: vec3(0.0, spring, 0.0) + out * (radius - depth),
                right: out,
                up: Vec3::Z,
                scale: 1.0,
            }
        })
        .collect();
    m.sweep(&profile, &path);
    m.orient(|p| towards_opening(p, spring, w * 0.99));
    m
}

/// A straight moulding of `length` metres along +x at height `y`; the wall is at z = 0 and the
/// profile (out, up) projects towards +z.
pub fn moulding(profile: &[Knot], length: f32, y: f32) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    // right x up = z x y = -x, so the sweep runs backwards.
    let path = [length, 0.0].map(|x| SweepFrame {
        origin: vec3(x, y, 0.0),
        right: Vec3::Z,
        up: Vec3::Y,
        scale: 1.0,
    });
    m.sweep(profile, &path);
    m
}

/// A cornice's profile of the given size.
pub fn cornice(out: f32, height: f32, steps: usize) -> Vec<Knot> {
    curve(
        &scaled_profile(
            "0,0! 0.25,0! 0.25,0.18! 0.45,0.28 0.5,0.42! 0.85,0.45! \
             0.85,0.68! 0.9,0.82 1,0.9! 1,1! 0,1!",
            vec2(out, height),
        ),
        steps,
    )
}

/// A baluster 0.7 m high.
pub fn baluster(segments: usize, steps: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let knots = profile(
        "0.075,0! 0.075,0.06! 0.045,0.1 0.088,0.24 0.052,0.42 0.034,0.52 0.05,0.57! 0.06,0.6 \
        0.05,0.63! 0.072,0.65! 0.072,0.7!",
    );
    m.lathe(&curve(&knots, steps), segments);
    m
}

/// A hanging cloth `width` x `drop` metres whose top is at the origin, gathered into folds.
pub fn drape(width: f32, drop: f32, folds: f32, cells: [usize; 2], seed: u64) -> MeshBuilder {
    let mut rng = Rng::new(seed);
    let (phase, wander) = (rng.range(0.0, TAU), rng.range(0.6, 1.2));
    let mut m = MeshBuilder::new();
    let shape = |s: f32, t: f32| {
        // t runs upwards; folds are tight at the rail and open towards the hem.
        let down = 1.0 - t;
        let a = TAU * folds * s + phase;
        let depth = 0.05 + 0.07 * down.sqrt();
        let z = depth * (a + wander * (3.0 * s + down).sin()).sin()
            + 0.03 * (2.3 * a + 4.0 * down).sin() * down
            + 0.10 * down * down * (PI * s).sin();
        // Gathered at the waist.
        let waist = 1.0 - 0.16 * (-((down - 0.55) / 0.28).powi(2)).exp();
        let x = (s - 0.5) * width * waist + 0.02 * (2.0 * a).cos();
        let hem = 0.03 * (a * 0.5).sin() * down;
        vec3(x, -down * drop + hem, z)
    };
    m.surface(cells[0], cells[1], |s, t| {
        (shape(s, t), vec2(s * width * 1.5, (1.0 - t) * drop))
    });
    m
}

/// A round medallion with a lion's head in relief, facing +z, of radius 1.
pub fn lion_medallion(cells: usize, relief: f32) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    let blob = |x: f32, y: f32, cx: f32, cy: f32, rx: f32, ry: f32| {
        let d = ((x - cx) / rx).powi(2) + ((y - cy) / ry).powi(2);
        (1.0 - d).max(0.0).sqrt()
    };
    let height = |x: f32, y: f32| {
        let r = (x * x + y * y).sqrt();
        let angle = x.atan2(y);
        let ax = x.abs();
        let rim = smoothstep(0.86, 0.89, r) - smoothstep(0.97, 1.0, r);
        // Mane: three rings of locks, each rotated against the previous one.
        let ring = ((r - 0.34) / 0.16).floor();
        let lock = (angle * (13.0 + 3.0 * ring) + ring * 2.0 + 5.0 * r)
            .sin()
            .abs();
        let mane =
            smoothstep(0.83, 0.78, r) * (0.16 + 0.30 * smoothstep(0.8, 0.3, r) + 0.11 * lock);
        let head = 0.52 * blob(x, y, 0.0, 0.0, 0.42, 0.5);
        let brow = 0.16 * blob(ax, y, 0.17, 0.20, 0.16, 0.08);
        let cheek = 0.18 * blob(ax, y, 0.20, -0.10, 0.18, 0.18);
        let nose = 0.34 * blob(x, y, 0.0, 0.02, 0.11, 0.30);
        let tip = 0.16 * blob(x, y, 0.0, -0.16, 0.12, 0.09);
        let muzzle = 0.34 * blob(ax, y, 0.09, -0.26, 0.17, 0.14);
        let chin = 0.26 * blob(x, y, 0.0, -0.43, 0.13, 0.09);
        let mouth = -0.14 * blob(ax, y, 0.07, -0.365, 0.14, 0.03);
        let eye = -0.16 * blob(ax, y, 0.17, 0.10, 0.085, 0.055)
            + 0.10 * blob(ax, y, 0.17, 0.10, 0.05, 0.04);
        let ear = 0.22 * blob(ax, y, 0.36, 0.40, 0.11, 0.13)
            - 0.10 * blob(ax, y, 0.36, 0.39, 0.055, 0.08);
        let face =
            head + brow + cheek * 0.6 + nose * 0.7 + tip + muzzle * 0.8 + chin * 0.7 + mouth + eye;
        mane.max(face).max(mane + ear) + 0.24 * rim
    };
    m.surface(cells, cells, |s, t| {
        // Maps the square to a disc, so that the lattice's rows follow the rim.
        let (a, b) = (2.0 * s - 1.0, 2.0 * t - 1.0);
        let x = a * (1.0 - 0.5 * b * b).sqrt();
        let y = b * (1.0 - 0.5 * a * a).sqrt();
        (vec3(x, y, relief * height(x, y)), vec2(x + 1.0, 1.0 - y))
    });
    m
}

/// One arching leaf from the origin along +x, rising: `length` x `width`, covered by the texture once.
pub fn arching_leaf(
    length: f32,
    width: f32,
    rise: f32,
    droop: f32,
    fold: f32,
    cells: [usize; 2],
) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    m.surface(cells[0], cells[1], |s, t| {
        let side = 2.0 * s - 1.0;
        let x = length * t * (1.0 - 0.18 * droop * t);
        let y = length * (rise * t - droop * t * t);
        let v_fold = fold * width * side.abs() * (PI * t).sin().max(0.0);
        (vec3(x, y + v_fold, side * width * 0.5), vec2(s, 1.0 - t))
    });
    m.orient(|_| Vec3::Y);
    m
}

/// Leaves around the y axis: `count` of them in whorls, from low and wide to high and steep.
pub fn rosette(
    count: usize,
    length: f32,
    width: f32,
    cells: [usize; 2],
    rng: &mut Rng,
) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    for i in 0..count {
        let t = i as f32 / count as f32;
        let steep = 0.35 + 1.2 * t + rng.jitter(0.15);
        let size = length * (1.0 - 0.35 * t) * rng.range(0.8, 1.1);
        let leaf = arching_leaf(
            size,
            width * size / length,
            steep,
            0.55 * steep + 0.25,
            0.12,
            cells,
        );
        let turn = Quat::from_rotation_y(2.4 * i as f32 + rng.jitter(0.3));
        m.merge(
            &leaf,
            Affine3A::from_rotation_translation(turn, Vec3::Y * 0.02 * t * length),
        );
    }
    m
}
