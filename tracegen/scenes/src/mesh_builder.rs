//! Triangle meshes from parametric surfaces, lathes, sweeps and boxes.
//!
//! Texture coordinates are in metres (u to the right, v downwards as seen from outside).
//! [`MeshBuilder::finish`] scales them by the material's tile size.

use glam::{Affine3A, Quat, Vec2, Vec3, vec2, vec3};
use scene::Mesh;
use scene::geometry::vertex_tangents;
use std::f32::consts::TAU;

/// A mesh under construction.
#[derive(Clone, Debug, Default)]
pub struct MeshBuilder {
    /// Positions, metres.
    pub positions: Vec<Vec3>,
    /// Normals, one per position.
    pub normals: Vec<Vec3>,
    /// Texture coordinates in metres (or 0..1 for sheets that show a texture once).
    pub uvs: Vec<Vec2>,
    /// Three indices per triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
}

/// A point of a lathe's or sweep's outline.
#[derive(Clone, Copy, Debug)]
pub struct Knot {
    /// Radius (lathe) or offset to the right (sweep), and height.
    pub at: Vec2,
    /// The surface has a sharp edge here.
    pub sharp: bool,
}

/// A smooth knot.
pub fn smooth(x: f32, y: f32) -> Knot {
    Knot {
        at: vec2(x, y),
        sharp: false,
    }
}

/// A knot with a sharp edge.
pub fn sharp(x: f32, y: f32) -> Knot {
    Knot {
        at: vec2(x, y),
        sharp: true,
    }
}

/// An outline as text: points `x,y` separated by spaces, those with a sharp edge marked by `!`.
///
/// # Panics
/// If a point has another form.
pub fn profile(points: &str) -> Vec<Knot> {
    scaled_profile(points, Vec2::ONE)
}

/// [`profile`] in units of `size`.
///
/// # Panics
/// If a point has another form.
pub fn scaled_profile(points: &str, size: Vec2) -> Vec<Knot> {
    points
        .split_whitespace()
        .map(|point| knot(point, size))
        .collect()
}

/// A point of a [`profile`] in units of `size`.
///
/// # Panics
/// If the point has another form.
pub fn knot(point: &str, size: Vec2) -> Knot {
    let number = |text: &str| text.parse::<f32>().expect("a coordinate is a number");
    let (x, y) = point
        .trim_end_matches('!')
        .split_once(',')
        .expect("a point is x,y");
    Knot {
        at: vec2(number(x), number(y)) * size,
        sharp: point.ends_with('!'),
    }
}

/// A solid of revolution; see [`MeshBuilder::lathe`].
pub fn lathed(profile: &[Knot], segments: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    m.lathe(profile, segments);
    m
}

/// A solid of revolution of a [`profile`].
pub fn turned(points: &str, segments: usize) -> MeshBuilder {
    lathed(&profile(points), segments)
}

/// A solid of revolution of a [`profile`] rounded by [`curve`].
pub fn rounded(points: &str, steps: usize, segments: usize) -> MeshBuilder {
    lathed(&curve(&profile(points), steps), segments)
}

/// Rounds a profile: `steps` points of a Catmull-Rom curve between each pair of smooth knots.
pub fn curve(knots: &[Knot], steps: usize) -> Vec<Knot> {
    let mut out = Vec::with_capacity(knots.len() * steps);
    for i in 0..knots.len().saturating_sub(1) {
        let (b, c) = (knots[i], knots[i + 1]);
        // A sharp knot ends the curve, so its outer neighbour is mirrored at it.
        let a = if i == 0 || b.sharp {
            b.at * 2.0 - c.at
        } else {
            knots[i - 1].at
        };
        let d = match knots.get(i + 2) {
            Some(next) if !c.sharp => next.at,
            _ => c.at * 2.0 - b.at,
        };
        out.push(b);
        for s in 1..steps {
            let t = s as f32 / steps as f32;
            let p = 0.5
                * (2.0 * b.at
                    + (c.at - a) * t
                    + (2.0 * a - 5.0 * b.at + 4.0 * c.at - d) * (t * t)
                    + (3.0 * b.at - a - 3.0 * c.at + d) * (t * t * t));
            out.push(Knot {
                at: p,
                sharp: false,
            });
        }
    }
    out.extend(knots.last());
    out
}

