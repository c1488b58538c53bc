//! A mesh whose vertices move: its rest shape, and its shape at a time.

use super::morph::{Target, morphed};
use super::skin::{Influences, PosedSkin, normal_matrix};
use crate::Mesh;
use crate::geometry::complete_vertices;
use glam::{DMat3, DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// Least number of vertices per parallel task.
const MIN_VERTICES_PER_TASK: usize = 1024;

/// The morph targets and skin that move the vertices of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Movers {
    pub targets: Vec<Target>,
    pub influences: Option<Influences>,
}

impl Movers {
    /// Drops the vertices that are not `used`.
    pub fn keep(&mut self, used: &[bool]) {
        for target in &mut self.targets {
            target.keep(used);
        }
        if let Some(influences) = &mut self.influences {
            influences.keep(used);
        }
    }
}

/// The rest shape of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    positions: Vec<Vec3>,
    /// Empty if the file has none. They are then computed for each pose.
    normals: Vec<Vec3>,
    /// Empty if the file has none, as for `normals`.
    tangents: Vec<Vec4>,
    movers: Movers,
    /// Texture coordinates of the normal map, if the material has one.
    normal_map_uv: Option<u32>,
}

/// A vertex at a time. Attributes that the file lacks are zero.
struct Vertex {
    position: Vec3,
    normal: Vec3,
    tangent: Vec4,
}

impl Shape {
    /// The rest shape of a mesh that has only the attributes of its file.
    pub fn new(mesh: &Mesh, movers: Movers, normal_map_uv: Option<u32>) -> Self {
        Self {
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            tangents: mesh.tangents.clone(),
            movers,
            normal_map_uv,
        }
    }

    /// True if a skin moves its vertices.
    pub fn is_skinned(&self) -> bool {
        self.movers.influences.is_some()
    }

    /// Moves the vertices of `mesh` as these morph weights and this skin require, relative to `own`.
    pub fn pose(&self, mesh: &mut Mesh, weights: &[f64], skin: Option<&PosedSkin>, own: DVec3) {
        let vertices: Vec<Vertex> = (0..self.positions.len())
            .into_par_iter()
            .with_min_len(MIN_VERTICES_PER_TASK)
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
            // Only the direction matters. Normalising in double precision avoids overflow.
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
