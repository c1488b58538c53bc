//! glTF 2.0, text and binary.
//!
//! The `gltf` crate parses the JSON and checks that indices are within their tables. Bytes are read
//! here with separate range checks, because the crate's readers panic on accessors that exceed
//! their buffers.
//!
//! docs/use/scene-files.md lists the supported and the ignored features. Degenerate triangles are
//! kept: they take a primitive number and cover nothing.

mod accessors;
mod binary;
mod camera_track;
mod channels;
#[cfg(feature = "draco")]
mod draco;
#[cfg(not(feature = "draco"))]
#[path = "no_draco.rs"]
mod draco;
mod features;
mod instancing;
mod material_textures;
mod materials;
mod meshes;
mod meshopt;
mod morphs;
mod nodes;
mod placing;
mod rig;
mod skins;
#[cfg(test)]
mod tests;
mod transforms;
mod tree;
mod variants;

use super::files::{Bytes, Origin, read_start, shown};
use super::lookup::Lookup;
use super::origin;
use super::uri::{self, Uri};
use super::warnings::Warnings;
use super::{LoadOptions, Loaded, Scene, SceneError};
use accessors::Buffers;
pub(crate) use camera_track::camera_track;
use gltf::binary::Glb;
use gltf::json::validation::{Error as Fault, Validate};
use gltf::json::{Path as JsonPath, Root};
use placing::{PlacedRig, Placing};
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use transforms::Local;

/// Loads a `.gltf` or `.glb` file.
///
/// # Errors
/// See [`SceneError`].
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, SceneError> {
    let origin = Origin::new(path);
    let mut warnings = Warnings::default();
    let Parsed {
        document,
        transforms,
        texture_images,
        blob,
        json_bytes,
    } = parse(&origin, "scene", &mut warnings)?;
    let root = document.as_json();
    let mut lookup = Lookup::default();
    let buffers = read_buffers(&origin, root, blob, &mut lookup, &mut warnings)?;
    let buffers = Buffers::new(root, buffers, &origin, json_bytes);

    let rig = rig::read(
        root,
        &transforms,
        &buffers,
        options.animation.as_deref(),
        &mut warnings,
    )?;
    let rig = rig.map(|rig| PlacedRig::new(rig, options.time_s, &buffers));
    let local = |node: usize| match &rig {
        Some(placed) => placed.local(node),
        None => transforms[node].transform(),
    };
    let placed = nodes::walk(root, local, &origin)?;
    let variant = variants::chosen(root, options.variant.as_deref(), &origin)?;
    let mut materials =
        materials::Table::new(&document, &buffers, options, &texture_images, &mut lookup);
    let mut placing = Placing {
        buffers: &buffers,
        transforms: &transforms,
        variant,
        rig,
        meshes: Vec::new(),
        in_world: Vec::new(),
        loaded: HashMap::new(),
    };
    for (node, transform) in &placed.meshes {
        placing.add(*node, *transform, &mut materials, &mut warnings)?;
    }
    let (mut scene, rig) = placing.finish()?;
    let moved = place_views(root, &placed, &mut scene, &mut warnings);
    scene.in_metres = true;
    scene.animation = rig.and_then(|placed| placed.into_animation(moved));
    warnings.append(materials.warnings);
    scene.images = materials.requests.images(&origin)?;
    scene.materials = materials.materials;
    Ok(Loaded {
        scene,
        warnings: warnings.into_sentences(),
        files: referenced_files(&origin, root, &mut lookup),
        animations: rig::names(root).iter().map(|name| shown(name)).collect(),
    })
}

/// The nodes of a scene's cameras and lights, in the scene's order.
struct ViewNodes {
    cameras: Vec<usize>,
    lights: Vec<usize>,
}

/// Adds cameras and lights to a scene. Its origin is already set.
fn place_views(
    root: &Root,
    placed: &nodes::Placed,
    scene: &mut Scene,
    warnings: &mut Warnings,
) -> ViewNodes {
    let mut of = ViewNodes {
        cameras: Vec::new(),
        lights: Vec::new(),
    };
    for &(node, transform) in &placed.cameras {
        let place = origin::relative_transform(transform, scene.origin);
        if let Some(camera) = nodes::camera(root, node, place, warnings) {
            scene.cameras.push(camera);
            of.cameras.push(node);
        }
    }
    for &(node, transform) in &placed.lights {
        let place = origin::relative_transform(transform, scene.origin);
        if let Some(light) = nodes::light(root, node, place, warnings) {
            scene.lights.push(light);
            of.lights.push(node);
        }
    }
    of
}

/// The file that a URI names: as written, or else as another system or tool would write it.
fn named_file(origin: &Origin, uri: &str, path: String, lookup: &mut Lookup) -> PathBuf {
    let names = uri::names(uri, &path);
    match lookup.find(origin.folder(), &names) {
        Some(found) => found.path,
        None => origin.sibling(Path::new(&path)),
    }
}

/// The file that a URI names, with a warning if its name is another one.
fn find_file(
    origin: &Origin,
    uri: &str,
    path: String,
    place: &str,
    lookup: &mut Lookup,
    warnings: &mut Warnings,
) -> PathBuf {
    let exact = origin.sibling(Path::new(&path));
    let file = named_file(origin, uri, path, lookup);
    if file != exact {
        warnings.count("inexact name", || {
            format!("{place}: '{uri}' is taken from {}", file.display())
        });
    }
    file
}

