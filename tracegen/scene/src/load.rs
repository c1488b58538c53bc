//! From a file to a complete [`Scene`].

use super::{Camera, Light, LoadOptions, Loaded, Scene, SceneError, cameras, gltf, obj};
use glam::Vec3;
use std::path::Path;

/// Loads a glTF or OBJ file and completes it as [`complete`] does.
///
/// # Errors
/// See [`SceneError`]; nothing in a file makes this panic.
pub fn load_file(path: &Path, options: &LoadOptions) -> Result<Loaded, SceneError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let mut loaded = match extension.as_deref() {
        Some("gltf" | "glb") => gltf::load(path, options)?,
        Some("obj") => obj::load(path, options)?,
        _ => {
            return Err(SceneError::Unknown {
                spec: path.display().to_string(),
                or_built_in: String::new(),
            });
        }
    };
    loaded.scene.name = path
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    if loaded.scene.triangle_count() == 0 {
        return Err(SceneError::Invalid {
            file: path.to_owned(),
            place: "scene".into(),
            expected: "at least one triangle".into(),
            found: "none".into(),
        });
    }
    complete(&mut loaded.scene);
    Ok(loaded)
}

/// Gives a scene what its source lacks: a camera, and the sun with a sky.
pub fn complete(scene: &mut Scene) {
    if scene.cameras.is_empty() {
        scene.cameras.push(cameras::default_camera(scene));
    }
    make_names_unique(&mut scene.cameras);
    if scene.lights.is_empty() {
        scene.lights.push(default_sun());
        if scene.sky == Vec3::ZERO {
            scene.sky = DEFAULT_SKY;
        }
    }
}

/// Sky radiance of a scene whose file has no lights: a clear day, dimmer than the sun by far.
pub const DEFAULT_SKY: Vec3 = Vec3::new(0.38, 0.47, 0.62);

/// The sun of a scene whose file has no lights.
///
/// It stands at 72 degrees of elevation, so that it reaches the floor of a narrow atrium with an
/// open roof and still shows relief, and off both horizontal axes, so that no axis-aligned wall is
/// exactly edge-on.
#[must_use]
pub fn default_sun() -> Light {
    Light::Directional {
        direction: Vec3::new(0.26, -1.0, 0.19).normalize(),
        color: Vec3::new(3.2, 3.0, 2.7),
    }
}

/// `name`, `name-2`, `name-3`, ... so that `--camera` can choose any of them.
fn make_names_unique(cameras: &mut [Camera]) {
    for i in 1..cameras.len() {
        let (before, rest) = cameras.split_at_mut(i);
        let taken = |name: &str| before.iter().any(|c| c.name == name);
        let base = rest[0].name.clone();
        let mut n = 2;
        while taken(&rest[0].name) {
            rest[0].name = format!("{base}-{n}");
            n += 1;
        }
    }
}
