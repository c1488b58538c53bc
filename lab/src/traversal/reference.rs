//! Independent results for checking the traversal: closed test meshes and brute force.
//!
//! The `f64` reference shares no code with the traversal. It decides with signed volumes in double
//! precision whether a line passes through a triangle, on the mesh as given (before it is recentred
//! and rounded to `f32`). Its answers are exact except for rays that graze a silhouette more
//! closely than the rounding of the `f32` mesh, which are [`Verdict::Borderline`].

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

    /// The mesh, translated.
    pub fn translated(&self, by: DVec3) -> Self {
        Self {
            name: self.name,
            vertices: self.vertices.iter().map(|v| *v + by).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Midpoint of the bounds, about which the mesh is recentred.
    pub fn center(&self) -> DVec3 {
        let lo = self.vertices.iter().copied().reduce(DVec3::min);
        let hi = self.vertices.iter().copied().reduce(DVec3::max);
        (lo.unwrap_or_default() + hi.unwrap_or_default()) / 2.0
    }

    /// The mesh in the traversal's input format: relative to `origin` and rounded.
    pub fn rounded(&self, origin: DVec3) -> Vec<[[f32; 3]; 3]> {
        (0..self.triangles.len())
            .map(|t| self.corners(t).map(|v| (v - origin).as_vec3().to_array()))
            .collect()
    }
}

/// The reference's answer for a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Hits at this distance, within the tolerance that follows from rounding the mesh. The
    /// distance is `None` if a nearer triangle is only grazed.
    Hit(Option<(f64, f64)>),
    /// Misses all triangles.
    Miss,
    /// The answer depends on less than the `f32` mesh's rounding.
    Borderline,
}

/// The triangles of a mesh with their bounding spheres, to find those near a line.
pub struct Reference<'a> {
    mesh: &'a TestMesh,
    spheres: Vec<(DVec3, f64)>,
}

impl<'a> Reference<'a> {
    /// Prepares a mesh.
    pub fn new(mesh: &'a TestMesh) -> Self {
        let spheres = (0..mesh.triangles.len())
            .map(|t| {
                let v = mesh.corners(t);
                let center = (v[0] + v[1] + v[2]) / 3.0;
                let radius = v.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
                (center, radius)
            })
            .collect();
        Self { mesh, spheres }
    }

    /// The answer for a ray of unlimited length.
    ///
    /// `tolerance` is the displacement, in the mesh's units, that rounding may cause.
    pub fn verdict(&self, origin: DVec3, direction: DVec3, tolerance: f64) -> Verdict {
        let near = self.near(origin, direction.normalize(), tolerance);
        let nearest = near.hits().min_by(f64::total_cmp);
        match nearest {
            // A hit that only grazes the mesh: the rounded mesh may miss it.
            Some(_) if near.grazes_silhouette() => {
                if near.hits_inside() {
                    Verdict::Hit(None)
                } else {
                    Verdict::Borderline
                }
            }
            Some(t) => Verdict::Hit(Some((t, near.shift()))),
            None if near.is_borderline() => Verdict::Borderline,
            None => Verdict::Miss,
        }
    }

    fn near(&self, origin: DVec3, direction: DVec3, tolerance: f64) -> Near {
        let may_pass = |(center, radius): &(DVec3, f64)| {
            let to = *center - origin;
            let reach = radius * 1.000_001 + tolerance;
            let along = to.dot(direction);
            // The relative error of the difference of squares is at most about 1e-13.
            to.length_squared() * (1.0 - 1e-12) - along * along <= reach * reach
        };
        let triangles = self
            .spheres
            .iter()
            .enumerate()
            .filter(|(_, sphere)| may_pass(sphere))
            .map(|(t, _)| {
                let corners = self.mesh.corners(t).map(|v| v - origin);
                Candidate::new(self.mesh.triangles[t], corners, direction)
            })
            .collect();
        Near {
            triangles,
            direction,
            tolerance,
        }
    }
}

/// A triangle relative to a ray's origin.
struct Candidate {
    index: [u32; 3],
    corners: [DVec3; 3],
    /// Signed volumes of the line with each edge.
    volumes: [f64; 3],
    /// Cosine between normal and line.
    slope: f64,
    /// Distance at which the line meets the plane.
    distance: f64,
}

