//! A scene as one list of world-space triangles, with the mesh of each.

use crate::bvh::Placement;
use glam::{DAffine3, DVec3, Mat3, Vec2, Vec3, Vec4};
use scene::{Mesh, Scene};

/// All triangles of all instances, in submission order, relative to `origin`.
pub struct Soup {
    /// World position that the triangles are relative to: the middle of the scene's bounds, which
    /// minimises rounding to `f32`.
    pub origin: DVec3,
    /// Vertices, counter-clockwise from the front. Empty where triangles are moved when they are
    /// asked for.
    pub triangles: Vec<[[f32; 3]; 3]>,
    /// Where each object (instance) is.
    pub placements: Vec<Placement>,
    /// Object of each triangle; empty with `triangles`.
    objects: Vec<u32>,
    /// First triangle of each object, and the number of all.
    first_of_object: Vec<u32>,
    /// Inverse transpose of each object's transform.
    normal_matrices: Vec<Mat3>,
}

/// Attributes at a point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attributes {
    /// Unit normal of the triangle's front side, computed from its vertices.
    pub geometric_normal: Vec3,
    /// Unit interpolated normal, or the geometric one if the mesh has no valid normal.
    pub shading_normal: Vec3,
    /// Interpolated tangent in the world, with the bitangent's sign in w.
    pub tangent: Vec4,
    /// Texture coordinates of both sets.
    pub uv: [Vec2; 2],
    /// Linear vertex colour with alpha; white where the mesh has none.
    pub color: Vec4,
    /// Area of the triangle in each texture set divided by its area in the world.
    pub uv_density: [f32; 2],
}

impl Soup {
    /// Flattens a scene. Positions are transformed and recentred in `f64`.
    ///
    /// # Panics
    /// There are 2^32 triangles or more.
    pub fn new(scene: &Scene) -> Self {
        let mut soup = Self::of_instances(scene);
        let mut moved: Vec<[f32; 3]> = Vec::new();
        for (object, placement) in (0u32..).zip(&soup.placements) {
            let mesh = &scene.meshes[placement.mesh];
            moved.clear();
            let positions = mesh.positions.iter();
            moved.extend(positions.map(|p| placement.point(soup.origin, p.to_array())));
            for triangle in 0..mesh.triangles() {
                let corners = corners(mesh, triangle, placement.mirrored);
                soup.triangles.push(corners.map(|v| moved[v]));
                soup.objects.push(object);
            }
        }
        soup
    }

    /// [`Self::new`] without a list of the triangles.
    ///
    /// # Panics
    /// There are 2^32 triangles or more.
    pub fn of_instances(scene: &Scene) -> Self {
        let placed = scene.instances.iter().map(|i| Placement {
            mesh: i.mesh,
            transform: DAffine3 {
                matrix3: i.transform.matrix3.as_dmat3(),
                translation: i.transform.translation.as_dvec3(),
            },
            mirrored: i.mirrored(),
        });
        let placements: Vec<Placement> = placed.collect();
        let world = || {
            placements.iter().flat_map(|at| {
                let positions = scene.meshes[at.mesh].positions.iter();
                positions.map(|p| at.transform.transform_point3(p.as_dvec3()))
            })
        };
        let bounds = world()
            .filter(|p| p.is_finite())
            .map(|p| (p, p))
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let mut first_of_object = vec![0u32];
        for (object, placement) in placements.iter().enumerate() {
            let triangles = scene.meshes[placement.mesh].triangles() as u32;
            let end = first_of_object[object].checked_add(triangles);
            first_of_object.push(end.expect("numbers of 32 bits"));
        }
        Self {
            origin: bounds.map_or(DVec3::ZERO, |(lo, hi)| (lo + hi) / 2.0),
            triangles: Vec::new(),
            placements,
            objects: Vec::new(),
            first_of_object,
            normal_matrices: (scene.instances.iter())
                .map(scene::Instance::normal_matrix)
                .collect(),
        }
    }

    /// Number of triangles.
    pub fn count(&self) -> usize {
        self.first_of_object.last().copied().unwrap_or_default() as usize
    }

    /// Object (instance) of a primitive.
    pub fn object(&self, primitive: u32) -> u32 {
        (self.objects.get(primitive as usize).copied()).unwrap_or_else(|| {
            let behind = self
                .first_of_object
                .partition_point(|first| *first <= primitive);
            behind as u32 - 1
        })
    }

    /// Vertices of a primitive.
    pub fn triangle(&self, scene: &Scene, primitive: u32) -> [[f32; 3]; 3] {
        if let Some(triangle) = self.triangles.get(primitive as usize) {
            return *triangle;
        }
        let (mesh, _, corners) = self.corners(scene, primitive);
        let placement = &self.placements[self.object(primitive) as usize];
        corners.map(|v| placement.point(self.origin, mesh.positions[v].to_array()))
    }

