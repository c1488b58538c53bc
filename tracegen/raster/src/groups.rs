//! Groups of a material's textures that share texture coordinates.

use scene::{Material, TextureRef};

/// Textures that the shader samples: base colour, normal, metallic-roughness, specular,
/// occlusion, emissive.
pub const MATERIAL_TEXTURES: usize = SLOTS.len();

/// The shader's names of the slots of [`Material::textures`].
pub(crate) const SLOTS: [&str; 6] = [
    "BASE_COLOR",
    "NORMAL",
    "METALLIC_ROUGHNESS",
    "SPECULAR",
    "OCCLUSION",
    "EMISSIVE",
];

/// The material's textures by uv group: same texture coordinate set and same transform.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MaterialGroups {
    /// Slots (0 to 5) of each group; groups in the order of their first slot.
    pub groups: Vec<Vec<usize>>,
    /// One bit per slot, set if it has a texture.
    pub present: u32,
    /// One bit per slot, set if it is the first of its group.
    pub leaders: u32,
}

impl MaterialGroups {
    /// Groups the textures of `material`.
    #[must_use]
    pub fn new(material: &Material) -> Self {
        let textures = material.textures();
        let mut result = Self {
            groups: Vec::new(),
            present: 0,
            leaders: 0,
        };
        for (slot, texture) in textures.iter().enumerate() {
            let Some(texture) = texture else { continue };
            result.present |= 1 << slot;
            let same = |group: &&mut Vec<usize>| {
                textures[group[0]].is_some_and(|leader| share_coordinates(&leader, texture))
            };
            if let Some(group) = result.groups.iter_mut().find(same) {
                group.push(slot);
            } else {
                result.leaders |= 1 << slot;
                result.groups.push(vec![slot]);
            }
        }
        result
    }
}

fn share_coordinates(a: &TextureRef, b: &TextureRef) -> bool {
    a.uv_set == b.uv_set && a.uv_transform == b.uv_transform
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_with_the_same_coordinates_form_one_group() {
        let scaled = TextureRef {
            uv_transform: [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
            ..TextureRef::new(2)
        };
        let material = Material {
            base_color_texture: Some(TextureRef::new(0)),
            normal_texture: Some(scaled),
            specular_texture: Some(TextureRef::new(1)),
            occlusion_texture: Some(TextureRef {
                uv_set: 1,
                ..TextureRef::new(3)
            }),
            emissive_texture: Some(scaled),
            ..Material::default()
        };
        let groups = MaterialGroups::new(&material);
        assert_eq!(groups.groups, [vec![0, 3], vec![1, 5], vec![4]]);
        assert_eq!(groups.present, 0b11_1011);
        assert_eq!(groups.leaders, 0b01_0011);
    }
}
