//! Built-in scenes that need no file, and scenes by name or path.

pub mod atrium;
pub mod atrium_furnishing;
pub mod atrium_materials;
pub mod atrium_parts;
pub mod car;
pub mod car_body;
pub mod car_details;
pub mod chess;
pub mod creature;
pub mod gears;
pub mod glassware;
pub mod jungle;
pub mod jungle_plants;
pub mod jungle_temple;
pub mod lab;
pub mod lab_still;
pub mod masonry;
pub mod meadow;
pub mod meadow_house;
pub mod meadow_parts;
pub mod mesh_builder;
pub mod music_box;
pub mod music_train;
pub mod noise;
pub mod organic;
pub mod scene_builder;
pub mod teapot;
pub mod teapot_patches;
pub mod texture_synth;

use scene::{LoadOptions, Loaded, Scene, SceneError};
use std::path::Path;

type Builder = fn() -> Scene;

const BUILDERS: &[Builder] = &[
    atrium::rich,
    atrium::plain,
    atrium::shadows,
    jungle::scene,
    teapot::scene,
    chess::scene,
    car::scene,
    lab::scene,
    music_box::scene,
    meadow::scene,
];

/// In the order of [`BUILDERS`].
const NAMES: &[(&str, &str)] = &[
    (
        "atrium",
        "two-storey colonnaded courtyard, 26 materials with three to four maps each",
    ),
    (
        "atrium-plain",
        "the same architecture with few simple textures",
    ),
    (
        "atrium-shadows",
        "atrium-plain with four cascaded shadow maps",
    ),
    (
        "jungle",
        "temple ruin among instanced foliage with alpha masks, one shadow map",
    ),
    (
        "teapot",
        "the Utah teapot on a polished floor, 15 K triangles",
    ),
    ("chess", "a chess set on a reflective board, 42 K triangles"),
    (
        "car",
        "a sports car in a studio, paint, glass and chrome, 55 K triangles",
    ),
    (
        "lab",
        "glassware on a chemistry bench, refraction, 98 K triangles",
    ),
    (
        "music-box",
        "gears, comb and pinned cylinder in reflective brass and steel, 106 K triangles",
    ),
    (
        "meadow",
        "lavender rows before a farm house, 600 K triangles",
    ),
];

/// Names of the built-in scenes with a line about each.
#[must_use]
pub fn names() -> &'static [(&'static str, &'static str)] {
    NAMES
}

/// Builds a built-in scene; `None` if there is none of that name. The same name gives the same
/// scene, bit for bit, whatever the number of threads.
#[must_use]
pub fn build(name: &str) -> Option<Scene> {
    let index = NAMES.iter().position(|(known, _)| *known == name)?;
    BUILDERS.get(index).map(|build| build())
}

/// Loads a built-in scene by name, or a glTF or OBJ file by path, with all its images.
///
/// # Errors
/// See [`SceneError`]; nothing in a file makes this panic.
pub fn load(spec: &str) -> Result<Scene, SceneError> {
    load_with(spec, &LoadOptions::ALL).map(|loaded| loaded.scene)
}

/// [`load`] with a choice of images, telling the warnings.
///
/// # Errors
/// See [`SceneError`].
pub fn load_with(spec: &str, options: &LoadOptions) -> Result<Loaded, SceneError> {
    if let Some(mut scene) = build(spec) {
        scene::complete(&mut scene);
        let warnings = Vec::new();
        return Ok(Loaded { scene, warnings });
    }
    scene::load_file(Path::new(spec), options).map_err(|error| match error {
        SceneError::Unknown { spec, .. } => {
            let known: Vec<&str> = names().iter().map(|(name, _)| *name).collect();
            SceneError::Unknown {
                spec,
                or_built_in: format!(" or one of the built-in scenes ({})", known.join(", ")),
            }
        }
        other => other,
    })
}

#[cfg(test)]
mod tests;
