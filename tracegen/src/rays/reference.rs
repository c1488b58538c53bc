//! Independent answers for the traversal: closed test meshes and brute force.
//!
//! The `f64` reference shares no code with the traversal. Whether a line passes through a triangle
//! is decided by signed volumes in double precision on the mesh as given (before it is recentred
//! and rounded to `f32`), so its answers are exact but for rays that graze a silhouette closer
//! than the rounding of the `f32` mesh; those it calls [`Verdict::Borderline`].

use super::ray::{PreparedRay, Ray};
use glam::{DVec3, Vec3};

/// A mesh in world space and double precision.
pub struct TestMesh {
    /// Name.
    pub name: &'static str,
    /// Vertices.
    pub vertices: Vec<DVec3>,
    /// Triangles, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TestMesh {
    /// An icosahedron split `levels` times, radius 10.
    #[must_use]
    pub fn sphere(levels: u32) -> Self {
        let g = (1.0 + 5f64.sqrt()) / 2.0;
        let mut vertices: Vec<DVec3> = [
            [-1.0, g, 0.0],
            [1.0, g, 0.0],
            [-1.0, -g, 0.0],
            [1.0, -g, 0.0],
            [0.0, -1.0, g],
            [0.0, 1.0, g],
            [0.0, -1.0, -g],
            [0.0, 1.0, -g],
            [g, 0.0, -1.0],
            [g, 0.0, 1.0],
            [-g, 0.0, -1.0],
            [-g, 0.0, 1.0],
        ]
        .map(|v| DVec3::from(v).normalize() * 10.0)
        .to_vec();
        let mut triangles: Vec<[u32; 3]> = vec![
            [0, 11, 5],
            [0, 5, 1],
            [0, 1, 7],
            [0, 7, 10],
            [0, 10, 11],
            [1, 5, 9],
            [5, 11, 4],
            [11, 10, 2],
            [10, 7, 6],
            [7, 1, 8],
            [3, 9, 4],
            [3, 4, 2],
            [3, 2, 6],
            [3, 6, 8],
            [3, 8, 9],
            [4, 9, 5],
            [2, 4, 11],
            [6, 2, 10],
            [8, 6, 7],
            [9, 8, 1],
        ];
        for _ in 0..levels {
            let mut middles = std::collections::BTreeMap::new();
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let m = (vertices[a as usize] + vertices[b as usize]).normalize() * 10.0;
                    vertices.push(m);
                    vertices.len() as u32 - 1
                })
            };
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                    [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
                })
                .collect();
        }
        Self {
            name: "sphere",
            vertices,
            triangles,
        }
    }

    /// A box whose faces are grids of axis-aligned triangles: flat slabs and long shared edges.
    #[must_use]
    pub fn grid_box(cells: u32) -> Self {
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        let mut numbers = std::collections::BTreeMap::new();
        let n = i64::from(cells);
        let mut vertex = |p: [i64; 3]| {
            *numbers.entry(p).or_insert_with(|| {
                vertices.push(DVec3::from(p.map(|x| x as f64 / n as f64 * 14.2 - 7.1)));
                vertices.len() as u32 - 1
            })
        };
        for axis in 0..3 {
            for side in [0, n] {
                for i in 0..n {
                    for j in 0..n {
                        let mut at = |di: i64, dj: i64| {
                            let mut p = [0; 3];
                            p[axis] = side;
                            p[(axis + 1) % 3] = i + di;
                            p[(axis + 2) % 3] = j + dj;
                            vertex(p)
                        };
                        let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                        if side == 0 {
                            triangles.extend([[a, c, b], [a, d, c]]);
                        } else {
                            triangles.extend([[a, b, c], [a, c, d]]);
                        }
                    }
                }
            }
        }
        Self {
            name: "box",
            vertices,
            triangles,
        }
    }

    /// A torus of long thin triangles: saddle curvature and self-occlusion.
    #[must_use]
    pub fn torus(around: u32, across: u32) -> Self {
        let turn = std::f64::consts::TAU;
        let vertices = (0..around * across)
            .map(|k| {
                let a = f64::from(k / across) / f64::from(around) * turn;
                let b = f64::from(k % across) / f64::from(across) * turn;
                let r = 7.0 + 2.5 * b.cos();
                DVec3::new(r * a.cos(), 2.5 * b.sin(), -r * a.sin())
            })
            .collect();
        let at = |i: u32, j: u32| (i % around) * across + j % across;
        let triangles = (0..around * across)
            .flat_map(|k| {
                let (i, j) = (k / across, k % across);
                let (a, b) = (at(i, j), at(i + 1, j));
                let (c, d) = (at(i + 1, j + 1), at(i, j + 1));
                [[a, b, c], [a, c, d]]
            })
            .collect();
        Self {
            name: "torus",
            vertices,
            triangles,
        }
    }

    /// The same mesh elsewhere.
    #[must_use]
    pub fn translated(&self, by: DVec3) -> Self {
        Self {
            name: self.name,
            vertices: self.vertices.iter().map(|v| *v + by).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Corners of a triangle.
    #[must_use]
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Midpoint of the bounds: where the mesh is recentred to.
    #[must_use]
    pub fn center(&self) -> DVec3 {
        let lo = self.vertices.iter().copied().reduce(DVec3::min);
        let hi = self.vertices.iter().copied().reduce(DVec3::max);
        (lo.unwrap_or_default() + hi.unwrap_or_default()) / 2.0
    }

    /// The mesh as the traversal gets it: relative to `origin` and rounded.
    #[must_use]
    pub fn rounded(&self, origin: DVec3) -> Vec<[[f32; 3]; 3]> {
        (0..self.triangles.len())
            .map(|t| self.corners(t).map(|v| (v - origin).as_vec3().to_array()))
            .collect()
    }
}

/// What the reference says of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Hits at this distance, or at an unsure one where a nearer triangle is only grazed.
    Hit(Option<f64>),
    /// Misses.
    Miss,
    /// The answer hangs on less than the `f32` mesh's rounding.
    Borderline,
}

