//! EXT_mesh_gpu_instancing: several instances of a node's mesh.

use super::accessors::Buffers;
use crate::SceneError;
use glam::{DAffine3, DQuat, DVec3};
use serde::Deserialize;

/// Accessors of the instances' transforms relative to the node.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) struct Attributes {
    translation: Option<usize>,
    rotation: Option<usize>,
    scale: Option<usize>,
}

/// The extension's object in a node.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub(super) struct Instancing {
    #[serde(default)]
    attributes: Attributes,
}

impl Instancing {
    /// One transform per instance, to the space of node `node`. A missing attribute is the
    /// identity. Without any attribute there is one instance.
    pub fn transforms(
        &self,
        node: usize,
        buffers: &Buffers<'_>,
    ) -> Result<Vec<DAffine3>, SceneError> {
        let Attributes {
            translation,
            rotation,
            scale,
        } = self.attributes;
        let place = || format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes");
        let mut count = None;
        let mut is_as_long = |length: usize| {
            let expected = *count.get_or_insert(length);
            if length == expected {
                return Ok(());
            }
            Err(buffers.origin.invalid(
                place(),
                format!("accessors of one count, {expected}"),
                length.to_string(),
            ))
        };
        let mut vectors = |accessor: Option<usize>, expected: &str| {
            let read = accessor.map(|index| buffers.floats::<3>(index, expected));
            let read = read.transpose()?;
            read.iter()
                .try_for_each(|values| is_as_long(values.len()))?;
            Ok::<_, SceneError>(read)
        };
        let translations = vectors(translation, "TRANSLATION: vectors of 3 floats")?;
        let scales = vectors(scale, "SCALE: vectors of 3 floats")?;
        let rotations = rotation
            .map(|index| {
                let expected = "ROTATION: vectors of 4 floats or normalized integers";
                buffers.floats::<4>(index, expected)
            })
            .transpose()?;
        rotations
            .iter()
            .try_for_each(|values| is_as_long(values.len()))?;
        let vector = |values: &Option<Vec<[f32; 3]>>, i: usize, without: DVec3| {
            values
                .as_ref()
                .map_or(without, |values| glam::Vec3::from(values[i]).as_dvec3())
        };
        let rotation = |i: usize| {
            let q = rotations.as_ref().map(|values| values[i].map(f64::from));
            let q = q.map(DQuat::from_array);
            q.filter(|q| q.length_squared() > 0.0)
                .map_or(DQuat::IDENTITY, DQuat::normalize)
        };
        (0..count.unwrap_or(1))
            .map(|i| {
                let transform = DAffine3::from_scale_rotation_translation(
                    vector(&scales, i, DVec3::ONE),
                    rotation(i),
                    vector(&translations, i, DVec3::ZERO),
                );
                if transform.is_finite() {
                    return Ok(transform);
                }
                let place = format!("{}, instance {i}", place());
                Err(buffers
                    .origin
                    .invalid(place, "a finite transform", "NaN or infinity"))
            })
            .collect()
    }
}
