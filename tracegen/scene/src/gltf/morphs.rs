//! Morph targets: the displacements of a primitive's vertices, and the weights of a node's mesh.

use super::accessors::at;
use super::meshes::Reader;
use crate::SceneError;
use crate::animation::Target;
use crate::warnings::Warnings;
use glam::Vec3;
use gltf::json::Index;
use gltf::json::Root;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Mesh, MorphTarget};

/// Number of a mesh's morph targets.
fn count(mesh: &Mesh) -> usize {
    let targets = mesh.primitives.iter().filter_map(|p| p.targets.as_ref());
    targets.map(Vec::len).max().unwrap_or(0)
}

/// Number of morph targets of a node's mesh.
pub(super) fn count_of_node(root: &Root, node: usize) -> usize {
    let mesh = root.nodes[node].mesh.as_ref();
    mesh.map_or(0, |mesh| count(&root.meshes[at(mesh)]))
}

/// The weights of a node's morph targets without animation: its own, or its mesh's, or zeros.
pub(super) fn weights(root: &Root, node: usize, warnings: &mut Warnings) -> Vec<f64> {
    let count = count_of_node(root, node);
    let of_node = root.nodes[node].weights.as_ref();
    let mesh = root.nodes[node].mesh.as_ref();
    let of_mesh = mesh.and_then(|mesh| root.meshes[at(mesh)].weights.as_ref());
    let given = of_node.or(of_mesh);
    if let Some(given) = given.filter(|given| given.len() != count) {
        warnings.count("count of weights", || {
            format!(
                "nodes[{node}] has {} weights for {count} morph targets; missing ones are 0",
                given.len()
            )
        });
    }
    let mut weights: Vec<f64> = given.into_iter().flatten().map(|&w| f64::from(w)).collect();
    weights.resize(count, 0.0);
    weights
}

impl Reader<'_> {
    /// The morph targets of a primitive with `count` vertices.
    pub fn targets(&self, count: usize) -> Result<Vec<Target>, SceneError> {
        let targets = self.primitive.targets.iter().flatten().enumerate();
        targets
            .map(|(number, target)| self.target(number, target, count))
            .collect()
    }

    fn target(
        &self,
        number: usize,
        target: &MorphTarget,
        count: usize,
    ) -> Result<Target, SceneError> {
        let read = |name: &str, accessor: &Option<Index<Accessor>>| {
            let Some(accessor) = accessor else {
                return Ok(Vec::new());
            };
            let expected = "displacements: Vec3 of F32";
            let values = self.buffers.floats::<3>(at(accessor), expected)?;
            self.check_length(&format!("targets[{number}].{name}"), values.len(), count)?;
            Ok(values.into_iter().map(Vec3::from_array).collect::<Vec<_>>())
        };
        let positions = read("POSITION", &target.positions)?;
        if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
            return Err(self.buffers.origin.invalid(
                format!("{}.targets[{number}].POSITION, vertex {vertex}", self.place),
                "a finite displacement",
                positions[vertex].to_string(),
            ));
        }
        Ok(Target {
            positions,
            normals: read("NORMAL", &target.normals)?,
            tangents: read("TANGENT", &target.tangents)?,
        })
    }
}
