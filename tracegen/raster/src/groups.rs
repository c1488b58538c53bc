//! Groups of a material's textures that share texture coordinates.

use scene::{Material, TextureRef, TextureSlot};

/// The material's textures by uv group: same texture coordinate set and same transform.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MaterialGroups {
    /// Slots of each group; groups in the order of their first slot.
    pub groups: Vec<Vec<TextureSlot>>,
    /// One bit per slot, set if it has a texture.
    pub present: u32,
    /// One bit per slot, set if it is the first of its group.
    pub leaders: u32,
}

impl MaterialGroups {
    /// Groups the textures of `material`.
    pub fn new(material: &Material) -> Self {
        let textures = &material.textures;
        let mut result = Self {
            groups: Vec::new(),
            present: 0,
            leaders: 0,
        };
        for (slot, texture) in textures.iter() {
            result.present |= 1 << slot as u32;
            let same = |group: &&mut Vec<TextureSlot>| {
                textures[group[0]].is_some_and(|leader| share_coordinates(&leader, texture))
            };
            if let Some(group) = result.groups.iter_mut().find(same) {
                group.push(slot);
            } else {
                result.leaders |= 1 << slot as u32;
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
    use TextureSlot::{BaseColor, Emissive, Normal, Occlusion, Specular};
    use scene::Textures;

    #[test]
    fn textures_with_the_same_coordinates_form_one_group() {
        let scaled = TextureRef {
            uv_transform: [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
            ..TextureRef::new(2)
        };
        let other_set = TextureRef {
            uv_set: 1,
            ..TextureRef::new(3)
        };
        let material = Material {
            textures: Textures::from([
                (BaseColor, Some(TextureRef::new(0))),
                (Normal, Some(scaled)),
                (Specular, Some(TextureRef::new(1))),
                (Occlusion, Some(other_set)),
                (Emissive, Some(scaled)),
            ]),
            ..Material::default()
        };
        let groups = MaterialGroups::new(&material);
        assert_eq!(
            groups.groups,
            [
                vec![BaseColor, Specular],
                vec![Normal, Emissive],
                vec![Occlusion]
            ]
        );
        assert_eq!(groups.present, 0b11_1011);
        assert_eq!(groups.leaders, 0b01_0011);
    }
}
