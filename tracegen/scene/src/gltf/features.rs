//! Features that a glTF file requires, checked before anything else is read: supported extensions,
//! and warnings about ignored ones.

use crate::error::SceneError;
use crate::files::Origin;
use crate::warnings::Warnings;
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, HashSet};

/// Extensions with textures of a material.
pub(super) const ANISOTROPY: &str = "KHR_materials_anisotropy";
pub(super) const CLEARCOAT: &str = "KHR_materials_clearcoat";
pub(super) const DIFFUSE_TRANSMISSION: &str = "KHR_materials_diffuse_transmission";
pub(super) const GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
pub(super) const IRIDESCENCE: &str = "KHR_materials_iridescence";
pub(super) const SHEEN: &str = "KHR_materials_sheen";
pub(super) const SPECULAR: &str = "KHR_materials_specular";
pub(super) const TRANSMISSION: &str = "KHR_materials_transmission";
pub(super) const VOLUME: &str = "KHR_materials_volume";

/// Supported extensions (docs/use/scene-files.md).
pub(super) const SUPPORTED: [&str; 23] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    ANISOTROPY,
    CLEARCOAT,
    DIFFUSE_TRANSMISSION,
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    IRIDESCENCE,
    GLOSSINESS,
    SHEEN,
    SPECULAR,
    TRANSMISSION,
    "KHR_materials_unlit",
    "KHR_materials_variants",
    VOLUME,
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "MSFT_texture_dds",
];

/// The part of the JSON that is the same in all versions of glTF.
#[derive(Deserialize)]
struct Versioned {
    asset: Asset,
}

/// The part of the JSON that states which features are needed to read the rest.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asked {
    #[serde(default)]
    textures: Vec<Texture>,
    #[serde(default)]
    extensions_required: Vec<String>,
    #[serde(default)]
    extensions_used: Vec<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    /// A string, and in files of glTF 1.0 also a number.
    version: Value,
    min_version: Option<String>,
}

#[derive(Deserialize)]
struct Texture {
    source: Option<usize>,
    #[serde(default)]
    extensions: BTreeMap<String, Value>,
}

/// Extensions that hold a texture's image in another format, in order of preference: compressed
/// blocks first, then the smallest encoding.
const IMAGE_EXTENSIONS: [&str; 3] = ["KHR_texture_basisu", "MSFT_texture_dds", "EXT_texture_webp"];

/// Refuses unsupported versions: a major version other than 2, or a minor version that the file
/// requires.
fn check_version(asset: &Asset, origin: &Origin) -> Result<(), SceneError> {
    let parts = |version: &str| -> Option<(u32, u32)> {
        let (major, minor) = version.split_once('.')?;
        Some((major.parse().ok()?, minor.parse().ok()?))
    };
    let version = match &asset.version {
        Value::String(version) => version.clone(),
        other => other.to_string(),
    };
    if !matches!(parts(&version), Some((2, _))) {
        return Err(origin.invalid("asset.version", "2.0", format!("'{version}'")));
    }
    match asset.min_version.as_deref() {
        None | Some("2.0") => Ok(()),
        Some(found) => Err(origin.invalid("asset.minVersion", "2.0", format!("'{found}'"))),
    }
}

/// The image of each texture: that of the first supported extension, or else its own. `None` for a
/// texture without any.
fn sources(textures: &[Texture], origin: &Origin) -> Result<Vec<Option<usize>>, SceneError> {
    let source = |(number, texture): (usize, &Texture)| {
        let place = || format!("textures[{number}]");
        let extension = (IMAGE_EXTENSIONS.iter())
            .find_map(|name| Some((*name, texture.extensions.get(*name)?)));
        if let Some((name, value)) = extension {
            let source = value.get("source").and_then(Value::as_u64);
            let source = source.and_then(|source| usize::try_from(source).ok());
            let missing = || {
                let place = format!("{}.extensions.{name}.source", place());
                origin.invalid(place, "the index of an image", "none")
            };
            return source.map(Some).ok_or_else(missing);
        }
        let other = texture
            .extensions
            .keys()
            .find(|name| name.contains("texture_"));
        if let (None, Some(name)) = (texture.source, other) {
            let expected = "a PNG, JPEG, WebP, KTX2 or DDS image as its source";
            let found = format!("{name} alone, unsupported");
            return Err(origin.invalid(place(), expected, found));
        }
        Ok(texture.source)
    };
    textures.iter().enumerate().map(source).collect()
}

/// Refuses a file that requires unsupported features, and warns about optional ones. Returns the
/// image of each texture.
pub(super) fn check(
    json: &[u8],
    origin: &Origin,
    warnings: &mut Warnings,
) -> Result<Vec<Option<usize>>, SceneError> {
    let versioned: Versioned = serde_json::from_slice(json).map_err(|e| not_gltf(origin, &e))?;
    check_version(&versioned.asset, origin)?;
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
    if !used.is_empty() {
        warnings.say(&format!(
            "{} unsupported extensions are left out: {}",
            used.len(),
            used.join(", ")
        ));
    }
    sources(&asked.textures, origin)
}

/// Each unsupported name once, in the file's order.
fn unsupported(names: &[String]) -> Vec<&str> {
    let mut seen = HashSet::new();
    (names.iter())
        .map(String::as_str)
        .filter(|name| !SUPPORTED.contains(name) && seen.insert(*name))
        .collect()
}

/// The error for invalid JSON, or for JSON that is not glTF.
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
        let is_extension = |word: &&str| {
            ["KHR_", "EXT_", "MSFT_"]
                .iter()
                .any(|vendor| word.starts_with(vendor))
        };
        let mut named: Vec<&str> = words.filter(is_extension).collect();
        named.sort_unstable();
        assert_eq!(named, SUPPORTED);
    }
}
