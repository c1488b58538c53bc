//! A mesh whose vertices move: at rest, and at a time.

use super::morph::{Target, morphed};
use super::skin::{Influences, PosedSkin, normal_matrix};
use crate::Mesh;
use crate::geometry::complete_vertices;
use glam::{DMat3, DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// Vertices that one task moves at least.
const VERTICES_A_TASK: usize = 1024;

/// What moves the vertices of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Movers {
    pub targets: Vec<Target>,
    pub influences: Option<Influences>,
}

impl Movers {
    /// Drops the vertices without a flag.
    pub fn keep(&mut self, used: &[bool]) {
        for target in &mut self.targets {
            target.keep(used);
        }
        if let Some(influences) = &mut self.influences {
            influences.keep(used);
        }
    }
}

/// A mesh as its file has it.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    positions: Vec<Vec3>,
    /// Empty where the file has none: they follow from each pose.
    normals: Vec<Vec3>,
    /// As `normals`.
    tangents: Vec<Vec4>,
    movers: Movers,
    /// Texture coordinates of the normal map, if the material has one.
    normal_map_uv: Option<u32>,
}

/// A vertex at a time; zero for what the file does not have.
struct Vertex {
    position: Vec3,
    normal: Vec3,
    tangent: Vec4,
}

impl Shape {
    /// The shape of a mesh that holds what its file has and nothing else.
    pub fn new(mesh: &Mesh, movers: Movers, normal_map_uv: Option<u32>) -> Self {
        Self {
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            tangents: mesh.tangents.clone(),
            movers,
            normal_map_uv,
        }
    }

    /// Whether a skin moves its vertices.
    pub fn is_skinned(&self) -> bool {
        self.movers.influences.is_some()
    }

    /// Moves the vertices of `mesh` to where they are with these weights of the morph targets and this skin,
    /// relative to `own`.
    pub fn pose(&self, mesh: &mut Mesh, weights: &[f64], skin: Option<&PosedSkin>, own: DVec3) {
        let vertices: Vec<Vertex> = (0..self.positions.len())
            .into_par_iter()
            .with_min_len(VERTICES_A_TASK)
            .map(|vertex| self.vertex(vertex, weights, skin, own))
            .collect();
        mesh.positions = vertices.iter().map(|v| v.position).collect();
        mesh.normals = match self.normals.is_empty() {
            true => Vec::new(),
            false => vertices.iter().map(|v| v.normal).collect(),
        };
        mesh.tangents = match self.tangents.is_empty() {
            true => Vec::new(),
            false => vertices.iter().map(|v| v.tangent).collect(),
        };
        complete_vertices(mesh, self.normal_map_uv);
    }

    fn vertex(
        &self,
        vertex: usize,
        weights: &[f64],
        skin: Option<&PosedSkin>,
        own: DVec3,
    ) -> Vertex {
        let Movers {
            targets,
            influences,
        } = &self.movers;
        let rest = self.positions[vertex].as_dvec3();
        let mut position = morphed(rest, targets, weights, vertex, |t| &t.positions);
        let mut normal = self.normals.get(vertex).map_or(DVec3::ZERO, |normal| {
            morphed(normal.as_dvec3(), targets, weights, vertex, |t| &t.normals)
        });
        let (mut tangent, sign) = self.tangents.get(vertex).map_or((DVec3::ZERO, 0.0), |t| {
            let rest = t.truncate().as_dvec3();
            (
                morphed(rest, targets, weights, vertex, |t| &t.tangents),
                t.w,
            )
        });
        if let (Some(influences), Some(skin)) = (influences, skin) {
            let blend = influences.blend(vertex, skin);
            position = blend.transform_point3(position);
            // The direction alone counts, and single precision may not hold the length.
            let unit = |m: DMat3, v: DVec3| (m * v).normalize_or_zero();
            normal = unit(normal_matrix(&blend.matrix3), normal);
            tangent = unit(blend.matrix3, tangent);
        }
        Vertex {
            position: (position - own).as_vec3(),
            normal: normal.as_vec3(),
            tangent: tangent.as_vec3().extend(sign),
        }
    }
}
