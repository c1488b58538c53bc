//! Built-in scenes that need no file, and scenes by name or path.

mod atrium;
mod car;
mod chess;
mod creature;
mod gears;
mod glassware;
mod jungle;
mod lab;
mod masonry;
mod meadow;
mod mesh_builder;
mod music_box;
mod noise;
mod organic;
mod plant;
mod row;
mod scene_builder;
mod scene_text;
mod surfaces;
mod teapot;
mod texture_synth;

use scene::{LoadOptions, Loaded, Scene, SceneError};
use scene_builder::SceneBuilder;
use scene_text::Code;
use std::ops::RangeInclusive;
use std::path::Path;

/// A built-in scene. A test compares this table with the scenes, so that listing them builds none.
#[derive(Clone, Debug)]
pub struct Builtin {
    /// Name on the command line.
    pub name: &'static str,
    /// What it shows, and the scene for which it is a stand-in.
    pub description: &'static str,
    /// Number of triangles over all instances.
    pub triangles: u64,
    /// Its cameras; the first is the default.
    pub cameras: &'static [&'static str],
    /// Allowed numbers of instances in `name:NUMBER`.
    pub instances: Option<RangeInclusive<u32>>,
    /// Its rows, and the functions that they name.
    text: &'static str,
    code: Code,
}

/// An entry of [`BUILTINS`].
const fn builtin(
    name: &'static str,
    triangles: u64,
    cameras: &'static [&'static str],
    description: &'static str,
    text: &'static str,
    code: Code,
) -> Builtin {
    Builtin {
        name,
        description,
        triangles,
        cameras,
        instances: None,
        text,
        code,
    }
}

/// The built-in scenes.
pub const BUILTINS: &[Builtin] = &[
    builtin(
        "atrium",
        274_152,
        &["default", "gallery", "arcade"],
        "two-storey colonnaded courtyard, 26 materials with three to four maps each",
        include_str!("../data/atrium.scene"),
        atrium::CODE,
    ),
    builtin(
        "atrium-plain",
        66_672,
        &["default", "gallery", "arcade"],
        "the same architecture with few simple textures",
        include_str!("../data/atrium-plain.scene"),
        atrium::CODE,
    ),
    builtin(
        "atrium-shadows",
        66_672,
        &["default", "gallery", "arcade"],
        "atrium-plain with four cascaded shadow maps",
        include_str!("../data/atrium-plain.scene"),
        atrium::CODE,
    ),
    builtin(
        "jungle",
        440_886,
        &["default", "ruin", "thicket"],
        "temple ruin among instanced foliage with alpha masks, one shadow map",
        include_str!("../data/jungle.scene"),
        jungle::CODE,
    ),
    builtin(
        "teapot",
        14_972,
        &["default", "low"],
        "the Utah teapot on a polished floor",
        include_str!("../data/teapot.scene"),
        Code::NONE,
    ),
    builtin(
        "chess",
        42_468,
        &["default", "low"],
        "a chess set on a reflective board",
        include_str!("../data/chess.scene"),
        chess::CODE,
    ),
    builtin(
        "car",
        55_596,
        &["default", "rear", "side"],
        "a sports car in a studio, paint, glass and chrome",
        include_str!("../data/car.scene"),
        car::CODE,
    ),
    builtin(
        "lab",
        97_886,
        &["default", "side"],
        "glassware on a chemistry bench, refraction",
        include_str!("../data/lab.scene"),
        lab::CODE,
    ),
    builtin(
        "music-box",
        106_752,
        &["default", "train"],
        "gears, comb and pinned cylinder in reflective brass and steel",
        include_str!("../data/music-box.scene"),
        music_box::CODE,
    ),
    builtin(
        "meadow",
        599_974,
        &["default", "yard", "rows"],
        "lavender rows before a farm house",
        include_str!("../data/meadow.scene"),
        meadow::CODE,
    ),
    Builtin {
        instances: Some(plant::INSTANCES),
        ..builtin(
            "plant",
            1_037_726,
            &["default", "aisle", "walkway", "pumps", "overview"],
            "industrial hall of 20,000 instances (plant:N has N) under moving cranes",
            include_str!("../data/plant.scene"),
            plant::CODE,
        )
    },
];

/// Builds a built-in scene; `None` if no scene has that name. The same name gives the same scene,
/// bit for bit, for any number of threads.
///
/// # Errors
/// A number of instances (`name:NUMBER`) that the scene does not allow.
pub fn build(spec: &str) -> Result<Option<Scene>, SceneError> {
    let (name, number) = match spec.split_once(':') {
        Some((name, number)) => (name, Some(number)),
        None => (spec, None),
    };
    let Some(found) = BUILTINS.iter().find(|b| b.name == name) else {
        return Ok(None);
    };
    let refused = |expected: String| SceneError::Parameter {
        spec: spec.to_owned(),
        expected,
    };
    let number = match (&found.instances, number) {
        (Some(range), Some(number)) => {
            let number = number.parse().ok().filter(|number| range.contains(number));
            let (low, high) = (range.start(), range.end());
            let expected = || format!("{name}:N with N instances from {low} to {high}");
            number.ok_or_else(|| refused(expected()))?
        }
        (None, Some(_)) => return Err(refused(format!("{name}, which has no parameter"))),
        (_, None) => plant::DEFAULT_INSTANCES,
    };
    let mut scene = SceneBuilder::new(name);
    scene_text::read(&mut scene, found.text, found.code);
    match name {
        "atrium-shadows" => scene.shadow_cascades(4),
        "plant" => plant::lay_out(&mut scene, number),
        _ => {}
    }
    Ok(Some(scene.finish()))
}

/// Loads a built-in scene by name, or a glTF or OBJ file by path, with all its images.
///
/// # Errors
/// See [`SceneError`]. No file contents cause a panic.
pub fn load(spec: &str) -> Result<Scene, SceneError> {
    load_with(spec, &LoadOptions::ALL).map(|loaded| loaded.scene)
}

/// [`load`] with a choice of images. Also returns the warnings.
///
/// # Errors
/// See [`SceneError`].
pub fn load_with(spec: &str, options: &LoadOptions) -> Result<Loaded, SceneError> {
    if let Some(mut scene) = build(spec)? {
        if let Some(name) = options.named_animation() {
            return Err(SceneError::Parameter {
                spec: spec.to_owned(),
                expected: format!("a glTF file with animations, found animation '{name}'"),
            });
        }
        scene::complete(&mut scene);
        if options.slots != LoadOptions::ALL.slots {
            scene.keep_texture_slots(options.slots);
        }
        return Ok(Loaded {
            scene,
            warnings: Vec::new(),
            files: Vec::new(),
            animations: Vec::new(),
        });
    }
    scene::load_file(Path::new(spec), options).map_err(|error| match error {
        SceneError::Unknown { spec, .. } => {
            let known: Vec<&str> = BUILTINS.iter().map(|b| b.name).collect();
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
