//! Textures of additional layers of a material: clear coat, sheen, transmission and so on.
//!
//! Renderers sample them, so they count. A layer with a factor of zero (the default) is absent, and its textures
//! are not sampled.

use super::features;
use crate::TextureSlot;
use crate::image_files::Usage;
use serde::Deserialize;
use serde_json::{Map, Value};

/// A texture of a layer.
pub(super) struct Layer {
    pub slot: TextureSlot,
    pub extension: &'static str,
    /// Property of the texture.
    pub property: &'static str,
    /// Property of the layer's factor, a number or a colour.
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

const fn layer(
    slot: TextureSlot,
    extension: &'static str,
    property: &'static str,
    factor: &'static str,
    usage: Usage,
) -> Layer {
    Layer {
        slot,
        extension,
        property,
        factor,
        usage,
    }
}

/// The textures that are read.
#[rustfmt::skip]
pub(super) const LAYERS: [Layer; 12] = {
    use TextureSlot as Slot;
    use Usage::{Color, Data};
    use features::{ANISOTROPY, CLEARCOAT, DIFFUSE_TRANSMISSION, IRIDESCENCE, SHEEN, TRANSMISSION, VOLUME};
    [
        layer(Slot::Clearcoat, CLEARCOAT, "clearcoatTexture", "clearcoatFactor", Data),
        layer(Slot::ClearcoatRoughness, CLEARCOAT, "clearcoatRoughnessTexture", "clearcoatFactor", Data),
        layer(Slot::ClearcoatNormal, CLEARCOAT, "clearcoatNormalTexture", "clearcoatFactor", Data),
        layer(Slot::SheenColor, SHEEN, "sheenColorTexture", "sheenColorFactor", Color),
        layer(Slot::SheenRoughness, SHEEN, "sheenRoughnessTexture", "sheenColorFactor", Data),
        layer(Slot::Transmission, TRANSMISSION, "transmissionTexture", "transmissionFactor", Data),
        layer(Slot::Thickness, VOLUME, "thicknessTexture", "thicknessFactor", Data),
        layer(Slot::Iridescence, IRIDESCENCE, "iridescenceTexture", "iridescenceFactor", Data),
        layer(Slot::IridescenceThickness, IRIDESCENCE, "iridescenceThicknessTexture", "iridescenceFactor", Data),
        layer(Slot::Anisotropy, ANISOTROPY, "anisotropyTexture", "anisotropyStrength", Data),
        layer(Slot::DiffuseTransmission, DIFFUSE_TRANSMISSION, "diffuseTransmissionTexture", "diffuseTransmissionFactor", Data),
        layer(Slot::DiffuseTransmissionColor, DIFFUSE_TRANSMISSION, "diffuseTransmissionColorTexture", "diffuseTransmissionFactor", Color),
    ]
};

impl Layer {
    /// The layer's texture in the extensions of a material. `None` if it is missing or the layer is absent.
    ///
    /// # Errors
    /// The parser's message for a texture of another form.
    pub fn of(&self, extensions: &Value) -> Result<Option<Reference>, serde_json::Error> {
        let Some(extension) = extensions.get(self.extension) else {
            return Ok(None);
        };
        let is_above_zero = |value: &Value| value.as_f64().is_some_and(|factor| factor > 0.0);
        let is_present = match extension.get(self.factor) {
            Some(Value::Array(color)) => color.iter().any(is_above_zero),
            Some(factor) => is_above_zero(factor),
            None => false,
        };
        let texture = extension.get(self.property).filter(|_| is_present);
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
                features::SUPPORTED.contains(&layer.extension),
                "{}",
                layer.extension
            );
        }
    }

    #[test]
    fn a_layer_without_its_factor_is_absent() {
        let sheen = &LAYERS[3];
        let found = |factor: Value| {
            let texture = json!({"index": 2, "texCoord": 1});
            let extension = json!({"sheenColorFactor": factor, "sheenColorTexture": texture});
            sheen.of(&json!({ SHEEN: extension })).unwrap()
        };
        assert!(found(json!([0, 0, 0])).is_none() && found(Value::Null).is_none());
        let texture = found(json!([0, 0.5, 0])).unwrap();
        assert_eq!((texture.index, texture.tex_coord), (2, 1));
        let bad = json!({ SHEEN: {"sheenColorFactor": [1, 1, 1], "sheenColorTexture": 7} });
        assert!(sheen.of(&bad).is_err());
    }

    const SHEEN: &str = features::SHEEN;
}
