//! Draws that share one instanced draw call.

use crate::draws::DrawList;
use crate::roles::{MaterialState, PipelineKey, Purpose, roles};
use std::ops::Range;

/// Consecutive draws of a list with the same mesh, material and roles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Batch {
    /// The first draw.
    pub draw: u32,
    /// Positions of the draws in the list.
    pub range: Range<u32>,
}

/// The draw calls of a render pass in order, each with the key of its pipeline.
pub type Plan = Vec<(Batch, PipelineKey)>;

/// Plans a render pass over `visible` (indices into the draw list).
pub fn plan(
    draws: &DrawList,
    materials: &[MaterialState],
    visible: &[u32],
    purpose: Purpose,
) -> Plan {
    let mut plan = Vec::new();
    for batch in batches(draws, visible, purpose) {
        let call = &draws.calls[batch.draw as usize];
        let material = &materials[call.material];
        for &role in roles(call.mode, purpose) {
            let key = PipelineKey::new(call, material, role, purpose, draws.cascades);
            plan.push((batch.clone(), key));
        }
    }
    plan
}

/// Splits `visible` (indices into the draw list) into batches. Draws without a role are left out.
///
/// The order is kept and instances are drawn in order, so that depth test and blending have the
/// same result as draw by draw. A draw with two roles has its own batch, because its second role
/// writes the depth against which the next draw's first role is tested.
fn batches(draws: &DrawList, visible: &[u32], purpose: Purpose) -> Vec<Batch> {
    let mut found: Vec<Batch> = Vec::new();
    for (position, &draw) in (0..).zip(visible) {
        let call = &draws.calls[draw as usize];
        let roles = roles(call.mode, purpose);
        let joins = |batch: &&mut Batch| {
            let first = &draws.calls[batch.draw as usize];
            roles.len() == 1
                && batch.range.end == position
                && first.mesh == call.mesh
                && first.mirrored == call.mirrored
        };
        if roles.is_empty() {
        } else if let Some(batch) = found.last_mut().filter(joins) {
            batch.range.end += 1;
        } else {
            let range = position..position + 1;
            found.push(Batch { draw, range });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::{DrawCall, DrawMode};
    use glam::{Affine3A, Vec3};

    /// Draws of the given meshes; mesh 9 is mirrored.
    fn list(meshes: &[usize], mode: DrawMode) -> DrawList {
        let call = |&mesh: &usize| DrawCall {
            instance: 0,
            mesh: mesh.min(8),
            material: 0,
            mode,
            transform: Affine3A::IDENTITY,
            mirrored: mesh == 9,
            colored: false,
            first_primitive: 0,
            bounds: [Vec3::ZERO; 2],
        };
        DrawList {
            calls: meshes.iter().map(call).collect(),
            moving: Vec::new(),
            groups: Vec::new(),
            cascades: 0,
            shadow_format: formats::texture::TexelFormat::R32f,
            hierarchy: visibility::Hierarchy::default(),
        }
    }

    fn ranges(
        meshes: &[usize],
        mode: DrawMode,
        visible: &[u32],
        purpose: Purpose,
    ) -> Vec<(u32, u32)> {
        let found = batches(&list(meshes, mode), visible, purpose);
        found.iter().map(|b| (b.range.start, b.range.end)).collect()
    }

    #[test]
    fn consecutive_instances_of_a_mesh_are_one_batch_across_culled_draws() {
        let meshes = [1, 1, 1, 2, 1, 8, 9];
        let of = |visible: &[u32]| ranges(&meshes, DrawMode::Opaque, visible, Purpose::Capture);
        assert_eq!(
            of(&[0, 1, 2, 3, 4, 5, 6]),
            [(0, 3), (3, 4), (4, 5), (5, 6), (6, 7)]
        );
        assert_eq!(of(&[0, 2, 4]), [(0, 3)]);
        assert_eq!(of(&[]), []);
    }

    #[test]
    fn recorded_masked_draws_are_not_batched_and_others_are() {
        let of = |purpose| ranges(&[1, 1, 1], DrawMode::Masked, &[0, 1, 2], purpose);
        assert_eq!(of(Purpose::Capture), [(0, 1), (1, 2), (2, 3)]);
        assert_eq!(of(Purpose::Plain), [(0, 3)]);
        assert_eq!(of(Purpose::Shadow), [(0, 3)]);
    }

    #[test]
    fn blended_draws_cast_no_shadow() {
        assert_eq!(ranges(&[1], DrawMode::Blended, &[0], Purpose::Shadow), []);
    }
}
