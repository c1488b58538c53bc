//! Textures of a material: where the file has them, and how they are read.
//!
//! Renderers also sample those of additional layers (clear coat, sheen, transmission and so on), so they count.
//! A layer with a factor of zero (the default) is absent, and its textures are not sampled.

use super::features;
use crate::TextureSlot;
use crate::image_files::Usage;
use serde::Deserialize;
use serde_json::{Map, Value};

/// A texture of a material.
pub(super) struct MaterialTexture {
    pub slot: TextureSlot,
    /// Member or extension of the material that has the texture; empty for the material itself.
    pub object: &'static str,
    /// Property of the texture.
    pub property: &'static str,
    /// Property of the layer's factor, a number or a colour; empty for textures that are no layer's.
    factor: &'static str,
    pub usage: Usage,
}

/// A reference to a texture, as the file has it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object with an index")]
pub(super) struct Reference {
    pub index: usize,
    #[serde(default)]
    pub tex_coord: u32,
    #[serde(default)]
    pub extensions: Map<String, Value>,
}

const fn texture(
    slot: TextureSlot,
    object: &'static str,
    property: &'static str,
    factor: &'static str,
    usage: Usage,
) -> MaterialTexture {
    MaterialTexture {
        slot,
        object,
        property,
        factor,
        usage,
    }
}

/// The textures of every material. The colour of KHR_materials_specular replaces its factor.
#[rustfmt::skip]
pub(super) const CORE: [MaterialTexture; 7] = {
    use TextureSlot as Slot;
    use Usage::{AlphaFactor, Color, Data};
    use features::SPECULAR;
    [
        texture(Slot::BaseColor, "pbrMetallicRoughness", "baseColorTexture", "", Color),
        texture(Slot::MetallicRoughness, "pbrMetallicRoughness", "metallicRoughnessTexture", "", Data),
        texture(Slot::Normal, "", "normalTexture", "", Data),
        texture(Slot::Occlusion, "", "occlusionTexture", "", Data),
        texture(Slot::Emissive, "", "emissiveTexture", "", Color),
        texture(Slot::Specular, SPECULAR, "specularColorTexture", "", Color),
        texture(Slot::Specular, SPECULAR, "specularTexture", "", AlphaFactor),
    ]
};

/// The textures that replace those of [`CORE`] in a material with specular and glossiness.
#[rustfmt::skip]
pub(super) const GLOSSINESS: [MaterialTexture; 2] = {
    use features::GLOSSINESS;
    [
        texture(TextureSlot::BaseColor, GLOSSINESS, "diffuseTexture", "", Usage::Color),
        texture(TextureSlot::Specular, GLOSSINESS, "specularGlossinessTexture", "", Usage::Color),
    ]
};

/// The textures of additional layers.
#[rustfmt::skip]
pub(super) const LAYERS: [MaterialTexture; 12] = {
    use TextureSlot as Slot;
    use Usage::{Color, Data};
    use features::{ANISOTROPY, CLEARCOAT, DIFFUSE_TRANSMISSION, IRIDESCENCE, SHEEN, TRANSMISSION, VOLUME};
    [
        texture(Slot::Clearcoat, CLEARCOAT, "clearcoatTexture", "clearcoatFactor", Data),
        texture(Slot::ClearcoatRoughness, CLEARCOAT, "clearcoatRoughnessTexture", "clearcoatFactor", Data),
        texture(Slot::ClearcoatNormal, CLEARCOAT, "clearcoatNormalTexture", "clearcoatFactor", Data),
        texture(Slot::SheenColor, SHEEN, "sheenColorTexture", "sheenColorFactor", Color),
        texture(Slot::SheenRoughness, SHEEN, "sheenRoughnessTexture", "sheenColorFactor", Data),
        texture(Slot::Transmission, TRANSMISSION, "transmissionTexture", "transmissionFactor", Data),
        texture(Slot::Thickness, VOLUME, "thicknessTexture", "thicknessFactor", Data),
        texture(Slot::Iridescence, IRIDESCENCE, "iridescenceTexture", "iridescenceFactor", Data),
        texture(Slot::IridescenceThickness, IRIDESCENCE, "iridescenceThicknessTexture", "iridescenceFactor", Data),
        texture(Slot::Anisotropy, ANISOTROPY, "anisotropyTexture", "anisotropyStrength", Data),
        texture(Slot::DiffuseTransmission, DIFFUSE_TRANSMISSION, "diffuseTransmissionTexture", "diffuseTransmissionFactor", Data),
        texture(Slot::DiffuseTransmissionColor, DIFFUSE_TRANSMISSION, "diffuseTransmissionColorTexture", "diffuseTransmissionFactor", Color),
    ]
};

impl MaterialTexture {
    /// The reference to the texture in a material. `None` if it is missing or its layer is absent.
    ///
    /// # Errors
    /// The parser's message for a texture of another form.
    pub fn reference(&self, material: &Value) -> Result<Option<Reference>, serde_json::Error> {
        let object = match self.object {
            "" => Some(material),
            name => (material.get(name)).or_else(|| material.get("extensions")?.get(name)),
        };
        let Some(object) = object else {
            return Ok(None);
        };
        let is_above_zero = |value: &Value| value.as_f64().is_some_and(|factor| factor > 0.0);
        let is_present = match object.get(self.factor) {
            Some(Value::Array(color)) => color.iter().any(is_above_zero),
            Some(factor) => is_above_zero(factor),
            None => self.factor.is_empty(),
        };
        let texture = object.get(self.property).filter(|_| is_present);
        texture.map(Reference::deserialize).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn each_slot_of_a_layer_has_one_row() {
        let slots = LAYERS.map(|layer| layer.slot);
        let of_layers = TextureSlot::ALL
            .into_iter()
            .filter(|slot| slot.is_of_layer());
        assert!(of_layers.eq(slots));
        for layer in &LAYERS {
            assert!(
                features::SUPPORTED.contains(&layer.object),
                "{}",
                layer.object
            );
        }
    }

    #[test]
    fn a_layer_without_its_factor_is_absent() {
        let sheen = &LAYERS[3];
        let found = |factor: Value| {
            let texture = json!({"index": 2, "texCoord": 1});
            let extension = json!({"sheenColorFactor": factor, "sheenColorTexture": texture});
            sheen
                .reference(&json!({"extensions": { SHEEN: extension }}))
                .unwrap()
        };
        assert!(found(json!([0, 0, 0])).is_none() && found(Value::Null).is_none());
        let texture = found(json!([0, 0.5, 0])).unwrap();
        assert_eq!((texture.index, texture.tex_coord), (2, 1));
        let bad = json!({"sheenColorFactor": [1, 1, 1], "sheenColorTexture": 7});
        assert!(
            sheen
                .reference(&json!({"extensions": { SHEEN: bad }}))
                .is_err()
        );
    }

    const SHEEN: &str = features::SHEEN;
}
