//! Built-in scenes that need no file.

pub mod atrium;
pub mod atrium_furnishing;
pub mod atrium_materials;
pub mod atrium_parts;
pub mod masonry;
pub mod mesh_builder;
pub mod noise;
pub mod organic;
pub mod scene_builder;
pub mod texture_synth;

use crate::scene::Scene;

type Builder = fn() -> Scene;

const SCENES: &[(&str, Builder)] = &[
    ("atrium", atrium::rich),
    ("atrium-plain", atrium::plain),
    ("atrium-shadows", atrium::shadows),
];

const NAMES: &[(&str, &str)] = &[
    (
        "atrium",
        "two-storey colonnaded courtyard, 24 materials with three to four maps each",
    ),
    (
        "atrium-plain",
        "the same architecture with few simple textures",
    ),
    ("atrium-shadows", "atrium-plain with cascaded shadow maps"),
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
    SCENES
        .iter()
        .find(|(n, _)| *n == name)
        .map(|(_, build)| build())
}

#[cfg(test)]
mod tests;