/// The `f64` reference for a ray without an end.
///
/// `tolerance` is the displacement, in the mesh's units, that rounding may cause.
#[must_use]
pub fn brute_force_f64(
    mesh: &TestMesh,
    origin: DVec3,
    direction: DVec3,
    tolerance: f64,
) -> Verdict {
    let direction = direction.normalize();
    let mut nearest: Option<f64> = None;
    let mut doubtful = false;
    for t in 0..mesh.triangles.len() {
        let index = mesh.triangles[t];
        let [a, b, c] = mesh.corners(t).map(|v| v - origin);
        if far_from_line(&[a, b, c], direction, tolerance) {
            continue;
        }
        // Volume with the vertices in ascending order: neighbours get the same bits.
        let edge = |p: DVec3, q: DVec3, ip: u32, iq: u32| {
            if ip < iq {
                p.cross(q).dot(direction)
            } else {
                -q.cross(p).dot(direction)
            }
        };
        let volumes = [
            edge(b, c, index[1], index[2]),
            edge(c, a, index[2], index[0]),
            edge(a, b, index[0], index[1]),
        ];
        let inside = volumes.iter().all(|v| *v >= 0.0) || volumes.iter().all(|v| *v <= 0.0);
        let normal = (b - a).cross(c - a);
        let slope = normal.dot(direction);
        let distance = normal.dot(a) / slope;
        // Distance from the line to the nearest edge line, as the volumes see it.
        let clearance = [(b, c), (c, a), (a, b)]
            .iter()
            .zip(volumes)
            .map(|((p, q), v)| {
                let side = (*q - *p).cross(direction).length();
                if side > 0.0 {
                    v.abs() / side
                } else {
                    f64::INFINITY
                }
            })
            .fold(f64::INFINITY, f64::min);
        let ahead = a.dot(direction).max(b.dot(direction)).max(c.dot(direction)) > 0.0;
        if inside && slope != 0.0 {
            if distance > tolerance {
                nearest = Some(nearest.map_or(distance, |n| n.min(distance)));
            } else if distance > -tolerance {
                doubtful = true;
            }
        } else if ahead && clearance < tolerance && near_triangle(&[a, b, c], direction, tolerance)
        {
            // Just outside this triangle; harmless when a neighbour covers the line.
            doubtful = true;
        }
    }
    match nearest {
        // A hit that only grazes: covered here, but the rounded mesh may shrink away from it.
        Some(_) if grazes_silhouette(mesh, origin, direction, tolerance) => {
            if interior_hits(mesh, origin, direction, tolerance) {
                Verdict::Hit(None)
            } else {
                Verdict::Borderline
            }
        }
        Some(t) => Verdict::Hit(Some(t)),
        None if doubtful => Verdict::Borderline,
        None => Verdict::Miss,
    }
}