/// The file itself and every file that its URIs name.
fn referenced_files(origin: &Origin, root: &Root, lookup: &mut Lookup) -> Vec<PathBuf> {
    let buffers = root
        .buffers
        .iter()
        .filter_map(|buffer| buffer.uri.as_deref());
    let images = root.images.iter().filter_map(|image| image.uri.as_deref());
    let named = buffers
        .chain(images)
        .filter_map(|uri| match uri::parse(uri) {
            Ok(Uri::Path(path)) => Some(named_file(origin, uri, path, lookup)),
            Ok(Uri::Data(_)) | Err(_) => None,
        });
    std::iter::once(origin.file.clone()).chain(named).collect()
}

/// A file without its buffers.
struct Parsed {
    document: gltf::Document,
    /// The nodes' transforms.
    transforms: Vec<Local>,
    /// The image of each texture.
    texture_images: Vec<Option<usize>>,
    /// The GLB's BIN chunk.
    blob: Option<Bytes>,
    /// Size of the JSON, or of the GLB.
    json_bytes: usize,
}

/// Reads the container, which `place` refers to, and its JSON, and checks every index.
fn parse(origin: &Origin, place: &str, warnings: &mut Warnings) -> Result<Parsed, SceneError> {
    let (bytes, _) = read_start(&origin.file, place, u64::MAX)?;
    let (json, blob) = if bytes.starts_with(b"glTF") {
        let whole = binary::check(&bytes, origin)?;
        if whole.len() < bytes.len() {
            let rest = bytes.len() - whole.len();
            warnings.say(&format!(
                "{rest} bytes after the length in the GLB header are left out"
            ));
        }
        let glb = Glb::from_slice(whole)
            .map_err(|e| origin.invalid("GLB", "a glTF 2.0 asset", e.to_string()))?;
        let bin = glb.bin.map(|bin| {
            let start = bin.as_ptr().addr() - bytes.as_ptr().addr();
            bytes.part(start..start + bin.len())
        });
        (glb.json, bin)
    } else {
        (Cow::Borrowed(&*bytes), None)
    };
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&json);
    let texture_images = features::check(json, origin, warnings)?;
    let root = Root::from_slice(json).map_err(|e| features::not_gltf(origin, &e))?;
    validate(origin, &root)?;
    Ok(Parsed {
        transforms: transforms::read(json, origin)?,
        texture_images,
        document: gltf::Document::from_json_without_validation(root),
        blob,
        json_bytes: bytes.len(),
    })
}

fn validate(origin: &Origin, root: &Root) -> Result<(), SceneError> {
    // The crate's check of positions uses these accessors before it checks the index.
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
        // The crate supports fewer extensions than this loader.
        if first.is_some() || fault == Fault::Unsupported {
            return;
        }
        let path = path().to_string();
        // Bounds of positions are computed here, so files may leave them out. An accessor without a
        // view holds zeros or Draco's decoded values.
        let unneeded = fault == Fault::Missing
            && [".min", ".max", ".bufferView"]
                .iter()
                .any(|end| path.ends_with(end));
        if !(unneeded || is_zero_stride(root, &path)) {
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
        Fault::Unsupported => ("a supported extension", "another"),
    };
    Err(origin.invalid(place, expected, found))
}

/// Whether this is the place of a stride of 0, which stands for none.
fn is_zero_stride(root: &Root, path: &str) -> bool {
    let view = path
        .strip_prefix("bufferViews[")
        .and_then(|rest| rest.strip_suffix("].byteStride"))
        .and_then(|number| root.buffer_views.get(number.parse::<usize>().ok()?));
    view.and_then(|view| view.byte_stride)
        .is_some_and(|stride| stride.0 == 0)
}

/// Reads from every buffer as many bytes as the file states. Fewer bytes are an error.
fn read_buffers(
    origin: &Origin,
    root: &Root,
    mut blob: Option<Bytes>,
    lookup: &mut Lookup,
    warnings: &mut Warnings,
) -> Result<Vec<Bytes>, SceneError> {
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (index, buffer) in root.buffers.iter().enumerate() {
        let place = format!("buffers[{index}]");
        let wanted = buffer.byte_length.0;
        let whole = |bytes: Bytes| {
            let length = bytes.len() as u64;
            (bytes, length)
        };
        let ((mut bytes, length), from) = match &buffer.uri {
            None if index == 0 && blob.is_some() => (
                whole(blob.take().unwrap_or_default()),
                "the GLB's BIN chunk".to_owned(),
            ),
            // Only compressed views refer to it.
            None if meshopt::is_fallback(buffer) => {
                buffers.push(Bytes::default());
                continue;
            }
            None => {
                return Err(origin.invalid(place, "a uri or the GLB's BIN chunk", "neither"));
            }
            Some(uri) => match uri::parse(uri) {
                Ok(Uri::Data(bytes)) => (whole(Bytes::Held(bytes)), "the data URI".to_owned()),
                Ok(Uri::Path(path)) => {
                    let file = find_file(origin, uri, path, &place, lookup, warnings);
                    let read = read_start(&file, &place, wanted)?;
                    (read, file.display().to_string())
                }
                Err(found) => {
                    return Err(origin.invalid(place, "a data URI or relative path", found));
                }
            },
        };
        if (bytes.len() as u64) < wanted {
            return Err(origin.invalid(
                place,
                format!("{wanted} bytes"),
                format!("{} bytes in {from}", bytes.len()),
            ));
        }
        // A BIN chunk is padded to four bytes.
        if length > wanted.next_multiple_of(4) {
            warnings.count("long buffer", || {
                format!("{place}: {from} has {length} bytes, {wanted} are used")
            });
        }
        // At most as long as the vector.
        bytes.truncate(wanted as usize);
        buffers.push(bytes);
    }
    Ok(buffers)
}
