//! The role of each image, which determines its filtering and compression.

use scene::{AlphaMode, Scene, TextureSlot};

/// Use of a texture's alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alpha {
    /// Alpha is not used.
    Ignored,
    /// Alpha is compared with a cutoff (0 to 255).
    Mask(u8),
    /// Alpha is blended.
    Smooth,
}

/// Combined use of an image by all materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Role {
    pub alpha: Alpha,
    pub normal_map: bool,
}

/// Whether alpha tests read each image.
pub fn alpha_tested(scene: &Scene) -> Vec<bool> {
    let mut tested = vec![false; scene.images.len()];
    let masked = (scene.materials.iter()).filter(|of| matches!(of.alpha, AlphaMode::Mask(_)));
    for texture in masked.filter_map(|of| of.textures[TextureSlot::BaseColor]) {
        if let Some(tested) = tested.get_mut(texture.image) {
            *tested = true;
        }
    }
    tested
}

/// The role of each image; `None` for images that no placed mesh samples.
///
/// If several materials use an image in different ways, its alpha gets the use that preserves most of it, and
/// the lowest cutoff.
pub(super) fn of_images(scene: &Scene) -> Vec<Option<Role>> {
    let mut used = vec![false; scene.materials.len()];
    for instance in &scene.instances {
        if let Some(mesh) = scene.meshes.get(instance.mesh)
            && let Some(used) = used.get_mut(mesh.material)
        {
            *used = true;
        }
    }
    let mut roles = vec![None; scene.images.len()];
    for (material, _) in scene.materials.iter().zip(&used).filter(|(_, u)| **u) {
        for (slot, texture) in material.textures.iter() {
            let Some(role) = roles.get_mut(texture.image) else {
                continue;
            };
            let alpha = match material.alpha {
                AlphaMode::Mask(cutoff) if slot == TextureSlot::BaseColor => {
                    let on_texture = cutoff / material.base_color.w.max(1e-6);
                    // At least 1, because a completely transparent texel never passes in BC1.
                    Alpha::Mask((on_texture * 255.0).ceil().clamp(1.0, 255.0) as u8)
                }
                AlphaMode::Blend if slot == TextureSlot::BaseColor => Alpha::Smooth,
                // These layers read the alpha channel.
                _ if slot == TextureSlot::SheenRoughness => Alpha::Smooth,
                _ if slot == TextureSlot::DiffuseTransmission => Alpha::Smooth,
                _ => Alpha::Ignored,
            };
            let role = role.get_or_insert(Role {
                alpha: Alpha::Ignored,
                normal_map: false,
            });
            role.normal_map |= matches!(slot, TextureSlot::Normal | TextureSlot::ClearcoatNormal);
            role.alpha = match (role.alpha, alpha) {
                (Alpha::Smooth, _) | (_, Alpha::Smooth) => Alpha::Smooth,
                (Alpha::Mask(a), Alpha::Mask(b)) => Alpha::Mask(a.min(b)),
                (Alpha::Mask(a), _) | (_, Alpha::Mask(a)) => Alpha::Mask(a),
                (Alpha::Ignored, Alpha::Ignored) => Alpha::Ignored,
            };
        }
    }
    roles
}
