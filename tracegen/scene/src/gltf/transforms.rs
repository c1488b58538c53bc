//! The nodes' transforms in double precision. The crate that parses the rest rounds to single.

use super::features::not_gltf;
use super::instancing::Instancing;
use crate::SceneError;
use crate::files::Origin;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use serde::Deserialize;

/// The part of a node that places it.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct Local {
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
    #[serde(default)]
    extensions: Extensions,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
struct Extensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    instancing: Option<Instancing>,
}

#[derive(Deserialize)]
struct Nodes {
    #[serde(default)]
    nodes: Vec<Local>,
}

/// The transforms of all nodes, in the file's order.
pub(super) fn read(json: &[u8], origin: &Origin) -> Result<Vec<Local>, SceneError> {
    let read: Nodes = serde_json::from_slice(json).map_err(|e| not_gltf(origin, &e))?;
    Ok(read.nodes)
}

impl Local {
    /// The transforms of the instances of the node's mesh, if it has several.
    pub fn instancing(&self) -> Option<Instancing> {
        self.extensions.instancing
    }

    /// To the parent's space.
    pub fn transform(&self) -> DAffine3 {
        if let Some(matrix) = &self.matrix {
            return DAffine3::from_mat4(DMat4::from_cols_array(matrix));
        }
        let (translation, rotation, scale) = self.parts();
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    }

    /// Translation, rotation and scale of a node without a matrix.
    pub fn parts(&self) -> (DVec3, DQuat, DVec3) {
        let rotation = self.rotation.map_or(DQuat::IDENTITY, |q| {
            let q = DQuat::from_array(q);
            if q.length_squared() > 0.0 {
                q.normalize()
            } else {
                DQuat::IDENTITY
            }
        });
        (
            self.translation.map_or(DVec3::ZERO, DVec3::from),
            rotation,
            self.scale.map_or(DVec3::ONE, DVec3::from),
        )
    }
}