    /// Mesh, object and vertex numbers of a primitive.
    fn corners<'a>(&self, scene: &'a Scene, primitive: u32) -> (&'a Mesh, usize, [usize; 3]) {
        let object = self.object(primitive) as usize;
        let mesh = &scene.meshes[scene.instances[object].mesh];
        let triangle = (primitive - self.first_of_object[object]) as usize;
        let corners = corners(mesh, triangle, self.placements[object].mirrored);
        (mesh, object, corners)
    }

    /// Attributes of a primitive at the weights of its second and third vertex.
    pub fn attributes(&self, scene: &Scene, primitive: u32, bary: [f32; 2]) -> Attributes {
        let (mesh, object, corners) = self.corners(scene, primitive);
        let weights = [1.0 - bary[0] - bary[1], bary[0], bary[1]];

        let [a, b, c] = self.triangle(scene, primitive).map(Vec3::from);
        let cross = (b - a).as_dvec3().cross((c - a).as_dvec3());
        let geometric_normal = cross.normalize_or_zero().as_vec3();
        let interpolated: Vec3 = (0..3)
            .map(|i| weights[i] * mesh.normals.get(corners[i]).copied().unwrap_or_default())
            .sum();
        let shading = (self.normal_matrices[object] * interpolated).normalize_or_zero();
        let shading_normal = if shading == Vec3::ZERO || !shading.is_finite() {
            geometric_normal
        } else {
            shading
        };
        let tangent: Vec4 = (0..3)
            .map(|i| weights[i] * mesh.tangents.get(corners[i]).copied().unwrap_or_default())
            .sum();
        let linear = scene.instances[object].transform.matrix3;
        let tangent = (linear * tangent.truncate()).extend(tangent.w);
        let area = cross.length() as f32;
        let set = |uvs: &[Vec2]| {
            let [p, q, r] = corners.map(|v| uvs.get(v).copied().unwrap_or_default());
            let uv = p * weights[0] + q * weights[1] + r * weights[2];
            let uv_area = (q - p).perp_dot(r - p).abs();
            (uv, if area > 0.0 { uv_area / area } else { 0.0 })
        };
        let (uv0, density0) = set(&mesh.uv0);
        let (uv1, density1) = set(&mesh.uv1);
        Attributes {
            geometric_normal,
            shading_normal,
            tangent,
            uv: [uv0, uv1],
            color: color(mesh, corners, weights),
            uv_density: [density0, density1],
        }
    }

    /// Only the texture coordinates, for an alpha test.
    pub fn uv(&self, scene: &Scene, primitive: u32, bary: [f32; 2], set: u32) -> Vec2 {
        let (mesh, _, corners) = self.corners(scene, primitive);
        let uvs = if set == 0 { &mesh.uv0 } else { &mesh.uv1 };
        let [p, q, r] = corners.map(|v| uvs.get(v).copied().unwrap_or_default());
        p * (1.0 - bary[0] - bary[1]) + q * bary[0] + r * bary[1]
    }

    /// Alpha of the vertex colour; 1 where the mesh has none.
    pub fn vertex_alpha(&self, scene: &Scene, primitive: u32, bary: [f32; 2]) -> f32 {
        let (mesh, _, corners) = self.corners(scene, primitive);
        if mesh.colors.is_empty() {
            return 1.0;
        }
        color(mesh, corners, [1.0 - bary[0] - bary[1], bary[0], bary[1]]).w
    }

    /// Material of a primitive.
    pub fn material(&self, scene: &Scene, primitive: u32) -> usize {
        let object = self.object(primitive) as usize;
        scene.meshes[scene.instances[object].mesh].material
    }
}

/// Vertex numbers of a triangle, counter-clockwise seen from its front in the world.
fn corners(mesh: &Mesh, triangle: usize, mirrored: bool) -> [usize; 3] {
    let at = |i: usize| mesh.indices[triangle * 3 + i] as usize;
    if mirrored {
        [at(0), at(2), at(1)]
    } else {
        [at(0), at(1), at(2)]
    }
}

/// The weighted mean of the vertex colours of three corners.
fn color(mesh: &Mesh, corners: [usize; 3], weights: [f32; 3]) -> Vec4 {
    if mesh.colors.is_empty() {
        return Vec4::ONE;
    }
    (corners.into_iter().zip(weights))
        .map(|(v, weight)| mesh.colors.get(v).copied().unwrap_or(Vec4::ONE) * weight)
        .sum()
}
