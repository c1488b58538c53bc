//! Built-in scenes that need no file.

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

use crate::scene::Scene;

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

#[cfg(test)]
mod tests;
