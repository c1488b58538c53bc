//! Wavefront OBJ with MTL materials, including common deviations (docs/use/scene-files.md).

mod elements;
mod library;
mod materials;
mod meshes;
mod polygon;
mod statements;
#[cfg(test)]
mod tests;

use crate::error::SceneError;
use crate::files::{Origin, read_file};
use crate::image_files::Requests;
use crate::lookup::Lookup;
use crate::warnings::Warnings;
use crate::{Instance, LoadOptions, Loaded, Material, Scene};
use elements::Elements;
use glam::Affine3A;
use statements::{decode, without_comment};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Most bytes of a material library: a material takes a few hundred.
const MAX_LIBRARY_BYTES: u64 = 1 << 28;

/// Loads an OBJ file and the MTL files that it names.
///
/// # Errors
/// See [`SceneError`].
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, SceneError> {
    let origin = Origin::new(path);
    if let Some(name) = options.named_animation() {
        let expected = "a glTF file with animations";
        return Err(origin.invalid("animations", expected, format!("'{name}'")));
    }
    let mut warnings = Warnings::default();
    let text = decode(read_file(path, "scene", u64::MAX)?, &origin)?;
    let elements = Elements::read(&text, &origin)?;
    drop(text);
    warn_of_ignored(&elements, &mut warnings);

    let mut lookup = Lookup::default();
    let mut requests = Requests::default();
    let mut scene = Scene {
        origin: elements.origin,
        ..Scene::default()
    };
    // The last material of a name wins.
    let mut by_name: HashMap<String, usize> = HashMap::new();
    // Names may contain ` #`, which may also begin a comment.
    let mut by_start: HashMap<String, usize> = HashMap::new();
    let libraries = libraries(&elements, &origin, &mut lookup, &mut warnings);
    for file in &libraries {
        let library = Origin::new(file);
        let text = decode(read_file(file, "mtllib", MAX_LIBRARY_BYTES)?, &library)?;
        for entry in library::read(&text, &library, &mut warnings) {
            let mut maker = materials::Maker {
                library: &library,
                scene: &origin,
                options,
                lookup: &mut lookup,
                requests: &mut requests,
                warnings: &mut warnings,
            };
            scene.materials.push(maker.material(&entry));
            let index = scene.materials.len() - 1;
            by_start.insert(without_comment(&entry.name).to_owned(), index);
            by_name.insert(entry.name, index);
        }
    }

    let meshes = meshes::build(&elements, |run| {
        let name = run.material.as_deref()?;
        let found = (by_name.get(name)).or_else(|| by_start.get(without_comment(name)));
        if found.is_none() && !libraries.is_empty() {
            warnings.count("unknown material", || {
                format!("no library has a material '{name}'; a default is used")
            });
        }
        found.copied()
    });
    let from_file = scene.materials.len();
    for (mut mesh, material) in meshes {
        mesh.material = material.unwrap_or(from_file);
        if mesh.material == scene.materials.len() {
            // One material for all faces without a material.
            scene.materials.push(Material {
                name: "default".into(),
                ..Material::default()
            });
        }
        scene.instances.push(Instance {
            mesh: scene.meshes.len(),
            transform: Affine3A::IDENTITY,
        });
        scene.meshes.push(mesh);
    }
    scene.images = requests.images(&origin)?;
    let files = std::iter::once(path.to_owned()).chain(lookup.into_found());
    Ok(Loaded {
        scene,
        warnings: warnings.into_sentences(),
        files: files.collect(),
        animations: Vec::new(),
    })
}

fn warn_of_ignored(elements: &Elements, warnings: &mut Warnings) {
    for (count, what) in [
        (elements.not_faces, "points, lines and faces of two corners"),
        (elements.free_form, "statements of curves and surfaces"),
    ] {
        if count > 0 {
            warnings.say(&format!("{count} {what} are left out"));
        }
    }
    if elements.colors_of_bytes {
        warnings.say("vertex colours above 1 are taken as bytes, 0 to 255");
    }
}

/// The libraries that exist, each once. A missing one affects colours, not shapes.
fn libraries(
    elements: &Elements,
    origin: &Origin,
    lookup: &mut Lookup,
    warnings: &mut Warnings,
) -> Vec<PathBuf> {
    let (mut seen, mut files) = (HashSet::new(), HashSet::new());
    let mut libraries = Vec::new();
    for (line, text) in &elements.libraries {
        if !seen.insert(text) {
            continue;
        }
        // Either one name, which may contain spaces, or several names.
        let whole = library::file_names(text);
        let names = match lookup.find(origin.folder(), &whole) {
            Some(_) => vec![whole],
            None => split_names(without_comment(text)),
        };
        for names in names {
            let place = || format!("line {line}, mtllib");
            match lookup.find(origin.folder(), &names) {
                Some(found) => {
                    if found.inexact {
                        let file = found.path.display();
                        warnings.count("inexact library", || {
                            format!("{}: '{}' is taken from {file}", place(), names[0])
                        });
                    }
                    let same_file = found.path.canonicalize();
                    if files.insert(same_file.unwrap_or_else(|_| found.path.clone())) {
                        libraries.push(found.path);
                    }
                }
                None => warnings.count("missing library", || {
                    format!(
                        "{}: '{}' is not there; default materials are used",
                        place(),
                        names[0]
                    )
                }),
            }
        }
    }
    libraries
}

/// Consecutive names, each of which ends with `.mtl` and may contain spaces.
fn split_names(text: &str) -> Vec<Vec<String>> {
    let mut names = Vec::new();
    let mut name = String::new();
    for word in text.split_ascii_whitespace() {
        name.push_str(if name.is_empty() { "" } else { " " });
        name.push_str(word);
        if word
            .trim_end_matches('"')
            .to_ascii_lowercase()
            .ends_with(".mtl")
        {
            names.push(std::mem::take(&mut name));
        }
    }
    names.push(name);
    (names.iter())
        .map(|name| library::file_names(name))
        .filter(|names| !names.is_empty())
        .collect()
}
