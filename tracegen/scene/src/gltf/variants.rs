//! KHR_materials_variants: selection of another set of materials by name.

use crate::SceneError;
use crate::files::Origin;
use gltf::json::Root;
use gltf::json::mesh::Primitive;

/// The number of the variant with that name.
pub(super) fn chosen(
    root: &Root,
    wanted: Option<&str>,
    origin: &Origin,
) -> Result<Option<u32>, SceneError> {
    let Some(wanted) = wanted else {
        return Ok(None);
    };
    let names: Vec<&str> = (root.extensions.as_ref())
        .and_then(|extensions| extensions.khr_materials_variants.as_ref())
        .map(|table| table.variants.iter().map(|v| v.name.as_str()).collect())
        .unwrap_or_default();
    let number = names.iter().position(|name| *name == wanted);
    number.map(|number| Some(number as u32)).ok_or_else(|| {
        let place = "extensions.KHR_materials_variants";
        let expected = match names.as_slice() {
            [] => "a file with material variants".to_owned(),
            names => format!("one of the variants {}", names.join(", ")),
        };
        origin.invalid(place, expected, format!("'{wanted}'"))
    })
}

/// The material of a primitive in a variant. Without a mapping it is the primitive's own.
pub(super) fn material(primitive: &Primitive, variant: Option<u32>) -> Option<usize> {
    let own = || primitive.material.map(|material| material.value());
    let Some(variant) = variant else {
        return own();
    };
    let mappings = (primitive.extensions.as_ref())
        .and_then(|extensions| extensions.khr_materials_variants.as_ref())
        .map_or(&[][..], |mapped| mapped.mappings.as_slice());
    (mappings.iter())
        .find(|mapping| mapping.variants.contains(&variant))
        .map(|mapping| mapping.material as usize)
        .or_else(own)
}
