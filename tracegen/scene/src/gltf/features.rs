//! What a glTF file asks for, read before anything else: extensions, and what is left out here.

use crate::error::SceneError;
use crate::files::Origin;
use crate::warnings::Warnings;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::{BTreeMap, HashSet};

/// Extensions that are read (docs/use/scene-files.md).
pub(super) const SUPPORTED: [&str; 10] = [
    "EXT_mesh_gpu_instancing",
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
    asset: Asset,
    #[serde(default)]
    textures: Vec<Texture>,
    #[serde(default)]
    extensions_required: Vec<String>,
    #[serde(default)]
    extensions_used: Vec<String>,
    #[serde(default)]
    animations: Vec<IgnoredAny>,
    #[serde(default)]
    skins: Vec<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    version: String,
    min_version: Option<String>,
}

#[derive(Deserialize)]
struct Texture {
    source: Option<IgnoredAny>,
    #[serde(default)]
    extensions: BTreeMap<String, IgnoredAny>,
}

/// Extensions that hold a texture's image in another format, and that format.
const IMAGE_FORMATS: [(&str, &str); 4] = [
    ("EXT_texture_avif", "AVIF"),
    ("EXT_texture_webp", "WebP"),
    ("KHR_texture_basisu", "KTX2"),
    ("MSFT_texture_dds", "DDS"),
];

/// Refuses versions that are not read: another major version than 2, or a minor one that the file needs.
fn check_version(asset: &Asset, origin: &Origin) -> Result<(), SceneError> {
    let parts = |version: &str| -> Option<(u32, u32)> {
        let (major, minor) = version.split_once('.')?;
        Some((major.parse().ok()?, minor.parse().ok()?))
    };
    let version = &asset.version;
    if !matches!(parts(version), Some((2, _))) {
        return Err(origin.invalid("asset.version", "2.0", format!("'{version}'")));
    }
    match asset.min_version.as_deref() {
        None | Some("2.0") => Ok(()),
        Some(found) => Err(origin.invalid("asset.minVersion", "2.0", format!("'{found}'"))),
    }
}

/// Refuses a texture whose only image is in a format that is not read.
fn check_textures(textures: &[Texture], origin: &Origin) -> Result<(), SceneError> {
    for (index, texture) in textures.iter().enumerate() {
        let only = IMAGE_FORMATS.iter().find(|(extension, _)| {
            texture.source.is_none() && texture.extensions.contains_key(*extension)
        });
        if let Some((extension, format)) = only {
            return Err(origin.invalid(
                format!("textures[{index}]"),
                "a PNG or JPEG image as its source",
                format!("{format} alone ({extension}), unsupported"),
            ));
        }
    }
    Ok(())
}

/// Refuses a file that requires what is not supported, and tells what is left out of others.
pub(super) fn check(
    json: &[u8],
    origin: &Origin,
    warnings: &mut Warnings,
) -> Result<(), SceneError> {
    let asked: Asked = serde_json::from_slice(json).map_err(|e| not_gltf(origin, &e))?;
    check_version(&asked.asset, origin)?;
    check_textures(&asked.textures, origin)?;
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
        let page = include_str!("../../../../docs/use/scene-files.md");
        let words = page.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        let is_extension = |word: &&str| word.starts_with("KHR_") || word.starts_with("EXT_");
        let mut named: Vec<&str> = words.filter(is_extension).collect();
        named.sort_unstable();
        assert_eq!(named, SUPPORTED);
    }
}