/// A profile split into runs between sharp knots, each point with its outward normal. For a profile
/// that goes up, outward is to the right.
fn smooth_runs(profile: &[Knot]) -> Vec<Vec<(Vec2, Vec2)>> {
    let normal = |a: Vec2, b: Vec2| {
        let d = b - a;
        vec2(d.y, -d.x).normalize_or_zero()
    };
    let mut runs = Vec::new();
    let mut start = 0;
    for end in 1..profile.len() {
        if end + 1 < profile.len() && !profile[end].sharp {
            continue;
        }
        let points = &profile[start..=end];
        let run = (0..points.len())
            .map(|i| {
                let before = (i > 0).then(|| normal(points[i - 1].at, points[i].at));
                let after = points.get(i + 1).map(|next| normal(points[i].at, next.at));
                let sum = before.unwrap_or(Vec2::ZERO) + after.unwrap_or(Vec2::ZERO);
                (points[i].at, sum.normalize_or(Vec2::X))
            })
            .collect();
        runs.push(run);
        start = end;
    }
    runs
}

/// A placement rotated about the vertical and scaled.
pub fn upright(position: Vec3, turn: f32, scale: f32) -> Affine3A {
    let turn = Quat::from_rotation_y(turn);
    Affine3A::from_scale_rotation_translation(Vec3::splat(scale), turn, position)
}

