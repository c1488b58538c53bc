//! Skins: joints with their inverse bind matrices, and the joints of each vertex.

use super::accessors::{Buffers, at};
use super::meshes::Reader;
use crate::SceneError;
use crate::animation::{Influences, Skin};
use crate::warnings::Warnings;
use glam::{DAffine3, DMat4};
use gltf::json::mesh::Semantic;

/// Reads a skin.
pub(super) fn read(index: usize, buffers: &Buffers<'_>) -> Result<Skin, SceneError> {
    let skin = &buffers.root.skins[index];
    let joints: Vec<usize> = skin.joints.iter().map(at).collect();
    let invalid = |place: &str, expected: String, found: String| {
        let place = format!("skins[{index}].{place}");
        Err(buffers.origin.invalid(place, expected, found))
    };
    if joints.is_empty() {
        return invalid("joints", "at least one joint".into(), "none".into());
    }
    buffers.spend::<DAffine3>(joints.len() as u64, || format!("skins[{index}]"))?;
    let Some(accessor) = &skin.inverse_bind_matrices else {
        let inverse_binds = vec![DAffine3::IDENTITY; joints.len()];
        return Ok(Skin {
            joints,
            inverse_binds,
        });
    };
    let place = "inverseBindMatrices";
    let matrices = buffers.floats::<16>(at(accessor), "inverse bind matrices: MAT4 of floats")?;
    if matrices.len() < joints.len() {
        let expected = format!("at least {} matrices, one a joint", joints.len());
        return invalid(place, expected, matrices.len().to_string());
    }
    let inverse_binds: Vec<DAffine3> = (matrices.iter().take(joints.len()))
        .map(|matrix| DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from))))
        .collect();
    if let Some(bad) = inverse_binds.iter().position(|matrix| !matrix.is_finite()) {
        let expected = "finite matrices".to_owned();
        return invalid(place, expected, format!("NaN or infinity in matrix {bad}"));
    }
    Ok(Skin {
        joints,
        inverse_binds,
    })
}

impl Reader<'_> {
    /// The influences of `count` vertices by a skin with `joints` joints, or `None` if the primitive
    /// has none. Vertices that no triangle uses may lack weights.
    pub fn influences(
        &self,
        joints: usize,
        count: usize,
        indices: &[u32],
        warnings: &mut Warnings,
    ) -> Result<Option<Influences>, SceneError> {
        let mut sets = Vec::new();
        for set in 0.. {
            let Some(joints) = self.joints(set)? else {
                break;
            };
            let expected = "joint weights: Vec4 of F32 or normalized U8 or U16";
            let weights = self.vectors::<4>(&Semantic::Weights(set), expected)?;
            self.check_length(&format!("JOINTS_{set}"), joints.len(), count)?;
            let weights = weights.unwrap_or_default();
            self.check_length(&format!("WEIGHTS_{set}"), weights.len(), count)?;
            sets.push((joints, weights));
        }
        if sets.is_empty() {
            warnings.count("no joints", || {
                format!(
                    "{} has no JOINTS_0; it stands where its skinned node is",
                    self.place
                )
            });
            return Ok(None);
        }
        let mut influences = Influences {
            per_vertex: 4 * sets.len(),
            joints: Vec::with_capacity(4 * sets.len() * count),
            weights: Vec::with_capacity(4 * sets.len() * count),
        };
        for vertex in 0..count {
            for (joints, weights) in &sets {
                influences.joints.extend(joints[vertex]);
                influences.weights.extend(weights[vertex]);
            }
        }
        let used = self.check_influences(&mut influences, joints, indices, warnings)?;
        // Vertices that no triangle uses may hold anything.
        let weights = influences.weights.chunks_exact_mut(influences.per_vertex);
        for (weights, _) in weights.zip(used).filter(|(_, used)| !used) {
            weights.fill(0.0);
        }
        Ok(Some(influences))
    }

    /// The joint indices of a set.
    fn joints(&self, set: u32) -> Result<Option<Vec<[u16; 4]>>, SceneError> {
        let semantic = Semantic::Joints(set);
        let Some(accessor) = self.accessor(&semantic) else {
            return Ok(None);
        };
        if let Some(draco) = &self.draco
            && let Some(values) =
                draco.floats::<4>(&semantic, Some(accessor), &self.place, self.buffers)?
        {
            // Exact: values have at most 16 bits, and larger ones are not joints.
            return Ok(Some(
                values
                    .into_iter()
                    .map(|row| row.map(|joint| joint as u16))
                    .collect(),
            ));
        }
        self.buffers.joints(accessor).map(Some)
    }

    /// Checks the vertices that triangles use, and returns a flag per vertex. A used vertex without
    /// weights gets one for its first joint, as in three.js.
    fn check_influences(
        &self,
        influences: &mut Influences,
        joints: usize,
        indices: &[u32],
        warnings: &mut Warnings,
    ) -> Result<Vec<bool>, SceneError> {
        let mut checked = vec![false; influences.joints.len() / influences.per_vertex];
        for vertex in indices.iter().map(|&index| index as usize) {
            if std::mem::replace(&mut checked[vertex], true) {
                continue;
            }
            let invalid = |of: &str, expected: String, found: String| {
                let place = format!("{}.{of}, vertex {vertex}", self.place);
                Err(self.buffers.origin.invalid(place, expected, found))
            };
            let not_a_joint = |joint: u16| {
                let expected = format!("one of the {joints} joints of its skin");
                invalid("JOINTS", expected, format!("joint {joint}"))
            };
            let (pairs, sum) = influences.of(vertex);
            for (joint, weight) in pairs {
                if !(weight >= 0.0 && weight.is_finite()) {
                    let expected = "weights of at least 0".to_owned();
                    return invalid("WEIGHTS", expected, weight.to_string());
                }
                if weight > 0.0 && usize::from(joint) >= joints {
                    return not_a_joint(joint);
                }
            }
            if sum == 0.0 {
                let first = vertex * influences.per_vertex;
                if usize::from(influences.joints[first]) >= joints {
                    return not_a_joint(influences.joints[first]);
                }
                influences.weights[first] = 1.0;
                warnings.count("no weights", || {
                    let place = &self.place;
                    format!("{place}.WEIGHTS, vertex {vertex} has no weight above 0; it follows its first joint")
                });
            }
        }
        Ok(checked)
    }
}
