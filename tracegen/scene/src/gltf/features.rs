//! What a glTF file asks for, read before anything else: extensions, and what is left out here.

use crate::error::SceneError;
use crate::files::Origin;
use crate::warnings::Warnings;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::HashSet;

/// Extensions that are read (docs/scene-files.md).
pub(super) const SUPPORTED: [&str; 9] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// The part of the JSON that says what is needed to read the rest.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asked {
    #[serde(default)]
    extensions_required: Vec<String>,
    #[serde(default)]
    extensions_used: Vec<String>,
    #[serde(default)]
    animations: Vec<IgnoredAny>,
    #[serde(default)]
    skins: Vec<IgnoredAny>,
}

/// Refuses a file that requires what is not supported, and tells what is left out of others.
pub(super) fn check(
    json: &[u8],
    origin: &Origin,
    warnings: &mut Warnings,
) -> Result<(), SceneError> {
    let asked: Asked = serde_json::from_slice(json).map_err(|e| not_gltf(origin, &e))?;
    let required = unsupported(&asked.extensions_required);
    if !required.is_empty() {
        return Err(origin.invalid(
            "extensionsRequired",
            format!("nothing but {}", SUPPORTED.join(", ")),
            format!("{}, unsupported", required.join(", ")),
        ));
    }
    let used = unsupported(&asked.extensions_used);
    let left_out = [
        (
            asked.animations.len(),
            "animations are left out: nodes stand as they are stored".to_owned(),
        ),
        (
            asked.skins.len(),
            "skins are left out: meshes stand as they are stored".to_owned(),
        ),
        (
            used.len(),
            format!("unsupported extensions are left out: {}", used.join(", ")),
        ),
    ];
    for (count, what) in left_out {
        if count > 0 {
            warnings.say(&format!("{count} {what}"));
        }
    }
    Ok(())
}

/// Each unsupported name once, in the file's order.
fn unsupported(names: &[String]) -> Vec<&str> {
    let mut seen = HashSet::new();
    (names.iter())
        .map(String::as_str)
        .filter(|name| !SUPPORTED.contains(name) && seen.insert(*name))
        .collect()
}

/// The error of JSON that is none, or not what glTF says.
pub(super) fn not_gltf(origin: &Origin, error: &serde_json::Error) -> SceneError {
    origin.invalid("JSON", "a glTF 2.0 asset", error.to_string())
}

#[cfg(test)]
mod tests {
    use super::SUPPORTED;

    #[test]
    fn the_page_on_scene_files_names_every_supported_extension_and_no_other() {
        let page = include_str!("../../../../docs/scene-files.md");
        let words = page.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        let mut named: Vec<&str> = words.filter(|word| word.starts_with("KHR_")).collect();
        named.sort_unstable();
        assert_eq!(named, SUPPORTED);
    }
}