impl MeshBuilder {
    /// An empty mesh.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds one vertex.
    pub fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
        (self.positions.len() - 1) as u32
    }

    /// Adds one triangle.
    pub fn triangle(&mut self, a: u32, b: u32, c: u32) {
        self.indices.extend([a, b, c]);
    }

    /// Stitches a lattice of `columns` x `rows` vertices that starts at `first`, column fastest.
    fn stitch(&mut self, first: u32, columns: usize, rows: usize) {
        for j in 0..rows.saturating_sub(1) as u32 {
            for i in 0..columns.saturating_sub(1) as u32 {
                let a = first + j * columns as u32 + i;
                let (b, d) = (a + 1, a + columns as u32);
                let c = d + 1;
                self.indices.extend([a, b, c, a, c, d]);
            }
        }
    }

    /// A parametric surface over `nu` x `nv` cells of 0..1²; `surface` returns position and uv. The
    /// outside is where d/ds x d/dt points.
    pub fn surface(&mut self, nu: usize, nv: usize, surface: impl Fn(f32, f32) -> (Vec3, Vec2)) {
        let first = self.positions.len() as u32;
        let step = 2e-3;
        for j in 0..=nv {
            for i in 0..=nu {
                let (s, t) = (i as f32 / nu as f32, j as f32 / nv as f32);
                let slope = |s: f32, t: f32| {
                    let (s0, s1) = ((s - step).max(0.0), (s + step).min(1.0));
                    let (t0, t1) = ((t - step).max(0.0), (t + step).min(1.0));
                    let ds = surface(s1, t).0 - surface(s0, t).0;
                    let dt = surface(s, t1).0 - surface(s, t0).0;
                    ds.cross(dt).try_normalize()
                };
                // At a pole one derivative vanishes, so a nearby normal is used.
                let inward = |x: f32| x + (0.5 - x).signum() * 4.0 * step;
                let normal = slope(s, t)
                    .or_else(|| slope(s, inward(t)))
                    .or_else(|| slope(inward(s), t))
                    .unwrap_or(Vec3::Y);
                let (position, uv) = surface(s, t);
                self.vertex(position, normal, uv);
            }
        }
        self.stitch(first, nu + 1, nv + 1);
    }

    /// A flat parallelogram from `corner` along `right` and `up`; uv in metres from `uv0`.
    pub fn quad(&mut self, corner: Vec3, right: Vec3, up: Vec3, uv0: Vec2) {
        let normal = right.cross(up).normalize_or_zero();
        let (w, h) = (right.length(), up.length());
        let a = self.vertex(corner, normal, uv0);
        let b = self.vertex(corner + right, normal, uv0 + vec2(w, 0.0));
        let c = self.vertex(corner + right + up, normal, uv0 + vec2(w, -h));
        let d = self.vertex(corner + up, normal, uv0 + vec2(0.0, -h));
        self.indices.extend([a, b, c, a, c, d]);
    }

    /// [`Self::quad`] divided into `nu` x `nv` cells, as modellers divide floors and walls.
    pub fn panel(&mut self, corner: Vec3, right: Vec3, up: Vec3, nu: usize, nv: usize) {
        let normal = right.cross(up).normalize_or_zero();
        let (w, h) = (right.length(), up.length());
        let first = self.positions.len() as u32;
        for j in 0..=nv {
            for i in 0..=nu {
                let (s, t) = (i as f32 / nu as f32, j as f32 / nv as f32);
                // Centred, so that coordinates stay small on long walls.
                self.vertex(
                    corner + right * s + up * t,
                    normal,
                    vec2(w * (s - 0.5), h * (0.5 - t)),
                );
            }
        }
        self.stitch(first, nu + 1, nv + 1);
    }

    /// An axis-aligned box between two corners, its edges chamfered by `bevel` (0 for sharp edges).
    pub fn block(&mut self, a: Vec3, b: Vec3, bevel: f32) {
        let (low, high) = (a.min(b), a.max(b));
        let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let bevel = bevel.min(half.min_element() * 0.9);
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        let inner = half - Vec3::splat(bevel);
        for n in 0..3 {
            let (a, b) = if n == 1 {
                (2, 0)
            } else {
                ((n + 1) % 3, (n + 2) % 3)
            };
            for sign in [-1.0, 1.0] {
                // On the sides, up is y, so that bricks are horizontal.
                let (right, up) = if n == 1 {
                    (axes[b] * sign, -axes[a])
                } else {
                    (if n == 0 { -axes[2] } else { axes[0] } * sign, axes[1])
                };
                let extent = |axis: Vec3| (inner * axis).abs().element_sum();
                let corner =
                    center + axes[n] * (half[n] * sign) - right * extent(right) - up * extent(up);
                let uv0 = vec2(corner.dot(right), -corner.dot(up));
                self.quad(
                    corner,
                    right * (2.0 * extent(right)),
                    up * (2.0 * extent(up)),
                    uv0,
                );
            }
        }
        if bevel <= 0.0 {
            return;
        }
        for n in 0..3 {
            let (a, b) = ((n + 1) % 3, (n + 2) % 3);
            for (sa, sb) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
                let pa = axes[a] * (half[a] * sa) + axes[b] * (inner[b] * sb);
                let pb = axes[a] * (inner[a] * sa) + axes[b] * (half[b] * sb);
                let along = axes[n] * (-inner[n] * sa * sb);
                self.quad(center + pa - along, along * 2.0, pb - pa, Vec2::ZERO);
            }
        }
        for corner in 0..8 {
            let s = Vec3::from_array(std::array::from_fn(|i| {
                if corner >> i & 1 == 1 { 1.0 } else { -1.0 }
            }));
            let normal = s.normalize();
            let tip = |axis: usize| {
                let mut p = inner;
                p[axis] = half[axis];
                center + p * s
            };
            let order = if s.x * s.y * s.z > 0.0 {
                [0, 1, 2]
            } else {
                [0, 2, 1]
            };
            let v = order.map(|axis| {
                self.vertex(
                    tip(axis),
                    normal,
                    vec2(axis as f32, (axis * axis) as f32) * bevel,
                )
            });
            self.indices.extend(v);
        }
    }

    /// [`Self::block`], transformed.
    pub fn merge_block(&mut self, low: Vec3, high: Vec3, bevel: f32, transform: Affine3A) {
        let mut block = Self::new();
        block.block(low, high, bevel);
        self.merge(&block, transform);
    }

    /// Rotates `profile` (radius, height; outside to its right when it goes up) about the y axis.
    /// Points on the axis close the ends.
    pub fn lathe(&mut self, profile: &[Knot], segments: usize) {
        self.lathe_shaped(profile, segments, |_, _| 1.0);
    }

    /// [`Self::lathe`] with the radius scaled by `shape(angle, height)`: flutes, lobes, twists.
    pub fn lathe_shaped(
        &mut self,
        profile: &[Knot],
        segments: usize,
        shape: impl Fn(f32, f32) -> f32,
    ) {
        let widest = profile.iter().map(|k| k.at.x).fold(0.0, f32::max);
        // Whole metres around keep the texture's density. It need not be continuous at the seam in
        // the back.
        let around = TAU * widest;
        let mut length = 0.0;
        for run in smooth_runs(profile) {
            let first = self.positions.len() as u32;
            for (j, &(p, n)) in run.iter().enumerate() {
                if j > 0 {
                    length += p.distance(run[j - 1].0);
                }
                for i in 0..=segments {
                    let angle = TAU * (i % segments) as f32 / segments as f32;
                    let (sin, cos) = angle.sin_cos();
                    let r = p.x.max(0.0) * shape(angle, p.y);
                    let bend = (shape(angle + 1e-3, p.y) - shape(angle - 1e-3, p.y)) / 2e-3;
                    let (out, side) = (vec3(cos, 0.0, -sin), vec3(-sin, 0.0, -cos));
                    let slope = if p.x > 1e-6 {
                        bend * p.x / r.max(1e-6)
                    } else {
                        0.0
                    };
                    let normal = ((out - side * slope) * n.x + Vec3::Y * n.y).normalize_or(out);
                    let uv = vec2(around * i as f32 / segments as f32, -length);
                    self.vertex(vec3(r * cos, p.y, -r * sin), normal, uv);
                }
            }
            self.stitch(first, segments + 1, run.len());
        }
    }

    /// Sweeps a profile along frames (right x up = direction of travel); outside is to the right of
    /// the profile's direction, so a counter-clockwise outline is solid inside.
    pub fn sweep(&mut self, profile: &[Knot], path: &[SweepFrame]) {
        let mut across = 0.0;
        for run in smooth_runs(profile) {
            let first = self.positions.len() as u32;
            let mut lengths = Vec::with_capacity(run.len());
            for (i, point) in run.iter().enumerate() {
                if i > 0 {
                    across += point.0.distance(run[i - 1].0);
                }
                lengths.push(across);
            }
            let mut along = 0.0;
            for (j, frame) in path.iter().enumerate() {
                if j > 0 {
                    along += frame.origin.distance(path[j - 1].origin);
                }
                for (&(p, n), &across) in run.iter().zip(&lengths) {
                    let place = |v: Vec2| frame.right * v.x + frame.up * v.y;
                    self.vertex(
                        frame.origin + place(p * frame.scale),
                        place(n).normalize_or(Vec3::Y),
                        vec2(along, across),
                    );
                }
            }
            self.stitch(first, run.len(), path.len());
        }
    }

    /// A round tube along `points` with the radius at each, without caps.
    pub fn tube(&mut self, points: &[(Vec3, f32)], sides: usize) {
        let circle: Vec<Knot> = (0..=sides)
            .map(|i| {
                let (sin, cos) = (TAU * (i % sides) as f32 / sides as f32).sin_cos();
                smooth(cos, sin)
            })
            .collect();
        let frames = SweepFrame::along(points);
        let before = self.positions.len();
        self.sweep(&circle, &frames);
        // The sweep assumes an open outline. Around a circle the normals are the radii.
        for (i, normal) in self.normals[before..].iter_mut().enumerate() {
            let (frame, c) = (&frames[i / (sides + 1)], circle[i % (sides + 1)].at);
            *normal = frame.right * c.x + frame.up * c.y;
        }
    }

    /// A straight tube.
    pub fn rod(&mut self, from: Vec3, to: Vec3, radius: f32, sides: usize) {
        self.tube(&[(from, radius), (to, radius)], sides);
    }

    /// A closed tube through `point(sine, cosine)` of `cells` angles of a circle.
    pub fn ring(
        &mut self,
        [cells, sides]: [usize; 2],
        radius: f32,
        point: impl Fn(f32, f32) -> Vec3,
    ) {
        let points: Vec<(Vec3, f32)> = (0..=cells)
            .map(|i| {
                let (sin, cos) = (TAU * (i % cells) as f32 / cells as f32).sin_cos();
                (point(sin, cos), radius)
            })
            .collect();
        self.tube(&points, sides);
    }

    /// A box between two points, `width` thick in both directions.
    pub fn bar(&mut self, from: Vec3, to: Vec3, width: f32) {
        let h = width / 2.0;
        let rotation = Quat::from_rotation_arc(Vec3::Z, (to - from).normalize_or(Vec3::Z));
        let place = Affine3A::from_rotation_translation(rotation, from);
        self.merge_block(vec3(-h, -h, 0.0), vec3(h, h, from.distance(to)), 0.0, place);
    }

    /// A straight prism of a closed, counter-clockwise outline along +z.
    pub fn prism(&mut self, outline: &[Knot], length: f32) {
        let frame = |z: f32| SweepFrame {
            origin: Vec3::Z * z,
            right: Vec3::X,
            up: Vec3::Y,
            scale: 1.0,
        };
        self.sweep(outline, &[frame(0.0), frame(length)]);
    }

    /// An I-beam of a width, height and thickness along +z.
    pub fn beam(&mut self, length: f32, [w, h, t]: [f32; 3]) {
        let (x, y, s) = (w / 2.0, h / 2.0, t / 2.0);
        // A quarter of the outline; the others are its mirror images.
        let quarter = [(x, y), (x, y - t), (s, y - t)];
        let half = (quarter.iter().map(|(x, y)| sharp(*x, -y)))
            .chain(quarter.iter().rev().map(|(x, y)| sharp(*x, *y)));
        let right: Vec<Knot> = half.collect();
        let left = right.iter().rev().map(|k| sharp(-k.at.x, k.at.y));
        let outline: Vec<Knot> = [sharp(-x, -y)]
            .into_iter()
            .chain(right.iter().copied())
            .chain(left)
            .collect();
        self.prism(&outline, length);
    }

    /// Adds `other`.
    pub fn append(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.uvs.extend(other.uvs);
        self.indices
            .extend(other.indices.into_iter().map(|i| first + i));
    }

    /// Adds `other`, transformed.
    pub fn merge(&mut self, other: &Self, transform: Affine3A) {
        let first = self.positions.len() as u32;
        let normal_matrix = transform.matrix3.inverse().transpose();
        self.positions.extend(
            other
                .positions
                .iter()
                .map(|p| transform.transform_point3(*p)),
        );
        self.normals.extend(
            other
                .normals
                .iter()
                .map(|n| (normal_matrix * *n).normalize_or(Vec3::Y)),
        );
        self.uvs.extend_from_slice(&other.uvs);
        let mirrored = transform.matrix3.determinant() < 0.0;
        for t in other.indices.chunks_exact(3) {
            let t = if mirrored {
                [t[0], t[2], t[1]]
            } else {
                [t[0], t[1], t[2]]
            };
            self.indices.extend(t.map(|i| first + i));
        }
    }

    /// Reverses the surface so that it faces the other way.
    pub fn flip(&mut self) {
        for t in self.indices.chunks_exact_mut(3) {
            t.swap(1, 2);
        }
        for n in &mut self.normals {
            *n = -*n;
        }
    }

    /// Reverses the mesh if its normals, on the whole, point against `outside(position)`.
    pub fn orient(&mut self, outside: impl Fn(Vec3) -> Vec3) {
        let agreement: f32 = self
            .positions
            .iter()
            .zip(&self.normals)
            .map(|(p, n)| n.dot(outside(*p)))
            .sum();
        if agreement < 0.0 {
            self.flip();
        }
    }

    /// Drops vertices that no triangle uses.
    pub fn drop_unused(&mut self) {
        let mut renamed = vec![u32::MAX; self.positions.len()];
        let old = std::mem::take(self);
        for i in old.indices {
            let from = i as usize;
            if renamed[from] == u32::MAX {
                renamed[from] = self.vertex(old.positions[from], old.normals[from], old.uvs[from]);
            }
            self.indices.push(renamed[from]);
        }
    }

    /// The finished mesh: degenerate triangles dropped, tangents computed, uv divided by `tile_m`.
    pub fn finish(mut self, name: &str, material: usize, tile_m: f32) -> Mesh {
        for uv in &mut self.uvs {
            *uv /= tile_m;
        }
        let mut indices = Vec::with_capacity(self.indices.len());
        for t in self.indices.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| self.positions[i as usize]);
            let longest = (b - a)
                .length_squared()
                .max((c - b).length_squared())
                .max((a - c).length_squared());
            // Slivers whose area is below a ten-thousandth of their squared length would only
            // produce NaN.
            if (b - a).cross(c - a).length() > 1e-4 * longest {
                indices.extend_from_slice(t);
            }
        }
        self.indices = indices;
        let tangents = vertex_tangents(&self.positions, &self.normals, &self.uvs, &self.indices);
        Mesh {
            name: name.to_owned(),
            positions: self.positions,
            normals: self.normals,
            tangents,
            uv0: self.uvs,
            uv1: Vec::new(),
            colors: Vec::new(),
            indices: self.indices,
            material,
        }
    }
}

/// A position along a sweep.
#[derive(Clone, Copy, Debug)]
pub struct SweepFrame {
    /// Position of the profile's origin.
    pub origin: Vec3,
    /// Direction of the profile's x.
    pub right: Vec3,
    /// Direction of the profile's y.
    pub up: Vec3,
    /// Size of the profile here.
    pub scale: f32,
}

impl SweepFrame {
    /// Frames along a polyline with minimal twist.
    pub fn along(points: &[(Vec3, f32)]) -> Vec<Self> {
        let direction = |i: usize| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(points.len() - 1));
            (points[b].0 - points[a].0).normalize_or(Vec3::Y)
        };
        let mut up = direction(0).any_orthonormal_vector();
        (0..points.len())
            .map(|i| {
                let d = direction(i);
                up = (up - d * up.dot(d)).normalize_or(d.any_orthonormal_vector());
                Self {
                    origin: points[i].0,
                    right: up.cross(d),
                    up,
                    scale: points[i].1,
                }
            })
            .collect()
    }
}
