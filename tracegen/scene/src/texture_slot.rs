//! The textures of a material.

use crate::TextureRef;
use std::ops::{Index, IndexMut};

/// A texture of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum TextureSlot {
    /// Base colour and alpha.
    BaseColor,
    /// Tangent-space normal map.
    Normal,
    /// Roughness in G, metalness in B.
    MetallicRoughness,
    /// Specular colour.
    Specular,
    /// Ambient occlusion in R.
    Occlusion,
    /// Emitted colour.
    Emissive,
    /// Strength of the clear coat in R.
    Clearcoat,
    /// Roughness of the clear coat in G.
    ClearcoatRoughness,
    /// Normal map of the clear coat.
    ClearcoatNormal,
    /// Colour of the sheen.
    SheenColor,
    /// Roughness of the sheen in A.
    SheenRoughness,
    /// Transmitted fraction in R.
    Transmission,
    /// Thickness of the volume in G.
    Thickness,
    /// Strength of the iridescence in R.
    Iridescence,
    /// Thickness of the iridescent film in G.
    IridescenceThickness,
    /// Direction and strength of the anisotropy.
    Anisotropy,
    /// Diffusely transmitted fraction in A.
    DiffuseTransmission,
    /// Colour of diffusely transmitted light.
    DiffuseTransmissionColor,
}

impl TextureSlot {
    /// All slots, in the order in which shaders sample them.
    pub const ALL: [Self; 18] = [
        Self::BaseColor,
        Self::Normal,
        Self::MetallicRoughness,
        Self::Specular,
        Self::Occlusion,
        Self::Emissive,
        Self::Clearcoat,
        Self::ClearcoatRoughness,
        Self::ClearcoatNormal,
        Self::SheenColor,
        Self::SheenRoughness,
        Self::Transmission,
        Self::Thickness,
        Self::Iridescence,
        Self::IridescenceThickness,
        Self::Anisotropy,
        Self::DiffuseTransmission,
        Self::DiffuseTransmissionColor,
    ];

    /// Number of slots.
    pub const COUNT: usize = Self::ALL.len();

    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::BaseColor => "base-color",
            Self::Normal => "normal",
            Self::MetallicRoughness => "metallic-roughness",
            Self::Specular => "specular",
            Self::Occlusion => "occlusion",
            Self::Emissive => "emissive",
            Self::Clearcoat => "clearcoat",
            Self::ClearcoatRoughness => "clearcoat-roughness",
            Self::ClearcoatNormal => "clearcoat-normal",
            Self::SheenColor => "sheen-color",
            Self::SheenRoughness => "sheen-roughness",
            Self::Transmission => "transmission",
            Self::Thickness => "thickness",
            Self::Iridescence => "iridescence",
            Self::IridescenceThickness => "iridescence-thickness",
            Self::Anisotropy => "anisotropy",
            Self::DiffuseTransmission => "diffuse-transmission",
            Self::DiffuseTransmissionColor => "diffuse-transmission-color",
        }
    }

    /// Whether it is of an additional layer of the material (clear coat, sheen and so on). Such textures are
    /// sampled, and their effect on colours is approximated.
    pub fn is_of_layer(self) -> bool {
        self > Self::Emissive
    }
}

/// The textures of a material by slot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Textures([Option<TextureRef>; TextureSlot::COUNT]);

impl Textures {
    /// The textures and their slots, in the order of the slots.
    pub fn iter(&self) -> impl Iterator<Item = (TextureSlot, &TextureRef)> {
        let of_slot = |(slot, texture)| Some((slot, Option::as_ref(texture)?));
        TextureSlot::ALL
            .into_iter()
            .zip(&self.0)
            .filter_map(of_slot)
    }

    /// The textures in the order of their slots.
    pub fn all(&self) -> impl Iterator<Item = &TextureRef> {
        self.0.iter().flatten()
    }

    /// The textures of the first `count` slots.
    pub fn first(&self, count: usize) -> impl Iterator<Item = &TextureRef> {
        self.0.iter().take(count).flatten()
    }

    /// The textures in the order of their slots.
    pub(crate) fn all_mut(&mut self) -> impl Iterator<Item = &mut TextureRef> {
        self.0.iter_mut().flatten()
    }

    /// Each slot's texture converted.
    pub fn map<T>(&self, convert: impl FnMut(Option<TextureRef>) -> T) -> [T; TextureSlot::COUNT] {
        self.0.map(convert)
    }
}

impl<const N: usize> From<[(TextureSlot, Option<TextureRef>); N]> for Textures {
    fn from(textures: [(TextureSlot, Option<TextureRef>); N]) -> Self {
        let mut result = Self::default();
        for (slot, texture) in textures {
            result[slot] = texture;
        }
        result
    }
}

impl Index<TextureSlot> for Textures {
    type Output = Option<TextureRef>;
    fn index(&self, slot: TextureSlot) -> &Self::Output {
        &self.0[slot as usize]
    }
}

impl IndexMut<TextureSlot> for Textures {
    fn index_mut(&mut self, slot: TextureSlot) -> &mut Self::Output {
        &mut self.0[slot as usize]
    }
}

/// A set of slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureSlots(u32);

impl TextureSlots {
    /// All slots.
    pub const ALL: Self = Self((1 << TextureSlot::COUNT) - 1);
    /// No slot.
    pub const NONE: Self = Self(0);

    /// A set of some slots.
    pub fn of(slots: &[TextureSlot]) -> Self {
        Self(slots.iter().fold(0, |bits, slot| bits | 1 << *slot as u32))
    }

    /// The set without a slot.
    #[must_use]
    pub fn without(self, slot: TextureSlot) -> Self {
        Self(self.0 & !(1 << slot as u32))
    }

    /// Whether a slot is in the set.
    pub fn contains(self, slot: TextureSlot) -> bool {
        self.0 >> slot as u32 & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_are_numbered_in_their_order() {
        for (place, slot) in TextureSlot::ALL.into_iter().enumerate() {
            assert_eq!(slot as usize, place, "{}", slot.name());
        }
        assert!(TextureSlots::ALL.contains(TextureSlot::DiffuseTransmissionColor));
        let some = TextureSlots::of(&[TextureSlot::Normal, TextureSlot::Emissive]);
        assert!(
            !some
                .without(TextureSlot::Normal)
                .contains(TextureSlot::Normal)
        );
        assert!(some.contains(TextureSlot::Emissive) && !some.contains(TextureSlot::BaseColor));
    }
}
