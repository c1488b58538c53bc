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
mod scene_builder;
mod teapot;
mod texture_synth;

use scene::{LoadOptions, Loaded, Scene, SceneError};
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
    builder: Builder,
}

/// The function that builds a scene.
#[derive(Clone, Copy, Debug)]
enum Builder {
    /// A scene without parameters.
    Fixed(fn() -> Scene),
    /// A scene with a number of instances; the default number comes first.
    Sized(u32, fn(u32) -> Scene),
}

/// The built-in scenes.
pub const BUILTINS: &[Builtin] = &[
    Builtin {
        name: "atrium",
        description: "two-storey colonnaded courtyard, 26 materials with three to four maps each",
        triangles: 274_152,
        cameras: &["default", "gallery", "arcade"],
        instances: None,
        builder: Builder::Fixed(atrium::rich),
    },
    Builtin {
        name: "atrium-plain",
        description: "the same architecture with few simple textures",
        triangles: 66_672,
        cameras: &["default", "gallery", "arcade"],
        instances: None,
        builder: Builder::Fixed(atrium::plain),
    },
    Builtin {
        name: "atrium-shadows",
        description: "atrium-plain with four cascaded shadow maps",
        triangles: 66_672,
        cameras: &["default", "gallery", "arcade"],
        instances: None,
        builder: Builder::Fixed(atrium::shadows),
    },
    Builtin {
        name: "jungle",
        description: "temple ruin among instanced foliage with alpha masks, one shadow map",
        triangles: 440_886,
        cameras: &["default", "ruin", "thicket"],
        instances: None,
        builder: Builder::Fixed(jungle::scene),
    },
    Builtin {
        name: "teapot",
        description: "the Utah teapot on a polished floor",
        triangles: 14_972,
        cameras: &["default", "low"],
        instances: None,
        builder: Builder::Fixed(teapot::scene),
    },
    Builtin {
        name: "chess",
        description: "a chess set on a reflective board",
        triangles: 42_468,
        cameras: &["default", "low"],
        instances: None,
        builder: Builder::Fixed(chess::scene),
    },
    Builtin {
        name: "car",
        description: "a sports car in a studio, paint, glass and chrome",
        triangles: 55_596,
        cameras: &["default", "rear", "side"],
        instances: None,
        builder: Builder::Fixed(car::scene),
    },
    Builtin {
        name: "lab",
        description: "glassware on a chemistry bench, refraction",
        triangles: 97_886,
        cameras: &["default", "side"],
        instances: None,
        builder: Builder::Fixed(lab::scene),
    },
    Builtin {
        name: "music-box",
        description: "gears, comb and pinned cylinder in reflective brass and steel",
        triangles: 106_752,
        cameras: &["default", "train"],
        instances: None,
        builder: Builder::Fixed(music_box::scene),
    },
    Builtin {
        name: "meadow",
        description: "lavender rows before a farm house",
        triangles: 599_974,
        cameras: &["default", "yard", "rows"],
        instances: None,
        builder: Builder::Fixed(meadow::scene),
    },
    Builtin {
        name: "plant",
        description: "industrial hall of 20,000 instances (plant:N has N) under moving cranes",
        triangles: 1_037_726,
        cameras: &["default", "aisle", "walkway", "pumps", "overview"],
        instances: Some(plant::INSTANCES),
        builder: Builder::Sized(plant::DEFAULT_INSTANCES, plant::with_instances),
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
    match (found.builder, &found.instances, number) {
        (Builder::Fixed(build), _, None) => Ok(Some(build())),
        (Builder::Sized(usual, build), _, None) => Ok(Some(build(usual))),
        (Builder::Sized(_, build), Some(range), Some(number)) => {
            let number = number.parse().ok().filter(|number| range.contains(number));
            let (low, high) = (range.start(), range.end());
            let expected = || format!("{name}:N with N instances from {low} to {high}");
            Ok(Some(build(number.ok_or_else(|| refused(expected()))?)))
        }
        (_, _, Some(_)) => Err(refused(format!("{name}, which has no parameter"))),
    }
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
