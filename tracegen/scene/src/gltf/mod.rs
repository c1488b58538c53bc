//! glTF 2.0, text and binary.
//!
//! The `gltf` crate parses the JSON and checks that indices point into their tables; everything
//! that touches bytes is read here with its own range checks, because the crate's readers panic
//! on accessors that lie about their buffers.
//!
//! What is read: meshes (triangles, strips, fans; indexed or not), node transforms, cameras,
//! punctual lights, and materials (see `materials`). What is not: animation, skins, morph
//! targets (the rest pose is used), points and lines (skipped with a warning).
//! Degenerate triangles are kept: they cost a primitive number and cover nothing.

mod accessors;
mod materials;
mod meshes;
mod nodes;
#[cfg(test)]
mod tests;

use super::files::{Origin, read_file};
use super::uri::{self, Uri};
use super::{Instance, LoadOptions, Loaded, Scene, SceneError};
use accessors::Buffers;
use gltf::json::validation::{Error as Fault, Validate};
use gltf::json::{Path as JsonPath, Root};
use std::path::Path;
use std::sync::Arc;

/// Loads a `.gltf` or `.glb` file.
///
/// # Errors
/// See [`SceneError`].
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, SceneError> {
    let origin = Origin::new(path);
    let bytes = read_file(path, "scene")?;
    let (document, blob) = parse(&origin, &bytes)?;
    drop(bytes);
    let root = document.as_json();
    let buffers = Buffers::new(root, read_buffers(&origin, root, blob)?, &origin);

    let mut warnings = Vec::new();
    let placed = nodes::walk(root, &origin, &mut warnings)?;
    let mut scene = Scene {
        cameras: placed.cameras,
        lights: placed.lights,
        ..Scene::default()
    };

    let mut materials = materials::Table::new(&document, &buffers, &origin, options);
    // The scene's meshes of each glTF mesh (one a primitive), filled on first use.
    let mut loaded: Vec<Option<Vec<usize>>> = vec![None; root.meshes.len()];
    for (mesh, transform) in placed.meshes {
        let primitives = match &loaded[mesh] {
            Some(primitives) => primitives.clone(),
            None => {
                let first = scene.meshes.len();
                let read = meshes::read(mesh, &buffers, &mut materials, &mut warnings)?;
                scene.meshes.extend(read);
                let primitives: Vec<usize> = (first..scene.meshes.len()).collect();
                loaded[mesh] = Some(primitives.clone());
                primitives
            }
        };
        scene
            .instances
            .extend((primitives.into_iter()).map(|mesh| Instance { mesh, transform }));
    }
    warnings.append(&mut materials.warnings);
    scene.images = materials.requests.decode(&origin, options)?;
    scene.materials = materials.materials;
    Ok(Loaded { scene, warnings })
}

/// Parses the container and the JSON and checks every index.
fn parse(origin: &Origin, bytes: &[u8]) -> Result<(gltf::Document, Option<Vec<u8>>), SceneError> {
    if bytes.starts_with(b"glTF") {
        let length = bytes.get(8..12).and_then(|b| b.try_into().ok());
        let length = length.map_or(0, u32::from_le_bytes) as usize;
        // The crate subtracts the header from this length unchecked.
        if length < 12 || length > bytes.len() {
            return Err(origin.invalid(
                "GLB header, byte 8",
                format!("a length of at most the file's {} bytes", bytes.len()),
                length.to_string(),
            ));
        }
    }
    let gltf = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| {
        let place = if bytes.starts_with(b"glTF") {
            "GLB"
        } else {
            "JSON"
        };
        origin.invalid(place, "a glTF 2.0 asset", e.to_string())
    })?;
    validate(origin, gltf.document.as_json())?;
    Ok((gltf.document, gltf.blob))
}

fn validate(origin: &Origin, root: &Root) -> Result<(), SceneError> {
    // The crate's own check of positions looks these accessors up before checking the index.
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let accessors = primitive.attributes.values();
            if let Some(bad) = accessors
                .map(accessors::at)
                .find(|&a| a >= root.accessors.len())
            {
                return Err(origin.invalid(
                    format!("meshes[{m}].primitives[{p}].attributes"),
                    format!(
                        "one of {} accessors: an index inside its table",
                        root.accessors.len()
                    ),
                    bad.to_string(),
                ));
            }
        }
    }
    let mut first: Option<(String, Fault)> = None;
    root.validate(root, JsonPath::new, &mut |path, fault| {
        let path = path().to_string();
        // Bounds of positions are computed here, so files that leave them out are welcome.
        let unneeded =
            fault == Fault::Missing && (path.ends_with(".min") || path.ends_with(".max"));
        if first.is_none() && !unneeded {
            first = Some((path, fault));
        }
    });
    let Some((place, fault)) = first else {
        return Ok(());
    };
    let (expected, found) = match fault {
        Fault::IndexOutOfBounds => ("an index inside its table", "one past the end"),
        Fault::Invalid => ("a value that glTF 2.0 allows", "another"),
        Fault::Missing => ("a value", "none"),
        Fault::Oversize => ("a size that fits in memory", "a larger one"),
        Fault::Unsupported => (
            "a supported extension",
            "an unsupported one that is required",
        ),
    };
    Err(origin.invalid(place, expected, found))
}

/// Reads every buffer and checks that it is as long as the file says.
fn read_buffers(
    origin: &Origin,
    root: &Root,
    mut blob: Option<Vec<u8>>,
) -> Result<Vec<Arc<[u8]>>, SceneError> {
    root.buffers
        .iter()
        .enumerate()
        .map(|(index, buffer)| {
            let place = format!("buffers[{index}]");
            let (bytes, from) = match &buffer.uri {
                None if index == 0 && blob.is_some() => (
                    blob.take().unwrap_or_default(),
                    "the GLB's BIN chunk".to_owned(),
                ),
                None => {
                    return Err(origin.invalid(place, "a uri or the GLB's BIN chunk", "neither"));
                }
                Some(uri) => match uri::parse(uri) {
                    Ok(Uri::Data(bytes)) => (bytes, "the data URI".to_owned()),
                    Ok(Uri::Path(path)) => {
                        let file = origin.sibling(Path::new(&path));
                        (read_file(&file, &place)?, file.display().to_string())
                    }
                    Err(found) => {
                        return Err(origin.invalid(place, "a data URI or relative path", found));
                    }
                },
            };
            if (bytes.len() as u64) < buffer.byte_length.0 {
                return Err(origin.invalid(
                    place,
                    format!("{} bytes", buffer.byte_length.0),
                    format!("{} bytes in {from}", bytes.len()),
                ));
            }
            Ok(bytes.into())
        })
        .collect()
}