impl Candidate {
    fn new(index: [u32; 3], corners: [DVec3; 3], direction: DVec3) -> Self {
        // In ascending order of vertices, so that neighbours get identical bits.
        let volumes = [(1, 2), (2, 0), (0, 1)].map(|(p, q)| {
            if index[p] < index[q] {
                corners[p].cross(corners[q]).dot(direction)
            } else {
                -corners[q].cross(corners[p]).dot(direction)
            }
        });
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let slope = normal.dot(direction);
        Self {
            index,
            corners,
            volumes,
            slope,
            distance: normal.dot(a) / slope,
        }
    }

    /// True if the line passes through the triangle, including its edges.
    fn covers(&self) -> bool {
        let v = &self.volumes;
        (v.iter().all(|x| *x >= 0.0) || v.iter().all(|x| *x <= 0.0)) && self.slope != 0.0
    }

    /// Distance of the ray's origin from the plane, negative if the plane lies behind it.
    fn height(&self) -> f64 {
        self.distance * self.slope.abs()
    }

    /// True if the line passes an edge within the tolerance.
    fn edge_near(&self, direction: DVec3, tolerance: f64) -> bool {
        // Projected along the line, the line becomes a point. This gives its distance from each
        // edge.
        let flat = self.corners.map(|p| p - direction * p.dot(direction));
        (0..3).any(|i| {
            let (p, q) = (flat[i], flat[(i + 1) % 3]);
            let along = q - p;
            let length2 = along.length_squared();
            let s = if length2 > 0.0 {
                (-p.dot(along) / length2).clamp(0.0, 1.0)
            } else {
                0.0
            };
            (p + along * s).length() < tolerance
        })
    }
}

/// The triangles near a ray's line.
struct Near {
    triangles: Vec<Candidate>,
    direction: DVec3,
    tolerance: f64,
}

impl Near {
    fn hits(&self) -> impl Iterator<Item = f64> {
        self.triangles
            .iter()
            .filter(|t| t.covers() && t.height() > self.tolerance)
            .map(|t| t.distance)
    }

    /// Whether the ray starts on a triangle, or passes just outside a triangle in front of it.
    fn is_borderline(&self) -> bool {
        self.triangles.iter().any(|t| {
            if t.covers() {
                return t.height().abs() <= self.tolerance;
            }
            let ahead = t.corners.iter().any(|p| p.dot(self.direction) > 0.0);
            ahead && t.edge_near(self.direction, self.tolerance)
        })
    }

    /// Shift of a hit along the line if its triangle moves by the tolerance: the tolerance divided
    /// by the cosine of the most slanted triangle that the line may hit.
    fn shift(&self) -> f64 {
        self.triangles
            .iter()
            .filter(|t| t.covers() || t.edge_near(self.direction, self.tolerance))
            .map(|t| self.tolerance / t.slope.abs())
            .fold(0.0, f64::max)
    }

    /// True if the line passes within the tolerance of an edge between a front and a back face.
    fn grazes_silhouette(&self) -> bool {
        let mut facing = std::collections::BTreeMap::<_, Vec<f64>>::new();
        let edge_near = |t: &&Candidate| t.edge_near(self.direction, self.tolerance);
        for t in self.triangles.iter().filter(edge_near) {
            for i in 0..3 {
                let (p, q) = (t.index[i], t.index[(i + 1) % 3]);
                facing
                    .entry((p.min(q), p.max(q)))
                    .or_default()
                    .push(t.slope);
            }
        }
        facing
            .values()
            .any(|s| s.len() == 2 && (s[0] * s[1] <= 0.0 || s[0].abs().min(s[1].abs()) < 1e-6))
    }

    /// Whether the line passes through a triangle at a distance of more than the tolerance from its
    /// edges.
    fn hits_inside(&self) -> bool {
        self.triangles.iter().any(|t| {
            let clear = !t.edge_near(self.direction, self.tolerance);
            t.covers() && t.height() > self.tolerance && clear
        })
    }
}

/// A small seeded generator.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Uniform index below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (f64::from(self.unit()) * n as f64) as usize % n.max(1)
    }

    /// A point in the unit ball.
    pub fn in_ball(&mut self) -> Vec3 {
        loop {
            let p = Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0;
            if p.length_squared() <= 1.0 {
                return p;
            }
        }
    }
}