/// True where the line misses even the sphere about a triangle.
fn far_from_line(v: &[DVec3; 3], direction: DVec3, tolerance: f64) -> bool {
    let center = (v[0] + v[1] + v[2]) / 3.0;
    let radius = v.iter().map(|p| (*p - center).length()).fold(0.0, f64::max);
    let across = center - direction * center.dot(direction);
    across.length() > radius * 1.000_001 + tolerance
}

fn near_triangle(v: &[DVec3; 3], direction: DVec3, tolerance: f64) -> bool {
    // Project along the ray: distance of the origin from the triangle in the plane across it.
    let flat = v.map(|p| p - direction * p.dot(direction));
    (0..3).any(|i| {
        let (p, q) = (flat[i], flat[(i + 1) % 3]);
        let along = q - p;
        let s = if along.length_squared() > 0.0 {
            (-p.dot(along) / along.length_squared()).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (p + along * s).length() < tolerance
    })
}

/// True where the line passes within the tolerance of an edge between a front and a back face.
fn grazes_silhouette(mesh: &TestMesh, origin: DVec3, direction: DVec3, tolerance: f64) -> bool {
    let mut facing = std::collections::BTreeMap::new();
    for (t, index) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(t).map(|v| v - origin);
        if far_from_line(&corners, direction, tolerance)
            || !near_triangle(&corners, direction, tolerance)
        {
            continue;
        }
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let slope = normal.dot(direction) / normal.length();
        for i in 0..3 {
            let (p, q) = (index[i], index[(i + 1) % 3]);
            let key = (p.min(q), p.max(q));
            let entry: &mut Vec<f64> = facing.entry(key).or_default();
            entry.push(slope);
        }
    }
    facing
        .values()
        .any(|s| s.len() == 2 && (s[0] * s[1] <= 0.0 || s[0].abs().min(s[1].abs()) < 1e-6))
}

/// True where the line passes through a triangle at more than the tolerance from its edges.
fn interior_hits(mesh: &TestMesh, origin: DVec3, direction: DVec3, tolerance: f64) -> bool {
    (0..mesh.triangles.len()).any(|t| {
        let v = mesh.corners(t).map(|v| v - origin);
        if far_from_line(&v, direction, tolerance) {
            return false;
        }
        let volumes = [(1, 2), (2, 0), (0, 1)].map(|(p, q)| v[p].cross(v[q]).dot(direction));
        let inside = volumes.iter().all(|x| *x > 0.0) || volumes.iter().all(|x| *x < 0.0);
        let normal = (v[1] - v[0]).cross(v[2] - v[0]);
        let distance = normal.dot(v[0]) / normal.dot(direction);
        inside && distance > tolerance && !near_triangle(&v, direction, tolerance)
    })
}

/// The traversal's answer without a tree: every triangle by the traversal's own tests.
#[must_use]
pub fn brute_force_f32(
    triangles: &[[[f32; 3]; 3]],
    bounds: (Vec3, Vec3),
    ray: &Ray,
) -> Option<(f32, u32)> {
    let prepared = PreparedRay::new(ray, bounds);
    triangles
        .iter()
        .zip(0u32..)
        .filter(|(v, _)| prepared.line_hits(v))
        .filter_map(|(v, i)| prepared.distance(v).map(|t| (t, i)))
        .reduce(|a, b| if b < a { b } else { a })
}
